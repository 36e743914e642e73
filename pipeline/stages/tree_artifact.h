#pragma once
/// The tree of the vessel back from the artifact of stage centerline.
#include <vector>

#include "pipeline/stages/workspace.h"
#include "preprocess/centerline/centerline.h"

namespace wireplan::pipeline {

/// As find_tree() made it. Expects the stage to be done.
std::vector<preprocess::Branch> read_tree(const Workspace& work);

}  // namespace wireplan::pipeline
