#include "simulate/wall/lumen.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "preprocess/surface/triangle.h"
#include "simulate/wall/parallel.h"

namespace wireplan::simulate {

namespace {

// ---------------------------------------------------------------- exact signed distance

/// Outward normals of faces, edges and vertices, angle-weighted at vertices, so that the sign of
/// the distance to the nearest feature is right everywhere (Baerentzen & Aanaes, "Signed distance
/// computation using the angle weighted pseudonormal", IEEE TVCG 2005).
struct PseudoNormals {
  Eigen::Matrix3Xd face, vertex;
  std::vector<std::array<Vec3, 3>> edge;  // of each triangle: edges 01, 12, 20
};

PseudoNormals compute_pseudo_normals(const Surface& surface) {
  const Eigen::Index m = surface.triangles.cols();
  PseudoNormals normals;
  normals.face.resize(3, m);
  normals.vertex = Eigen::Matrix3Xd::Zero(3, surface.vertices.cols());
  std::map<std::pair<int, int>, Vec3> edges;
  const auto key = [](int a, int b) { return std::pair(std::min(a, b), std::max(a, b)); };
  for (Eigen::Index f = 0; f < m; ++f) {
    const Eigen::Vector3i t = surface.triangles.col(f);
    std::array<Vec3, 3> p;
    for (int c = 0; c < 3; ++c) p[c] = surface.vertices.col(t[c]);
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    normals.face.col(f) = normal;
    for (int c = 0; c < 3; ++c) {
      const Vec3 u = p[(c + 1) % 3] - p[c], v = p[(c + 2) % 3] - p[c];
      normals.vertex.col(t[c]) += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
      auto [place, fresh] = edges.try_emplace(key(t[c], t[(c + 1) % 3]), Vec3::Zero());
      place->second += normal;
    }
  }
  normals.edge.resize(m);
  for (Eigen::Index f = 0; f < m; ++f) {
    const Eigen::Vector3i t = surface.triangles.col(f);
    for (int c = 0; c < 3; ++c) normals.edge[f][c] = edges.at(key(t[c], t[(c + 1) % 3]));
  }
  return normals;
}

/// Normal of what a point nearest to another lies on, in triangle f with the corners t.
Vec3 normal_of(const NearestOnTriangle& nearest, const PseudoNormals& normals, Eigen::Index f,
               const Eigen::Vector3i& t) {
  if (nearest.feature < 3) return normals.vertex.col(t[nearest.feature]);
  if (nearest.feature < 6) return normals.edge[f][nearest.feature - 3];
  return normals.face.col(f);
}

// ---------------------------------------------------------------- sparse grid of samples

/// Signed distances on the nodes of bricks of kSide^3, allocated where the wall is near. Only used
/// while the field is built.
struct SampleGrid {
  static constexpr int kSide = 8;
  static constexpr int kVolume = kSide * kSide * kSide;
  static constexpr std::int32_t kOutside = -1, kInside = -2, kUnknown = -3;

  Vec3 origin;
  double spacing, limit;  // distances are cut to +-limit
  std::array<int, 3> bricks;
  std::vector<std::int32_t> slot;           // of each brick; negative: no samples there
  std::vector<std::array<int, 3>> sampled;  // the brick of each slot
  std::vector<double> values;               // kVolume per slot

