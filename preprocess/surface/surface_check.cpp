#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "preprocess/surface/cgal_calls.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_mend.h"
#include "preprocess/surface/triangle_sides.h"

namespace wireplan::preprocess {
namespace {

// A triangle whose double area is below this part of its longest edge squared has no usable normal.
constexpr double kDegenerate = 1e-12;

/// For each triangle the lowest triangle of its piece.
std::vector<int> piece_of_triangle(const Surface& surface, const std::vector<Side>& sides) {
  DisjointSets sets(static_cast<int>(surface.triangles.cols()));
  for_each_edge(sides, [&](auto begin, auto end) {
    for (auto side = begin + 1; side != end; ++side) sets.unite(begin->triangle, side->triangle);
  });
  std::vector<int> piece(static_cast<std::size_t>(surface.triangles.cols()));
  for (int t = 0; t < surface.triangles.cols(); ++t) piece[t] = sets.find(t);
  return piece;
}

/// Vertices whose triangles do not form one fan: their corners, united across edges, make more than
/// one set. Also counts the vertices in use.
void count_vertices(const Surface& surface, const std::vector<Side>& sides, SurfaceCheck& check) {
  const auto corner_of = [&](const Side& side, int vertex) {
    const bool first = surface.triangles(side.corner, side.triangle) == vertex;
    return 3 * side.triangle + (first ? side.corner : (side.corner + 1) % 3);
  };
  const int corners = 3 * static_cast<int>(surface.triangles.cols());
  DisjointSets sets(corners);
  for_each_edge(sides, [&](auto begin, auto end) {
    for (auto side = begin + 1; side != end; ++side) {
      sets.unite(corner_of(*begin, begin->low), corner_of(*side, begin->low));
      sets.unite(corner_of(*begin, begin->high), corner_of(*side, begin->high));
    }
  });
  std::vector<int> fans(static_cast<std::size_t>(surface.vertices.cols()), 0);
  for (int c = 0; c < corners; ++c) {
    if (sets.find(c) == c) ++fans[surface.triangles(c % 3, c / 3)];
  }
  for (std::size_t v = 0; v < fans.size(); ++v) {
    if (fans[v] > 0) ++check.vertices;
    if (fans[v] > 1 && check.non_manifold_vertices++ == 0) {
      check.touching_at = surface.vertices.col(static_cast<Eigen::Index>(v));
    }
  }
}

/// Areas, edge lengths and angles.
void measure_triangles(const Surface& surface, SurfaceCheck& check) {
  double min_angle = kPi, edge_sum = 0.0;
  for (int t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Vector3i corners = surface.triangles.col(t);
    std::array<Vec3, 3> edge;  // edge k runs from corner k to the next
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) {
      edge[k] = surface.vertices.col(corners((k + 1) % 3)) - surface.vertices.col(corners(k));
      edge_sum += edge[k].norm();
      longest = std::max(longest, edge[k].norm());
    }
    const double double_area = edge[0].cross(edge[1]).norm();
    check.area_mm2 += 0.5 * double_area;
    check.max_edge_mm = std::max(check.max_edge_mm, longest);
    if (!(double_area > kDegenerate * longest * longest) && check.degenerate_triangles++ == 0) {
      check.degenerate_at = surface.vertices.col(corners(0));
    }
    for (int k = 0; k < 3; ++k) {
      const Vec3 back = -edge[(k + 2) % 3];
      min_angle = std::min(min_angle, std::atan2(edge[k].cross(back).norm(), edge[k].dot(back)));
    }
  }
  check.min_angle_deg = min_angle / kRadPerDeg;
  check.mean_edge_mm = edge_sum / static_cast<double>(3 * surface.triangles.cols());
}

/// Squared distance from a point to a triangle: to the plane where the foot lies inside, else to
/// the nearest edge.
double squared_distance(const Vec3& p, const std::array<Vec3, 3>& corner) {
  const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  bool over = normal.squaredNorm() > 0.0;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = corner[(k + 1) % 3] - corner[k], to_p = p - corner[k];
    if (normal.cross(edge).dot(to_p) < 0.0) over = false;
    const double length = edge.squaredNorm();
    const double along = length > 0.0 ? std::clamp(edge.dot(to_p) / length, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, (to_p - along * edge).squaredNorm());
  }
  if (!over) return nearest;
  const double height = normal.dot(p - corner[0]);
  return height * height / normal.squaredNorm();
}

