#define CGAL_EIGEN3_ENABLED  // fairing a hole solves a sparse system
#include "preprocess/surface/cgal_mend.h"

#include <CGAL/Eigen_solver_traits.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>

#include <iterator>
#include <vector>

namespace wireplan::preprocess {

namespace pmp = CGAL::Polygon_mesh_processing;

void remove_degenerate(CgalMesh& mesh) {
  pmp::remove_degenerate_edges(mesh);
  pmp::remove_degenerate_faces(mesh);
}

bool remove_self_intersections(CgalMesh& mesh) {
  return pmp::experimental::remove_self_intersections(mesh);
}

void fill_hole(CgalMesh& mesh, CgalMesh::Halfedge_index edge, HoleFill fill) {
  std::vector<CgalMesh::Face_index> faces;
  std::vector<CgalMesh::Vertex_index> vertices;
  const auto new_faces = std::back_inserter(faces);
  const auto new_vertices = std::back_inserter(vertices);
  switch (fill) {
    case HoleFill::kTriangles:
      pmp::triangulate_hole(mesh, edge, new_faces);
      break;
    case HoleFill::kFine:
      pmp::triangulate_and_refine_hole(mesh, edge, new_faces, new_vertices);
      break;
    case HoleFill::kSmooth:
      pmp::triangulate_refine_and_fair_hole(mesh, edge, new_faces, new_vertices);
      break;
  }
}

}  // namespace wireplan::preprocess