  std::size_t brick_index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(bricks[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(bricks[1]) * static_cast<std::size_t>(k));
  }
  static std::size_t node_index(int i, int j, int k) {
    return static_cast<std::size_t>(i + kSide * (j + kSide * k));
  }
  /// Value at a node by its index in the whole grid; beyond the samples +-limit.
  double at(const std::vector<double>& field, int i, int j, int k) const {
    const std::array<int, 3> brick = {i >> 3, j >> 3, k >> 3};
    for (int d = 0; d < 3; ++d) {
      if (brick[d] < 0 || brick[d] >= bricks[d]) return -limit;
    }
    const std::int32_t s = slot[brick_index(brick[0], brick[1], brick[2])];
    if (s == kOutside) return -limit;
    if (s == kInside) return limit;
    return field[static_cast<std::size_t>(s) * kVolume + node_index(i & 7, j & 7, k & 7)];
  }
};

/// Grid indices of the nodes in a box.
struct NodeBox {
  std::array<int, 3> low, high;
};

NodeBox node_box(const SampleGrid& grid, const Vec3& low, const Vec3& high) {
  NodeBox box{};
  for (int d = 0; d < 3; ++d) {
    box.low[d] = std::max(0, static_cast<int>(std::ceil((low[d] - grid.origin[d]) / grid.spacing)));
    box.high[d] = std::min(grid.bricks[d] * SampleGrid::kSide - 1,
                           static_cast<int>(std::floor((high[d] - grid.origin[d]) / grid.spacing)));
  }
  return box;
}

/// Nodes within the grid's limit of the box of a triangle.
NodeBox node_box(const SampleGrid& grid, const Surface& surface, Eigen::Index f) {
  const Eigen::Vector3i t = surface.triangles.col(f);
  const Vec3 a = surface.vertices.col(t[0]), b = surface.vertices.col(t[1]),
             c = surface.vertices.col(t[2]);
  return node_box(grid, a.cwiseMin(b).cwiseMin(c).array() - grid.limit,
                  a.cwiseMax(b).cwiseMax(c).array() + grid.limit);
}

bool overlap(const NodeBox& a, const NodeBox& b) {
  for (int d = 0; d < 3; ++d) {
    if (a.low[d] > b.high[d] || b.low[d] > a.high[d]) return false;
  }
  return true;
}

/// Calls visit(slot, i, j, k) for every brick of the box.
template <class Visit>
void for_each_brick(SampleGrid& grid, const NodeBox& box, const Visit& visit) {
  for (int k = box.low[2] >> 3; k <= box.high[2] >> 3; ++k) {
    for (int j = box.low[1] >> 3; j <= box.high[1] >> 3; ++j) {
      for (int i = box.low[0] >> 3; i <= box.high[0] >> 3; ++i) {
        visit(grid.slot[grid.brick_index(i, j, k)], i, j, k);
      }
    }
  }
}

/// Gives samples to the bricks of a box; their values come later.
void add_samples(SampleGrid& grid, const NodeBox& box) {
  for_each_brick(grid, box, [&](std::int32_t& s, int i, int j, int k) {
    if (s >= 0) return;
    s = static_cast<std::int32_t>(grid.sampled.size());
    grid.sampled.push_back({i, j, k});
  });
}

/// Calls visit(value, position) for every node of the box. Expects samples in all its bricks.
template <class Visit>
void for_each_node(SampleGrid& grid, const NodeBox& box, const Visit& visit) {
  for_each_brick(grid, box, [&](std::int32_t& s, int bi, int bj, int bk) {
    double* values = grid.values.data() + static_cast<std::size_t>(s) * SampleGrid::kVolume;
    for (int k = std::max(box.low[2], 8 * bk); k <= std::min(box.high[2], 8 * bk + 7); ++k) {
      for (int j = std::max(box.low[1], 8 * bj); j <= std::min(box.high[1], 8 * bj + 7); ++j) {
        for (int i = std::max(box.low[0], 8 * bi); i <= std::min(box.high[0], 8 * bi + 7); ++i) {
          visit(values[SampleGrid::node_index(i & 7, j & 7, k & 7)],
                Vec3(grid.origin + grid.spacing * Vec3(i, j, k)));
        }
      }
    }
  });
}

/// Distances of triangles to the nodes of a brick. A block of nodes is halved down to two along
/// each axis, each time without the triangles that cannot be the nearest of any of its nodes.
class BlockDistances {
 public:
  BlockDistances(SampleGrid& grid, const Surface& surface)
      : grid_(grid), surface_(surface), normals_(compute_pseudo_normals(surface)) {
    const Eigen::Index m = surface.triangles.cols();
    middle_.resize(3, m);
    radius_.resize(m);
    for (Eigen::Index f = 0; f < m; ++f) {
      const Eigen::Vector3i t = surface.triangles.col(f);
      Mat3 corners;
      for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(t[c]);
      middle_.col(f) = corners.rowwise().mean();
      radius_[f] =
          std::sqrt((corners.colwise() - middle_.col(f)).colwise().squaredNorm().maxCoeff());
    }
  }

  /// Takes over what is shorter than what a node has, and than the grid's limit. Expects a
  /// triangle near.
  void take(std::size_t slot, const std::vector<int>& near) const {
    take(slot, {0, 0, 0}, SampleGrid::kSide, near);
  }

