#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "preprocess/surface/cgal_mesh.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_mend.h"
#include "preprocess/surface/wall_tree.h"

namespace wireplan::preprocess {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

// A hole is small where it is no wider than the vessel's radius there: the wall beside it tells how
// it went on. One of a triangle or two is, whatever its size.
constexpr double kSmallHole = 1.0;
constexpr std::size_t kFewEdges = 4;
// At an open end the wall runs across the loop's plane: the part of its normals along that plane's
// normal is under sin 45 degrees; the loop is flat, its points within this part of its radius; and
// it is round, no wider than this times the disc of its area: a vessel slit along its side is not.
constexpr double kAlongWall = 0.7, kFlat = 0.5, kRound = 1.75;
constexpr double kMostVolumeChange = 0.01;  // by making triangles anew that cut each other

Vec3 point_of(const CgalMesh& mesh, CgalMesh::Vertex_index v) {
  const CgalKernel::Point_3& p = mesh.point(v);
  return {p.x(), p.y(), p.z()};
}

/// A loop of open edges.
struct Loop {
  CgalMesh::Halfedge_index edge;
  std::size_t edges = 0;
  Vec3 middle = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  // of its plane, out of the vessel
  double radius = 0.0;          // of the disc of its area                                 [mm]
  double width = 0.0;           // largest way across it                                   [mm]
  double off_plane = 0.0;       // largest                                                 [mm]
  double ahead = 0.0;   // largest along the normal                                        [mm]
  double facing = 0.0;  // how much the wall beside faces the way the loop does: 0 to 1
  Vec3 wall_normal = Vec3::Zero();  // of the wall beside it, mean
};

Loop measure_loop(const CgalMesh& mesh, CgalMesh::Halfedge_index edge) {
  Loop loop{.edge = edge};
  std::vector<Vec3> points, normals;
  Vec3 weighted = Vec3::Zero();
  double length = 0.0;
  for (const CgalMesh::Halfedge_index h : CGAL::halfedges_around_face(edge, mesh)) {
    const CgalMesh::Halfedge_index wall = mesh.opposite(h);
    const Vec3 a = point_of(mesh, mesh.source(h)), b = point_of(mesh, mesh.target(h)),
               c = point_of(mesh, mesh.target(mesh.next(wall)));
    points.push_back(a);
    // The wall's triangle runs from b to a.
    normals.push_back((b - a).norm() * (a - b).cross(c - b).stableNormalized());
    weighted += 0.5 * (b - a).norm() * (a + b);
    length += (b - a).norm();
  }
  loop.edges = points.size();
  loop.middle = length > 0.0 ? Vec3(weighted / length) : points.front();
  Vec3 area = Vec3::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    area += 0.5 * (points[k] - loop.middle).cross(points[(k + 1) % points.size()] - loop.middle);
  }
  if (area.norm() > 0.0) loop.normal = area.normalized();
  loop.radius = std::sqrt(area.norm() / kPi);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double along = (points[k] - loop.middle).dot(loop.normal);
    loop.off_plane = std::max(loop.off_plane, std::abs(along));
    loop.ahead = std::max(loop.ahead, along);
    loop.facing += std::abs(normals[k].dot(loop.normal)) / std::max(length, 1e-300);
    loop.wall_normal += normals[k];
    for (const Vec3& other : points) loop.width = std::max(loop.width, (points[k] - other).norm());
  }
  loop.wall_normal = loop.wall_normal.stableNormalized();
  return loop;
}

std::vector<Loop> find_loops(const CgalMesh& mesh) {
  std::vector<CgalMesh::Halfedge_index> edges;
  pmp::extract_boundary_cycles(mesh, std::back_inserter(edges));
  std::vector<Loop> loops;
  for (const CgalMesh::Halfedge_index edge : edges) loops.push_back(measure_loop(mesh, edge));
  return loops;
}

bool is_open_end(const Loop& loop) {
  return loop.facing < kAlongWall && loop.off_plane < kFlat * loop.radius &&
         loop.width < kRound * 2.0 * loop.radius;
}

[[noreturn]] void refuse_hole(const Loop& loop, double vessel_radius, const std::string& origin) {
  throw Error(origin + ": a hole in the wall at " + place_text(loop.middle) + " mm is " +
              number_text(loop.width) + " mm wide, in a vessel of about " +
              number_text(vessel_radius) +
              " mm radius; holes no wider than the radius are closed, and ends cut straight "
              "across are capped. Close it in a mesh editor (3D Slicer, MeshLab, Blender), or cut "
              "the vessel's end there straight across");
}