/// Solid angle under which the triangle is seen, over 2; positive from its inner side.
/// Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983).
double half_solid_angle(const Vec3& p, const std::array<Vec3, 3>& corner) {
  const Vec3 a = corner[0] - p, b = corner[1] - p, c = corner[2] - p;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)),
                    la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

/// The triangles of these pairs, ascending.
std::vector<int> triangles_of(const std::vector<std::pair<int, int>>& pairs) {
  std::vector<int> triangles;
  for (const auto& [a, b] : pairs) {
    triangles.push_back(a);
    triangles.push_back(b);
  }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

std::array<Vec3, 3> corners_of(const Surface& surface, int triangle) {
  const Eigen::Vector3i v = surface.triangles.col(triangle);
  return {surface.vertices.col(v(0)), surface.vertices.col(v(1)), surface.vertices.col(v(2))};
}

}  // namespace

double signed_volume(const Surface& surface) {
  if (surface.vertices.cols() == 0) return 0.0;
  const Vec3 origin = surface.vertices.rowwise().mean();  // near the surface: fewer lost digits
  double sum = 0.0;
  for (int t = 0; t < surface.triangles.cols(); ++t) {
    const auto [a, b, c] = corners_of(surface, t);
    sum += (a - origin).dot((b - origin).cross(c - origin));
  }
  return sum / 6.0;
}

std::vector<Piece> pieces_of(const Surface& surface) {
  const int count = static_cast<int>(surface.triangles.cols());
  if (count == 0) return {};
  const std::vector<int> piece = piece_of_triangle(surface, sorted_sides(surface));

  // Volume of each piece about a point of its own, so that open ones compare as well.
  std::vector<double> volume(piece.size(), 0.0);
  std::vector<std::vector<int>> triangles(piece.size());
  for (int t = 0; t < count; ++t) {
    const Vec3 origin = surface.vertices.col(surface.triangles(0, piece[t]));
    const auto [a, b, c] = corners_of(surface, t);
    volume[piece[t]] += (a - origin).dot((b - origin).cross(c - origin)) / 6.0;
    triangles[piece[t]].push_back(t);
  }
  std::vector<int> order;
  for (int t = 0; t < count; ++t) {
    if (piece[t] == t) order.push_back(t);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return std::abs(volume[a]) > std::abs(volume[b]); });

  // Copies, vertices renumbered in their old order.
  std::vector<Piece> pieces;
  std::vector<int> renumbered(static_cast<std::size_t>(surface.vertices.cols()));
  for (const int first : order) {
    std::vector<int> used;
    for (const int t : triangles[first]) {
      for (int k = 0; k < 3; ++k) used.push_back(surface.triangles(k, t));
    }
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    Piece copy{.surface = {}, .turned = volume[first] < 0.0};
    copy.surface.vertices.resize(3, static_cast<Eigen::Index>(used.size()));
    for (std::size_t v = 0; v < used.size(); ++v) {
      renumbered[used[v]] = static_cast<int>(v);
      copy.surface.vertices.col(static_cast<Eigen::Index>(v)) = surface.vertices.col(used[v]);
    }
    Eigen::Matrix3Xi& copied = copy.surface.triangles;
    copied.resize(3, static_cast<Eigen::Index>(triangles[first].size()));
    for (std::size_t t = 0; t < triangles[first].size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        copied(k, static_cast<Eigen::Index>(t)) =
            renumbered[surface.triangles(k, triangles[first][t])];
      }
    }
    if (copy.turned) copied.row(1).swap(copied.row(2));
    pieces.push_back(std::move(copy));
  }
  return pieces;
}

Surface largest_piece(const Surface& surface) {
  if (surface.triangles.cols() == 0) return surface;
  return std::move(pieces_of(surface).front().surface);
}

SurfaceCheck check_surface(const Surface& surface) {
  std::vector<int> cutting;
  return check_surface(surface, cutting);
}