 private:
  void take(std::size_t slot, const std::array<int, 3>& first, int side,
            const std::vector<int>& near) const {
    // The ball round the block; what is farther than the nearest one by its width is no one's.
    const std::array<int, 3>& brick = grid_.sampled[slot];
    const Vec3 low(SampleGrid::kSide * brick[0] + first[0], SampleGrid::kSide * brick[1] + first[1],
                   SampleGrid::kSide * brick[2] + first[2]);
    const Vec3 center = grid_.origin + grid_.spacing * (low.array() + 0.5 * (side - 1)).matrix();
    const double reach = 0.5 * (side - 1) * std::sqrt(3.0) * grid_.spacing;
    std::vector<double> distance;
    distance.reserve(near.size());
    for (const int f : near) distance.push_back((middle_.col(f) - center).norm());
    const auto nearest = std::min_element(distance.begin(), distance.end());
    const double least = std::min(grid_.limit, *nearest + reach);
    std::vector<int> left;
    left.reserve(near.size());
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (distance[k] - radius_[near[k]] - reach <= least + kRounding) left.push_back(near[k]);
    }
    if (left.empty()) return;

    if (side > 2) {
      const int half = side / 2;
      for (int octant = 0; octant < 8; ++octant) {
        const std::array<int, 3> at = {first[0] + (octant & 1 ? half : 0),
                                       first[1] + (octant & 2 ? half : 0),
                                       first[2] + (octant & 4 ? half : 0)};
        take(slot, at, half, left);
      }
      return;
    }
    double* values = grid_.values.data() + slot * SampleGrid::kVolume;
    for (int node = 0; node < 8; ++node) {
      const int i = node & 1, j = (node >> 1) & 1, k = node >> 2;
      double& value = values[SampleGrid::node_index(first[0] + i, first[1] + j, first[2] + k)];
      const Vec3 p = grid_.origin + grid_.spacing * (low + Vec3(i, j, k));
      take(value, p, near[static_cast<std::size_t>(nearest - distance.begin())]);
      for (const int f : left) take(value, p, f);
    }
  }

  static constexpr double kRounding = 1e-9;  // [mm]

  void take(double& value, const Vec3& p, Eigen::Index f) const {
    const Eigen::Vector3i t = surface_.triangles.col(f);
    const Vec3 a = surface_.vertices.col(t[0]);
    const double bound = std::min(std::abs(value), grid_.limit);
    const double far = bound + radius_[f] + kRounding;
    if ((p - middle_.col(f)).squaredNorm() >= far * far) return;
    const Vec3 plane = normals_.face.col(f);
    if (std::abs(plane.dot(p - a)) >= bound) return;
    const NearestOnTriangle nearest =
        nearest_on_triangle(p, a, surface_.vertices.col(t[1]), surface_.vertices.col(t[2]));
    const double squared_distance = nearest.offset.squaredNorm();
    if (squared_distance >= bound * bound) return;
    const bool outside = nearest.offset.dot(normal_of(nearest, normals_, f, t)) > 0.0;
    value = outside ? -std::sqrt(squared_distance) : std::sqrt(squared_distance);
  }

  SampleGrid& grid_;
  const Surface& surface_;
  const PseudoNormals normals_;
  Eigen::Matrix3Xd middle_;  // of each triangle                                         [mm]
  Eigen::VectorXd radius_;   // of the ball round its middle that holds it               [mm]
};

/// Takes over the distances to the triangles near the boxes at all nodes where they are shorter
/// than what is there, and than the grid's limit.
void scatter_distances(SampleGrid& grid, const Surface& surface,
                       const std::vector<NodeBox>& boxes) {
  std::vector<std::vector<int>> near(grid.sampled.size());
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    const NodeBox box = node_box(grid, surface, f);
    if (std::none_of(boxes.begin(), boxes.end(),
                     [&](const NodeBox& other) { return overlap(box, other); })) {
      continue;
    }
    for_each_brick(grid, box, [&](std::int32_t& s, int, int, int) {
      near[static_cast<std::size_t>(s)].push_back(static_cast<int>(f));
    });
  }
  const BlockDistances distances(grid, surface);
  for_each_index(grid.sampled.size(), [&](std::size_t s) {
    if (!near[s].empty()) distances.take(s, near[s]);
  });
}

