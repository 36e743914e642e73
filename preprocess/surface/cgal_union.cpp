#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "preprocess/surface/cgal_calls.h"
#include "preprocess/surface/cgal_mesh.h"

namespace wireplan::preprocess {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

using Halfedge = CgalMesh::Halfedge_index;

double length_of(const CgalMesh& mesh, Halfedge h) {
  return std::sqrt(CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h))));
}

/// Takes a triangle out that is much longer than high: its short edge is collapsed, or, where none
/// is short, its long one turned. False where the mesh round it does not allow that.
bool remove_sliver(CgalMesh& mesh, CgalMesh::Face_index face) {
  constexpr double kShort = 0.1;  // of the longest edge
  const Halfedge first = mesh.halfedge(face);
  const std::array<Halfedge, 3> edges = {first, mesh.next(first), mesh.prev(first)};
  Halfedge shortest = first, longest = first;
  for (const Halfedge h : edges) {
    if (length_of(mesh, h) < length_of(mesh, shortest)) shortest = h;
    if (length_of(mesh, h) > length_of(mesh, longest)) longest = h;
  }
  if (length_of(mesh, shortest) < kShort * length_of(mesh, longest)) {
    const CgalMesh::Edge_index edge = mesh.edge(shortest);
    if (!CGAL::Euler::does_satisfy_link_condition(edge, mesh)) return false;
    CGAL::Euler::collapse_edge(edge, mesh);
    return true;
  }
  const auto apex = mesh.target(mesh.next(longest)),
             other = mesh.target(mesh.next(mesh.opposite(longest)));
  if (apex == other || mesh.halfedge(apex, other) != CgalMesh::null_halfedge()) return false;
  CGAL::Euler::flip_edge(longest, mesh);
  return true;
}

bool is_sliver(const CgalMesh& mesh, CgalMesh::Face_index face) {
  constexpr double kFlat = 1e-3;  // height of its length
  double longest = 0.0;
  for (const Halfedge h : mesh.halfedges_around_face(mesh.halfedge(face))) {
    longest = std::max(longest, length_of(mesh, h));
  }
  return !(2.0 * pmp::face_area(face, mesh) > kFlat * longest * longest);
}

/// Where two surfaces cross, the cut leaves slivers. Some come back in another place, so this is
/// done a few times.
void remove_slivers(CgalMesh& mesh) {
  for (int round = 0; round < 10; ++round) {
    std::vector<CgalMesh::Face_index> slivers;
    for (const CgalMesh::Face_index f : mesh.faces()) {
      if (is_sliver(mesh, f)) slivers.push_back(f);
    }
    bool changed = false;
    for (const CgalMesh::Face_index f : slivers) {
      if (!mesh.is_removed(f) && is_sliver(mesh, f)) changed = remove_sliver(mesh, f) || changed;
    }
    if (!changed) return;
  }
}

/// The same triangles, numbered by where they are: vertices by their coordinates, triangles by
/// their vertices, the first of which is the least. CGAL numbers the patches of a union by the
/// addresses at which they happen to lie in memory.
Surface in_order(const Surface& surface) {
  std::vector<int> order(static_cast<std::size_t>(surface.vertices.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto p = surface.vertices.col(a), q = surface.vertices.col(b);
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  });
  Surface ordered{.vertices = surface.vertices(Eigen::all, order), .triangles = {}};
  std::vector<int> number(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    number[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
  }
  std::vector<std::array<int, 3>> triangles;
  for (const auto& t : surface.triangles.colwise()) {
    std::array<int, 3>& triangle = triangles.emplace_back();
    std::transform(t.begin(), t.end(), triangle.begin(),
                   [&](int v) { return number[static_cast<std::size_t>(v)]; });
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
  }
  std::sort(triangles.begin(), triangles.end());
  ordered.triangles = Eigen::Map<const Eigen::Matrix3Xi>(
      triangles.data()->data(), 3, static_cast<Eigen::Index>(triangles.size()));
  return ordered;
}

}  // namespace

std::optional<Surface> union_of(const Surface& a, const Surface& b) {
  CgalMesh first = cgal_mesh_from(a), second = cgal_mesh_from(b), whole;
  if (!pmp::does_bound_a_volume(first) || !pmp::does_bound_a_volume(second)) return {};
  const bool manifold = pmp::corefine_and_compute_union(first, second, whole);
  if (!manifold || whole.number_of_faces() == 0) return {};
  whole = cgal_mesh_from(in_order(surface_from(whole)));  // of no memory's order
  remove_slivers(whole);
  return surface_from(whole);
}

}  // namespace wireplan::preprocess
