#include "simulate/wall/mouths.h"

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "simulate/wall/lumen.h"
#include "simulate/wall/signed_distances.h"

namespace wireplan::simulate {
namespace {

/// The surface with each cap replaced by a flange round its rim, parallel to the cap's plane, whose
/// front is inside as the lumen is: so the distance is continuous where a wire bends round the rim.
Surface with_flanges(const Surface& surface, const std::vector<Mouth>& mouths) {
  std::vector<bool> is_cap(static_cast<std::size_t>(surface.triangles.cols()), false);
  std::vector<Vec3> added;
  std::vector<Eigen::Vector3i> triangles;
  for (const Mouth& mouth : mouths) {
    // Edges of the cap that no other of its triangles runs along the other way: the rim.
    std::set<std::pair<int, int>> edges;
    for (const int f : mouth.opening->triangles) {
      is_cap[static_cast<std::size_t>(f)] = true;
      for (int e = 0; e < 3; ++e) {
        edges.emplace(surface.triangles(e, f), surface.triangles((e + 1) % 3, f));
      }
    }
    std::map<int, int> outer;  // of each vertex of the rim
    const auto outer_of = [&](int v) {
      const auto [place, fresh] = outer.try_emplace(
          v, static_cast<int>(surface.vertices.cols()) + static_cast<int>(added.size()));
      if (fresh) {
        const Vec3 p = surface.vertices.col(v), offset = p - mouth.opening->center;
        const Vec3 across =
            (offset - mouth.opening->normal.dot(offset) * mouth.opening->normal).normalized();
        added.push_back(p + mouth.flange_width * across);
      }
      return place->second;
    };
    for (const auto& [a, b] : edges) {
      if (edges.contains({b, a})) continue;
      const int a_outer = outer_of(a), b_outer = outer_of(b);
      triangles.emplace_back(a, b, b_outer);
      triangles.emplace_back(a, b_outer, a_outer);
    }
  }
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    if (!is_cap[static_cast<std::size_t>(f)]) triangles.push_back(surface.triangles.col(f));
  }

  Surface opened;
  opened.vertices.resize(3, surface.vertices.cols() + static_cast<Eigen::Index>(added.size()));
  opened.vertices.leftCols(surface.vertices.cols()) = surface.vertices;
  for (std::size_t k = 0; k < added.size(); ++k) {
    opened.vertices.col(surface.vertices.cols() + static_cast<Eigen::Index>(k)) = added[k];
  }
  opened.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    opened.triangles.col(static_cast<Eigen::Index>(k)) = triangles[k];
  }
  return opened;
}

}  // namespace

Mouth describe_mouth(const Surface& surface, const preprocess::Opening& opening, double limit) {
  Mouth mouth{&opening, 0.0, limit, {}, {}};
  for (const int f : opening.triangles) {
    for (int c = 0; c < 3; ++c) {
      const Vec3 p = surface.vertices.col(surface.triangles(c, f));
      mouth.rim_radius = std::max(mouth.rim_radius, mouth.lateral(p));
    }
  }
  // The flange must not stand in another vessel: halfway to what rises before the plane at most.
  for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
    const Vec3 p = surface.vertices.col(v);
    const double depth = mouth.depth(p);
    if (depth < 0.3 * opening.radius || depth > 2.0 * limit) continue;
    const double room = std::max(0.1, 0.5 * (mouth.lateral(p) - mouth.rim_radius));
    mouth.flange_width = std::min(mouth.flange_width, room);
  }
  const double reach = mouth.rim_radius + 2.0 * limit;
  const Vec3 end = opening.center + Lumen::kFreeLength * opening.normal;
  mouth.low = opening.center.cwiseMin(end).array() - reach;
  mouth.high = opening.center.cwiseMax(end).array() + reach;
  return mouth;
}

void open_caps(SampleGrid& grid, const Surface& surface, const std::vector<Mouth>& mouths) {
  const SampleGrid closed = grid;
  std::vector<NodeBox> boxes;
  for (const Mouth& mouth : mouths) boxes.push_back(node_box(grid, mouth.low, mouth.high));
  for (const NodeBox& box : boxes) {
    for_each_node(grid, box, [](double& value, const Vec3&) {
      value = std::numeric_limits<double>::infinity();
    });
  }
  scatter_distances(grid, with_flanges(surface, mouths), boxes);
  for (std::size_t k = 0; k < mouths.size(); ++k) {
    const Mouth& mouth = mouths[k];
    for_each_node(grid, boxes[k], [&](double& value, const Vec3& p) {
      const double depth = mouth.depth(p);
      if (!std::isfinite(value) && depth > 0.0 && depth < Lumen::kFreeLength &&
          mouth.lateral(p) < mouth.rim_radius + mouth.flange_width) {
        value = grid.limit;
      }
    });
  }
  for (std::size_t n = 0; n < grid.values.size(); ++n) {
    if (!std::isfinite(grid.values[n]))
      grid.values[n] = std::copysign(grid.limit, closed.values[n]);
  }
}

}  // namespace wireplan::simulate
