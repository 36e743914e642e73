#pragma once
/// What a run has for the page of its report (page.h): which insertions can be played, and where
/// the volume is cut.
#include <vector>

#include "pipeline/report/page.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/stage_work.h"

namespace wireplan::pipeline {

/// Trials that the page can play: the best kPlansPlayed plans by rank, then of each wire without
/// one among them its best plan, or the attempt that ended nearest to the target.
std::vector<int> choose_played(const ReportInput& report);

/// Of each wire its best plan, or the attempt that ended nearest to the target where it has none;
/// wires that never entered are left out.
std::vector<int> best_of_each_wire(const ReportInput& report);

/// Slices at the access, the target, the place of the largest force on the wall and on the way;
/// none where the case starts from a surface. `peak_force` is per triangle [N].
std::optional<Slices> cut_case_slices(Workspace& work, const std::vector<double>& peak_force);

}  // namespace wireplan::pipeline
