#pragma once
/// Signed distances of a surface on the nodes of a grid: positive inside it.
#include <vector>

#include "simulate/wall/sample_grid.h"

namespace wireplan::simulate {

/// Takes over the distances to the triangles near the boxes at all nodes where they are shorter
/// than what is there, and than the grid's limit.
void scatter_distances(SampleGrid& grid, const Surface& surface, const std::vector<NodeBox>& boxes);

/// Gives unreached nodes, then bricks without samples, the sign of a neighbour: between two
/// neighbours beyond the band there is no wall.
void spread_signs(SampleGrid& grid);

}  // namespace wireplan::simulate
