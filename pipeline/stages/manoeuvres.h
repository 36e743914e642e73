#pragma once
/// What a case tried: its straight pushes, and the manoeuvres that were found where none of those
/// reaches and holds under disturbances.
#include <vector>

#include "pipeline/stages/stage_work.h"

namespace wireplan::pipeline {

/// Both, in the order of their trials. Expects the stages `trials` and `manoeuvres` to be done.
std::vector<plan::Candidate> list_tried(Workspace& work);

/// The trial of a candidate in that list.
simulate::TrialResult read_trial(const Workspace& work, std::size_t id);

/// The level of a candidate's trial as read_trial() gives it.
std::string level_of(const Workspace& work, std::size_t id);

/// Levels of trials (plan/search.h). Those but the full ones have folders of these names in the
/// folder of the trials.
inline constexpr const char* kScoutLevel = "scout";
inline constexpr const char* kProbeLevel = "probe";
inline constexpr const char* kFullLevel = "full";

}  // namespace wireplan::pipeline
