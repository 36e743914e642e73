#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>

#include <cmath>
#include <sstream>

#include "preprocess/cgal_mesh.h"
#include "preprocess/surface.h"

namespace wireplan::preprocess {
namespace {

constexpr int kIterations = 4;  // more hardly changes the angles
constexpr int kTries = 4;       // edge lengths L, 0.8 L, 0.64 L, 0.51 L
constexpr double kFiner = 0.8;
// Creases that turn by more than this (rims of caps, folds between branches) are kept as lines:
// relaxing vertices across them is what makes sheets cut each other.
constexpr double kCreaseDeg = 60.0;
constexpr double kMaxTriangles = 3e6;  // several GB of half-edges beyond

Surface remesh_once(const Surface& surface, double edge_length) {
  CgalMesh mesh = cgal_mesh_from(surface);
  auto crease = mesh.add_property_map<CgalMesh::Edge_index, bool>("e:crease", false).first;
  CGAL::Polygon_mesh_processing::detect_sharp_edges(mesh, kCreaseDeg, crease);
  CGAL::Polygon_mesh_processing::isotropic_remeshing(
      mesh.faces(), edge_length, mesh,
      CGAL::parameters::number_of_iterations(kIterations).edge_is_constrained_map(crease));
  return surface_from(mesh);
}

bool has_edge_length(const SurfaceCheck& check, double edge_length) {
  return std::abs(check.mean_edge_mm - edge_length) <= 0.1 * edge_length &&
         check.max_edge_mm <= 2.0 * edge_length;
}

/// Number of even-sided triangles that would cover the surface.
double triangles_needed(const SurfaceCheck& check, double edge_length) {
  return check.area_mm2 / (std::sqrt(3.0) / 4.0 * edge_length * edge_length);
}

}  // namespace

Surface remesh(const Surface& surface, double edge_length_mm) {
  expects(edge_length_mm > 0.0 && surface.triangles.cols() > 0);
  const SurfaceCheck before = check_surface(surface);
  require_sound(before, "surface before remeshing");
  if (has_edge_length(before, edge_length_mm)) return surface;

  // A remesh may push close sheets through each other, or pinch a thin branch: then try finer.
  std::ostringstream tried;
  double edge_length = edge_length_mm;
  for (int k = 0; k < kTries; ++k, edge_length *= kFiner) {
    if (triangles_needed(before, edge_length) > kMaxTriangles) {
      tried << "; " << edge_length << " mm: more than " << kMaxTriangles << " triangles";
      break;
    }
    const Surface result = remesh_once(surface, edge_length);
    const SurfaceCheck after = check_surface(result);
    if (is_sound(after) && after.euler_number == before.euler_number) return result;
    tried << "; " << edge_length << " mm: " << after.self_intersections
          << " pairs of triangles cut each other, Euler number " << after.euler_number;
  }
  throw Error("surface.edge_length_mm is " + (std::ostringstream() << edge_length_mm).str() +
              ", and no remesh to it is sound (Euler number before: " +
              std::to_string(before.euler_number) + tried.str() +
              "). Choose about half the radius of the thinnest vessel that matters, or smooth the "
              "surface in a mesh editor");
}

}  // namespace wireplan::preprocess
