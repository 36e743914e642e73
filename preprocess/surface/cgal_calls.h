#pragma once
/// CGAL's long algorithms on plain surfaces: compiled once, apart from what is ours, since they
/// take two minutes of compiling and sanitizers leave them out. For the .cpp files here, not for
/// other folders.
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// Pairs of triangles that cut each other. The surface is manifold and consistently oriented, as
/// for all below.
std::vector<std::pair<int, int>> cutting_pairs(const Surface& surface);

/// Isotropic remeshing of part after part, part k to edges of edge_length[k] mm; parts without
/// triangles are passed over. Borders of parts stay, and edges at which the surface turns by more
/// than an angle. None where CGAL loses its way on the mesh that it makes of them, as of thin
/// parts.
std::optional<Surface> remesh_parts(const Surface& surface,
                                    const std::vector<int>& part_of_triangle,
                                    const std::vector<double>& edge_length, double crease_deg,
                                    int iterations);

/// What at least one of two closed surfaces encloses; empty where CGAL finds no manifold one, as
/// where a surface cuts itself. Numbered by where its triangles are, so that the same bits come out
/// of every process.
std::optional<Surface> union_of(const Surface& a, const Surface& b);

/// What it costs to give a triangle the label 0 and 1.
struct LabelCost {
  double zero = 0.0, one = 0.0;
};
/// A label, 0 or 1, for each triangle of a closed surface, so that the sum of the triangles' costs
/// and of edge_cost(triangle, its neighbour, length [mm]) of edges between two labels is least (a
/// minimum cut).
std::vector<std::size_t> cut_apart(const Surface& surface,
                                   const std::vector<LabelCost>& triangle_cost,
                                   const std::function<double(int, int, double)>& edge_cost);

}  // namespace wireplan::preprocess
