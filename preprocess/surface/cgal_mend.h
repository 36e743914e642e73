#pragma once
/// CGAL's half-edge mesh and its repairs, which take two minutes to compile and therefore see
/// nothing of ours that could change. For the .cpp files here, not for other folders.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

namespace wireplan::preprocess {

using CgalKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CgalMesh = CGAL::Surface_mesh<CgalKernel::Point_3>;

/// Edges without length and triangles without area are collapsed; those that cannot be, stay.
void remove_degenerate(CgalMesh& mesh);

/// Makes triangles anew around those that cut each other. False where some still do; the mesh may
/// have changed then too.
bool remove_self_intersections(CgalMesh& mesh);

/// How a hole is closed: by triangles between its vertices; by such that are as fine as those round
/// it; by such that go on smoothly from the surface too.
enum class HoleFill { kTriangles, kFine, kSmooth };
/// Closes the hole of a border edge.
void fill_hole(CgalMesh& mesh, CgalMesh::Halfedge_index edge, HoleFill fill);

}  // namespace wireplan::preprocess