/// Gives unreached nodes, then bricks without samples, the sign of a neighbour: between two
/// neighbours beyond the band there is no wall.
void spread_signs(SampleGrid& grid) {
  // Nodes: sweep until nothing changes; each brick holds a few layers of them.
  const std::array<int, 3> nodes = {8 * grid.bricks[0], 8 * grid.bricks[1], 8 * grid.bricks[2]};
  std::vector<std::array<int, 3>> front, next;
  const auto value_at = [&](const std::array<int, 3>& n) -> double* {
    for (int d = 0; d < 3; ++d) {
      if (n[d] < 0 || n[d] >= nodes[d]) return nullptr;
    }
    const std::int32_t s = grid.slot[grid.brick_index(n[0] >> 3, n[1] >> 3, n[2] >> 3)];
    if (s < 0) return nullptr;
    return &grid.values[static_cast<std::size_t>(s) * SampleGrid::kVolume +
                        SampleGrid::node_index(n[0] & 7, n[1] & 7, n[2] & 7)];
  };
  const auto for_each_neighbour = [](const std::array<int, 3>& n, const auto& visit) {
    for (int d = 0; d < 3; ++d) {
      for (const int step : {-1, 1}) {
        std::array<int, 3> neighbour = n;
        neighbour[d] += step;
        visit(neighbour);
      }
    }
  };
  for (const auto& [i, j, k] : grid.sampled) {
    for (int v = 0; v < SampleGrid::kVolume; ++v) {
      const std::array<int, 3> n = {8 * i + (v & 7), 8 * j + ((v >> 3) & 7), 8 * k + (v >> 6)};
      if (std::isfinite(*value_at(n))) front.push_back(n);
    }
  }
  for (; !front.empty(); std::swap(front, next)) {
    next.clear();
    for (const std::array<int, 3>& n : front) {
      const double sign = std::copysign(grid.limit, *value_at(n));
      for_each_neighbour(n, [&](const std::array<int, 3>& neighbour) {
        double* value = value_at(neighbour);
        if (value == nullptr || std::isfinite(*value)) return;
        *value = sign;
        next.push_back(neighbour);
      });
    }
  }
  for (double& value : grid.values) {
    if (!std::isfinite(value)) value = -grid.limit;  // a brick that no distance reached
  }

  // Bricks: from those with samples inward; the rest, and the rim of the grid, is outside.
  std::vector<std::array<int, 3>> bricks_front;
  const auto in_grid = [&](const std::array<int, 3>& b) {
    return b[0] >= 0 && b[1] >= 0 && b[2] >= 0 && b[0] < grid.bricks[0] && b[1] < grid.bricks[1] &&
           b[2] < grid.bricks[2];
  };
  std::vector<std::array<int, 3>> inside;
  for (int k = 0; k < grid.bricks[2]; ++k) {
    for (int j = 0; j < grid.bricks[1]; ++j) {
      for (int i = 0; i < grid.bricks[0]; ++i) {
        if (grid.slot[grid.brick_index(i, j, k)] >= 0) continue;
        const std::array<int, 3> b = {i, j, k};
        for (int d = 0; d < 3; ++d) {  // the samples next to each face tell
          for (const int side : {-1, 8}) {
            std::array<int, 3> n = {8 * i + 4, 8 * j + 4, 8 * k + 4};
            n[d] = 8 * b[d] + side;
            const double* value = value_at(n);
            if (value != nullptr && *value > 0.0) inside.push_back(b);
          }
        }
      }
    }
  }
  while (!inside.empty()) {
    const std::array<int, 3> b = inside.back();
    inside.pop_back();
    std::int32_t& s = grid.slot[grid.brick_index(b[0], b[1], b[2])];
    if (s != SampleGrid::kUnknown) continue;
    s = SampleGrid::kInside;
    for_each_neighbour(b, [&](const std::array<int, 3>& neighbour) {
      if (in_grid(neighbour)) inside.push_back(neighbour);
    });
  }
  for (std::int32_t& s : grid.slot) {
    if (s == SampleGrid::kUnknown) s = SampleGrid::kOutside;
  }
}

// ---------------------------------------------------------------- openings