/// Goes on from an uneven open end to a plane just beyond it, so that the cap is flat and the wall
/// stays where it is. Returns an edge of the new end.
CgalMesh::Halfedge_index straighten_end(CgalMesh& mesh, const Loop& loop) {
  constexpr double kEven = 0.01, kBeyond = 0.1;  // parts of the radius
  if (loop.off_plane < kEven * loop.radius) return loop.edge;
  std::vector<CgalMesh::Vertex_index> rim;
  for (const CgalMesh::Halfedge_index h : CGAL::halfedges_around_face(loop.edge, mesh)) {
    rim.push_back(mesh.source(h));
  }
  const double plane = loop.ahead + kBeyond * loop.radius;
  std::vector<CgalMesh::Vertex_index> end;
  for (const CgalMesh::Vertex_index v : rim) {
    const Vec3 p = point_of(mesh, v);
    const Vec3 q = p + (plane - (p - loop.middle).dot(loop.normal)) * loop.normal;
    end.push_back(mesh.add_vertex({q.x(), q.y(), q.z()}));
  }
  for (std::size_t k = 0; k < rim.size(); ++k) {
    const std::size_t next = (k + 1) % rim.size();
    mesh.add_face(rim[k], rim[next], end[next]);
    mesh.add_face(rim[k], end[next], end[k]);
  }
  const CgalMesh::Halfedge_index edge = mesh.halfedge(end[0], end[1]);
  return mesh.is_border(edge) ? edge : mesh.opposite(edge);
}

Surface surface_of_copy(CgalMesh mesh) {
  mesh.collect_garbage();
  return surface_from(mesh);
}

/// Edges without length and triangles without area are collapsed; those that cannot be, stay.
void collapse_degenerate(CgalMesh& mesh, std::vector<Mend>& mends) {
  Mend mend{.kind = MendKind::kDegenerate, .count = 0};
  for (const CgalMesh::Face_index f : mesh.faces()) {
    if (!pmp::is_degenerate_triangle_face(f, mesh)) continue;
    mend.place = point_of(mesh, mesh.target(mesh.halfedge(f)));
    ++mend.count;
  }
  if (mend.count == 0) return;
  remove_degenerate(mesh);
  mends.push_back(mend);
}

}  // namespace

Surface close_openings(const Surface& open, const std::string& origin, std::vector<Mend>& mends) {
  CgalMesh mesh = cgal_mesh_from(open);
  collapse_degenerate(mesh, mends);
  const std::vector<Loop> loops = find_loops(mesh);
  if (loops.empty()) return surface_of_copy(mesh);

  const WallTree wall(open);
  const double reach =
      (open.vertices.rowwise().maxCoeff() - open.vertices.rowwise().minCoeff()).norm();
  for (const Loop& loop : loops) {
    const Mend mend{
        .count = static_cast<int>(loop.edges), .place = loop.middle, .size = loop.width};
    const bool few = loop.edges <= kFewEdges;
    if (!few && is_open_end(loop)) {
      fill_hole(mesh, straighten_end(mesh, loop), HoleFill::kFine);
      mends.push_back(mend);
      mends.back().kind = MendKind::kOpenEnd;
      continue;
    }
    const double vessel_radius = 0.5 * wall.free_way(loop.middle, -loop.wall_normal, reach);
    if (!few && loop.width > kSmallHole * vessel_radius) refuse_hole(loop, vessel_radius, origin);
    fill_hole(mesh, loop.edge, few ? HoleFill::kTriangles : HoleFill::kSmooth);
    mends.push_back(mend);
    mends.back().kind = MendKind::kHole;
  }
  return surface_of_copy(mesh);
}

Surface without_intersections(const Surface& surface, std::vector<Mend>& mends) {
  const std::vector<int> cut = find_self_intersections(surface);
  if (cut.empty()) return surface;
  CgalMesh mesh = cgal_mesh_from(surface);
  if (!remove_self_intersections(mesh)) return surface;
  const Surface result = surface_of_copy(mesh);

  // Taken only where nothing but those triangles changed.
  const SurfaceCheck before = check_surface(surface), after = check_surface(result);
  const double change = std::abs(after.volume_mm3 - before.volume_mm3);
  if (after.self_intersections > 0 || after.open_edges > before.open_edges ||
      after.pieces != before.pieces || after.euler_number != before.euler_number ||
      change > kMostVolumeChange * std::abs(before.volume_mm3)) {
    return surface;
  }
  mends.push_back({.kind = MendKind::kIntersection,
                   .count = static_cast<int>(cut.size()),
                   .place = surface.vertices.col(surface.triangles(0, cut.front()))});
  return result;
}

}  // namespace wireplan::preprocess
