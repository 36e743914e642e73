#include "preprocess/surface/cgal_calls.h"

#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/boost/graph/Alpha_expansion_MaxFlow_tag.h>
#include <CGAL/boost/graph/Dual.h>
#include <CGAL/boost/graph/alpha_expansion_graphcut.h>

#include <cmath>
#include <iterator>
#include <stdexcept>

#include "preprocess/surface/cgal_mesh.h"

namespace wireplan::preprocess {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

using Face = CgalMesh::Face_index;
using Edge = CgalMesh::Edge_index;

}  // namespace

std::vector<std::pair<int, int>> cutting_pairs(const Surface& surface) {
  std::vector<std::pair<Face, Face>> faces;
  pmp::self_intersections(cgal_mesh_from(surface), std::back_inserter(faces));
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [a, b] : faces) {
    // A pair of a face with itself is a degenerate one, which has a count of its own.
    if (a != b) pairs.emplace_back(static_cast<int>(a), static_cast<int>(b));
  }
  return pairs;
}

std::optional<Surface> remesh_parts(const Surface& surface,
                                    const std::vector<int>& part_of_triangle,
                                    const std::vector<double>& edge_length, double crease_deg,
                                    int iterations) {
  CgalMesh mesh = cgal_mesh_from(surface);
  auto crease = mesh.add_property_map<Edge, bool>("e:crease", false).first;
  auto part = mesh.add_property_map<Face, int>("f:part", 0).first;
  for (const Face f : mesh.faces()) part[f] = part_of_triangle[static_cast<std::size_t>(f)];
  pmp::detect_sharp_edges(mesh, crease_deg, crease);
  for (std::size_t k = 0; k < edge_length.size(); ++k) {
    std::vector<Face> faces;
    for (const Face f : mesh.faces()) {
      if (part[f] == static_cast<int>(k)) faces.push_back(f);
    }
    if (faces.empty()) continue;
    try {
      pmp::isotropic_remeshing(faces, edge_length[k], mesh,
                               CGAL::parameters::number_of_iterations(iterations)
                                   .edge_is_constrained_map(crease)
                                   .face_patch_map(part));
    } catch (const std::out_of_range&) {  // of its own table of patches
      return {};
    }
  }
  return surface_from(mesh);
}

std::vector<std::size_t> cut_apart(const Surface& surface,
                                   const std::vector<LabelCost>& triangle_cost,
                                   const std::function<double(int, int, double)>& edge_cost) {
  CgalMesh mesh = cgal_mesh_from(surface);
  auto cost = mesh.add_property_map<Edge, double>("e:cost", 0.0).first;
  auto label_cost = mesh.add_property_map<Face, std::vector<double>>("f:cost").first;
  auto label = mesh.add_property_map<Face, std::size_t>("f:label", 1).first;
  for (const Face f : mesh.faces()) {
    const LabelCost& of = triangle_cost[static_cast<std::size_t>(f)];
    label_cost[f] = {of.zero, of.one};
    label[f] = of.zero < of.one ? 0 : 1;
  }
  for (const Edge e : mesh.edges()) {
    const CgalMesh::Halfedge_index h = mesh.halfedge(e);
    const double length = std::sqrt(CGAL::to_double(
        CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h)))));
    cost[e] = edge_cost(static_cast<int>(mesh.face(h)),
                        static_cast<int>(mesh.face(mesh.opposite(h))), length);
  }
  CGAL::alpha_expansion_graphcut(CGAL::Dual<CgalMesh>(mesh), cost, label_cost, label,
                                 CGAL::parameters::vertex_index_map(get(CGAL::face_index, mesh))
                                     .implementation_tag(CGAL::Alpha_expansion_MaxFlow_tag()));
  std::vector<std::size_t> labels;
  for (const Face f : mesh.faces()) labels.push_back(label[f]);
  return labels;
}

}  // namespace wireplan::preprocess