/// The free space before an opening: a disc's worth round the cap's axis, to Lumen::kFreeLength.
struct Mouth {
  const preprocess::Opening* opening;
  double rim_radius;    // of the farthest vertex of the cap                            [mm]
  double flange_width;  //                                                             [mm]
  Vec3 low, high;       // box of all that the opening changes                          [mm]

  double depth(const Vec3& p) const { return opening->normal.dot(p - opening->center); }
  double lateral(const Vec3& p) const {
    const Vec3 offset = p - opening->center;
    return (offset - opening->normal.dot(offset) * opening->normal).norm();
  }
};

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

/// Measures anew, without the caps, near the openings of a grid that holds the closed surface's
/// distances and signs. What no wall is near keeps its sign, but before an opening it is free.
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

/// Coefficients c of the cubic B-spline that takes the sampled values s at the nodes: B c = s, by
/// c <- c + (s - B c). Three rounds: smooth parts are then interpolated to the eighth order, while
/// kinks (the middle of a vessel) stay rounded instead of ringing.
std::vector<double> spline_coefficients(const SampleGrid& grid) {
  constexpr int kRounds = 3, kHalo = 10;
  std::vector<double> coefficients = grid.values, updated(grid.values.size());
  using Halo = std::array<double, kHalo * kHalo * kHalo>;
  const auto at = [](Halo& a, int i, int j, int k) -> double& {
    return a[static_cast<std::size_t>(i + kHalo * (j + kHalo * k))];
  };
  const auto update = [&](std::size_t s) {
    const auto& [bi, bj, bk] = grid.sampled[s];
    Halo halo, pass;
    for (int k = 0; k < kHalo; ++k) {
      for (int j = 0; j < kHalo; ++j) {
        for (int i = 0; i < kHalo; ++i) {
          at(halo, i, j, k) = grid.at(coefficients, 8 * bi + i - 1, 8 * bj + j - 1, 8 * bk + k - 1);
        }
      }
    }
    // (1 4 1)/6 along x, y, z in turn, in place from `halo` to `pass` and back.
    for (int k = 0; k < kHalo; ++k) {
      for (int j = 0; j < kHalo; ++j) {
        for (int i = 1; i <= 8; ++i) {
          at(pass, i, j, k) =
              (at(halo, i - 1, j, k) + 4.0 * at(halo, i, j, k) + at(halo, i + 1, j, k)) / 6.0;
        }
      }
    }
    for (int k = 0; k < kHalo; ++k) {
      for (int j = 1; j <= 8; ++j) {
        for (int i = 1; i <= 8; ++i) {
          at(halo, i, j, k) =
              (at(pass, i, j - 1, k) + 4.0 * at(pass, i, j, k) + at(pass, i, j + 1, k)) / 6.0;
        }
      }
    }
    for (int v = 0; v < SampleGrid::kVolume; ++v) {
      const int i = 1 + (v & 7), j = 1 + ((v >> 3) & 7), k = 1 + (v >> 6);
      const double smoothed =
          (at(halo, i, j, k - 1) + 4.0 * at(halo, i, j, k) + at(halo, i, j, k + 1)) / 6.0;
      const std::size_t n = s * SampleGrid::kVolume + static_cast<std::size_t>(v);
      updated[n] = coefficients[n] + grid.values[n] - smoothed;
    }
  };
  for (int round = 0; round < kRounds; ++round) {
    for_each_index(grid.sampled.size(), update);
    std::swap(coefficients, updated);
  }
  return coefficients;
}

/// The four cubic B-splines at a fraction t of a cell, and their derivatives over it.
struct SplineWeights {
  using Row = Eigen::Array4d;
  double t;

  // Coefficients of the powers of t.
  static Row c0() { return Row(1.0, 4.0, 1.0, 0.0) / 6.0; }
  static Row c1() { return Row(-0.5, 0.0, 0.5, 0.0); }
  static Row c2() { return Row(0.5, -1.0, 0.5, 0.0); }
  static Row c3() { return Row(-1.0, 3.0, -3.0, 1.0) / 6.0; }

  Row value() const { return c0() + t * (c1() + t * (c2() + t * c3())); }
  Row first() const { return c1() + t * (2.0 * c2() + t * (3.0 * c3())); }
  Row second() const { return 2.0 * c2() + t * (6.0 * c3()); }
};

}  // namespace

