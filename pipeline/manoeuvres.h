#pragma once
/// What a case tried: its straight pushes, and the manoeuvres that were found where none of those
/// reaches.
#include <vector>

#include "pipeline/stage_work.h"

namespace wireplan::pipeline {

/// Both, in the order of their trials. Expects the stages `trials` and `manoeuvres` to be done.
std::vector<plan::Candidate> list_tried(Workspace& work);

/// The trial of a candidate in that list.
simulate::TrialResult read_trial(const Workspace& work, std::size_t id);

/// Whether a candidate was scouted only, so that read_trial() gives the scout's trial.
bool is_scouted(const Workspace& work, std::size_t id);

/// Where scouts' trials are, in the folder of the trials.
inline constexpr const char* kScoutFolder = "scout";

}  // namespace wireplan::pipeline