SurfaceCheck check_surface(const Surface& surface, std::vector<int>& cutting) {
  cutting.clear();
  SurfaceCheck check;
  check.triangles = static_cast<int>(surface.triangles.cols());
  if (check.triangles == 0) return check;
  expects(surface.triangles.minCoeff() >= 0 &&
          surface.triangles.maxCoeff() < surface.vertices.cols());

  // How the triangles hang together.
  const std::vector<Side> sides = sorted_sides(surface);
  int edges = 0;
  for_each_edge(sides, [&](auto begin, auto end) {
    ++edges;
    const Vec3 at = 0.5 * (surface.vertices.col(begin->low) + surface.vertices.col(begin->high));
    const bool agree = begin->forward != (end - 1)->forward;
    if (end - begin == 1 && check.open_edges++ == 0) check.open_at = at;
    if (end - begin == 2 && !agree && check.misoriented_edges++ == 0) check.misoriented_at = at;
    if (end - begin > 2 && check.non_manifold_edges++ == 0) check.non_manifold_at = at;
  });
  count_vertices(surface, sides, check);
  check.euler_number = check.vertices - edges + check.triangles;
  const std::vector<int> piece = piece_of_triangle(surface, sides);
  for (int t = 0; t < check.triangles; ++t) check.pieces += piece[t] == t ? 1 : 0;

  // What they measure.
  measure_triangles(surface, check);
  check.volume_mm3 = signed_volume(surface);
  check.outward = check.volume_mm3 > 0.0;
  if (check.non_manifold_edges + check.misoriented_edges + check.non_manifold_vertices == 0) {
    const std::vector<std::pair<int, int>> pairs = cutting_pairs(surface);
    check.self_intersections = static_cast<int>(pairs.size());
    cutting = triangles_of(pairs);
    if (!pairs.empty()) {
      const auto cut = static_cast<Eigen::Index>(pairs.front().first);
      check.cut_at = surface.vertices.col(surface.triangles(0, cut));
    }
  }
  return check;
}

std::vector<int> find_self_intersections(const Surface& surface) {
  return triangles_of(cutting_pairs(surface));
}

bool is_sound(const SurfaceCheck& check) {
  return check.triangles > 0 && check.pieces == 1 && check.outward &&
         check.open_edges + check.non_manifold_edges + check.misoriented_edges +
                 check.non_manifold_vertices + check.degenerate_triangles +
                 check.self_intersections ==
             0;
}

void require_sound(const SurfaceCheck& check, const std::string& origin) {
  if (is_sound(check)) return;
  if (check.triangles == 0) throw Error(origin + ": the surface has no triangles");
  std::string faults;
  const auto add = [&](int count, const std::string& what, const std::string& remedy) {
    if (count == 0) return;
    faults += (faults.empty() ? "" : "; ") + std::to_string(count) + " " + what + " (" + remedy;
  };
  const auto first = [](const Vec3& place) { return ", first at " + place_text(place) + " mm)"; };
  add(check.pieces == 1 ? 0 : check.pieces, "pieces, expected 1", "keep the vessel alone)");
  add(check.open_edges, "open edges",
      "close the holes and cap the vessel's ends" + first(check.open_at));
  add(check.non_manifold_edges, "edges shared by more than two triangles",
      "remove inner walls and doubled triangles" + first(check.non_manifold_at));
  add(check.misoriented_edges, "edges whose two triangles disagree on outside",
      "orient the normals" + first(check.misoriented_at));
  add(check.non_manifold_vertices, "vertices where parts of the surface touch in a point",
      "part them" + first(check.touching_at));
  add(check.degenerate_triangles, "triangles without area",
      "collapse or remesh them" + first(check.degenerate_at));
  add(check.self_intersections, "pairs of triangles that cut each other",
      "smooth or remesh the surface there" + first(check.cut_at));
  if (!check.outward)
    faults += std::string(faults.empty() ? "" : "; ") + "the normals point inward";
  throw Error(origin + ": the surface is not sound: " + faults +
              ". Expected one closed, manifold surface without self-intersections; repair it in a "
              "mesh editor (3D Slicer, MeshLab, Blender) or segment again");
}

InsideAnswer locate_point(const Surface& surface, const Vec3& point) {
  expects(surface.triangles.cols() > 0);
  double half_turns = 0.0, nearest = std::numeric_limits<double>::infinity();
  for (int t = 0; t < surface.triangles.cols(); ++t) {
    const std::array<Vec3, 3> corners = corners_of(surface, t);
    half_turns += half_solid_angle(point, corners);
    nearest = std::min(nearest, squared_distance(point, corners));
  }
  // The winding number half_turns / (2 pi) is 1 inside and 0 outside.
  return {.inside = half_turns > kPi, .distance = std::sqrt(nearest)};
}

}  // namespace wireplan::preprocess