Lumen::Lumen(const Surface& surface, const LumenOptions& options)
    : spacing_(options.grid_spacing), band_(options.band), openings_(options.openings) {
  expects(surface.triangles.cols() > 0 && spacing_ > 0.0 && band_ > 0.0);

  // 1. A grid round the surface and what is free before its openings, with room for the band and
  // the splines' support.
  SampleGrid grid;
  grid.spacing = spacing_;
  grid.limit = band_ + 2.0 * spacing_;
  const double margin = grid.limit + 2.0 * spacing_, brick_side = SampleGrid::kSide * spacing_;
  const Vec3 least = surface.vertices.rowwise().minCoeff().array() - margin;
  Vec3 low = least, high = surface.vertices.rowwise().maxCoeff().array() + margin;
  std::vector<Mouth> mouths;
  for (const preprocess::Opening& opening : openings_) {
    mouths.push_back(describe_mouth(surface, opening, grid.limit));
    low = low.cwiseMin(mouths.back().low);
    high = high.cwiseMax(mouths.back().high);
  }
  // Whole bricks are added, so that an opening moves no sample elsewhere.
  for (int d = 0; d < 3; ++d) {
    grid.origin[d] = least[d] - brick_side * std::ceil((least[d] - low[d]) / brick_side);
    grid.bricks[d] = static_cast<int>(std::ceil((high[d] - grid.origin[d]) / brick_side));
  }
  grid.slot.assign(grid.brick_index(0, 0, grid.bricks[2]), SampleGrid::kUnknown);

  // 2. Exact distances near the closed wall, signs beyond; then the openings; spline coefficients.
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    add_samples(grid, node_box(grid, surface, f));
  }
  for (const Mouth& mouth : mouths) add_samples(grid, node_box(grid, mouth.low, mouth.high));
  grid.values.assign(grid.sampled.size() * SampleGrid::kVolume,
                     std::numeric_limits<double>::infinity());
  scatter_distances(grid, surface, {node_box(grid, low, high)});
  spread_signs(grid);
  if (!mouths.empty()) open_caps(grid, surface, mouths);
  const std::vector<double> coefficients = spline_coefficients(grid);

  // 3. Bricks that carry all coefficients that their cells need, so that a look-up stays in one.
  origin_ = grid.origin;
  bricks_ = grid.bricks;
  brick_ = grid.slot;
  constexpr std::size_t kPerBrick = static_cast<std::size_t>(kNodes) * kNodes * kNodes;
  coefficients_.resize(grid.sampled.size() * kPerBrick);
  for_each_index(grid.sampled.size(), [&](std::size_t slot) {
    const auto& [bi, bj, bk] = grid.sampled[slot];
    float* target = coefficients_.data() + slot * kPerBrick;
    for (int k = 0; k < kNodes; ++k) {
      for (int j = 0; j < kNodes; ++j) {
        for (int i = 0; i < kNodes; ++i) {
          *target++ = static_cast<float>(
              grid.at(coefficients, kCells * bi + i - 1, kCells * bj + j - 1, kCells * bk + k - 1));
        }
      }
    }
  });

  // 4. How well the smooth wall follows the triangles, caps left out.
  std::vector<bool> is_wall(static_cast<std::size_t>(surface.triangles.cols()), true);
  for (const preprocess::Opening& opening : openings_) {
    for (const int f : opening.triangles) is_wall[static_cast<std::size_t>(f)] = false;
  }
  std::vector<bool> measured(static_cast<std::size_t>(surface.vertices.cols()), false);
  double sum = 0.0;
  Eigen::Index count = 0;
  const auto measure = [&](const Vec3& p) {
    const double deviation = std::abs(distance(p));
    max_deviation_ = std::max(max_deviation_, deviation);
    sum += deviation;
    ++count;
  };
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    if (!is_wall[static_cast<std::size_t>(f)]) continue;
    Vec3 centroid = Vec3::Zero();
    for (int c = 0; c < 3; ++c) {
      const int v = surface.triangles(c, f);
      const Vec3 p = surface.vertices.col(v);
      centroid += p / 3.0;
      if (!measured[static_cast<std::size_t>(v)]) measure(p);
      measured[static_cast<std::size_t>(v)] = true;
    }
    measure(centroid);
  }
  mean_deviation_ = sum / static_cast<double>(count);
}

