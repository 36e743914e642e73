#pragma once
/// Signed distances of a surface on the nodes of a grid: positive inside it.
#include <vector>

#include "simulate/wall/sample_grid.h"

namespace wireplan::simulate {

/// Takes over the distances to the triangles near the boxes at all nodes where they are shorter
/// than what is there, and than the grid's limit.
void scatter_distances(SampleGrid& grid, const Surface& surface, const std::vector<NodeBox>& boxes);

/// Gives each node that no distance reached, and then each brick without samples, the sign of a
/// neighbour. That is right, since there is no wall between two neighbours beyond the band.
void spread_signs(SampleGrid& grid);

}  // namespace wireplan::simulate