Lumen::Place Lumen::find_place(const Vec3& point) const {
  Place place{nullptr, -1.0, {0, 0, 0}, Vec3::Zero()};
  std::array<int, 3> brick{};
  for (int d = 0; d < 3; ++d) {
    const double u = (point[d] - origin_[d]) / spacing_;
    if (!(u >= 0.0 && u < static_cast<double>(kCells) * bricks_[d])) return place;
    const int cell = static_cast<int>(u);
    brick[d] = cell / kCells;
    place.cell[d] = cell % kCells;
    place.fraction[d] = u - cell;
  }
  const std::size_t index =
      static_cast<std::size_t>(brick[0]) +
      static_cast<std::size_t>(bricks_[0]) *
          (static_cast<std::size_t>(brick[1]) +
           static_cast<std::size_t>(bricks_[1]) * static_cast<std::size_t>(brick[2]));
  const std::int32_t s = brick_[index];
  if (s >= 0) {
    place.coefficients =
        coefficients_.data() + static_cast<std::size_t>(s) * kNodes * kNodes * kNodes;
  } else if (s == SampleGrid::kInside) {
    place.sign = 1.0;
  }
  return place;
}

Eigen::Array4d Lumen::Place::row(int j, int k) const {
  const float* first = coefficients + cell[0] + kNodes * (cell[1] + j + kNodes * (cell[2] + k));
  return Eigen::Map<const Eigen::Array4f>(first).cast<double>();
}

double Lumen::distance(const Vec3& point) const {
  const Place place = find_place(point);
  if (place.coefficients == nullptr) return place.sign * band_;
  const SplineWeights x{place.fraction[0]}, y{place.fraction[1]}, z{place.fraction[2]};
  const Eigen::Array4d wy = y.value(), wz = z.value();
  Eigen::Array4d sum = Eigen::Array4d::Zero();
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) sum += (wz[k] * wy[j]) * place.row(j, k);
  }
  return std::clamp((x.value() * sum).sum(), -band_, band_);
}

WallSample Lumen::sample(const Vec3& point) const {
  const Place place = find_place(point);
  WallSample result;
  result.distance = place.sign * band_;
  if (place.coefficients == nullptr) return result;
  // Sums over z of sums over y, of four values along x each; names tell the derivatives taken.
  using Row = Eigen::Array4d;
  const SplineWeights x{place.fraction[0]}, y{place.fraction[1]}, z{place.fraction[2]};
  const Row y0 = y.value(), y1 = y.first(), y2 = y.second();
  const Row z0 = z.value(), z1 = z.first(), z2 = z.second();
  Row f = Row::Zero(), fy = Row::Zero(), fyy = Row::Zero(), fz = Row::Zero(), fyz = Row::Zero(),
      fzz = Row::Zero();
  for (int k = 0; k < 4; ++k) {
    Row g = Row::Zero(), gy = Row::Zero(), gyy = Row::Zero();
    for (int j = 0; j < 4; ++j) {
      const Row c = place.row(j, k);
      g += y0[j] * c;
      gy += y1[j] * c;
      gyy += y2[j] * c;
    }
    f += z0[k] * g;
    fy += z0[k] * gy;
    fyy += z0[k] * gyy;
    fz += z1[k] * g;
    fyz += z1[k] * gy;
    fzz += z2[k] * g;
  }
  const Row x0 = x.value(), x1 = x.first(), x2 = x.second();
  const double value = (x0 * f).sum();
  if (std::abs(value) >= band_) {
    result.distance = std::copysign(band_, value);
    return result;
  }
  result.distance = value;
  result.gradient << (x1 * f).sum(), (x0 * fy).sum(), (x0 * fz).sum();
  result.gradient /= spacing_;
  const double xx = (x2 * f).sum(), xy = (x1 * fy).sum(), xz = (x1 * fz).sum();
  const double yy = (x0 * fyy).sum(), yz = (x0 * fyz).sum(), zz = (x0 * fzz).sum();
  result.hessian << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  result.hessian /= spacing_ * spacing_;
  return result;
}

std::size_t Lumen::memory_bytes() const {
  return coefficients_.size() * sizeof(float) + brick_.size() * sizeof(std::int32_t);
}

}  // namespace wireplan::simulate
