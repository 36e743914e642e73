#include "simulate/wall/signed_distances.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "preprocess/surface/triangle.h"
#include "preprocess/surface/triangle_sides.h"
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
  normals.vertex = angle_weighted_normals(surface);
  for (Eigen::Index f = 0; f < m; ++f) {
    normals.face.col(f) = unit_normal(surface, f);
  }
  const Eigen::Matrix3Xi neighbours = preprocess::triangle_neighbours(surface);
  normals.edge.resize(m);
  for (Eigen::Index f = 0; f < m; ++f) {
    for (int c = 0; c < 3; ++c) {
      const int other = neighbours(c, f);
      normals.edge[f][c] = normals.face.col(f);
      if (other >= 0) normals.edge[f][c] += normals.face.col(other);
    }
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

// ---------------------------------------------------------------- triangles to nodes

/// Each triangle lies in a disc of its plane, which is quickly tested: its middle, normal and
/// radius by columns 0-2, 3-5, 6, with the plane's place along its normal in 7.
using Discs = Eigen::Array<double, Eigen::Dynamic, 8>;

/// Triangles that may be the nearest of some node of a block. Arrays are longer than `count`.
struct Candidates {
  Discs disc;
  Eigen::ArrayXd distance;  // no triangle is nearer, to where measure() was asked          [mm]
  std::vector<int> triangle;
  Eigen::Index count = 0;

  void clear(std::size_t most) {
    count = 0;
    if (triangle.size() >= most) return;
    disc.resize(static_cast<Eigen::Index>(most), Eigen::NoChange);
    distance.resize(static_cast<Eigen::Index>(most));
    triangle.resize(most);
  }
  template <class Row>
  void add(int f, const Row& its_disc) {
    disc.row(count) = its_disc;
    triangle[static_cast<std::size_t>(count++)] = f;
  }
  void measure(const Vec3& p) {
    const auto column = [&](int c) { return disc.col(c).head(count); };
    const auto square =
        (column(0) - p[0]).square() + (column(1) - p[1]).square() + (column(2) - p[2]).square();
    const auto height =
        (column(3) * p[0] + column(4) * p[1] + column(5) * p[2] - column(7)).square();
    const auto aside = ((square - height).max(0.0).sqrt() - column(6)).max(0.0);
    distance.head(count) = (height + aside.square()).sqrt();
  }
};

/// Distances of triangles to the nodes of a brick. A block of nodes is halved down to two along
/// each axis, each time without the triangles that cannot be the nearest of any of its nodes.
class BlockDistances {
 public:
  /// The candidates of a block, and what is left of them for those of half its side; of one thread.
  using Memory = std::array<Candidates, 4>;

  BlockDistances(SampleGrid& grid, const Surface& surface)
      : grid_(grid), surface_(surface), normals_(compute_pseudo_normals(surface)) {
    const Eigen::Index m = surface.triangles.cols();
    disc_.resize(m, Eigen::NoChange);
    for (Eigen::Index f = 0; f < m; ++f) {
      const Eigen::Vector3i t = surface.triangles.col(f);
      Mat3 corners;
      for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(t[c]);
      const Vec3 middle = corners.rowwise().mean(), normal = normals_.face.col(f);
      const double square = (corners.colwise() - middle).colwise().squaredNorm().maxCoeff();
      disc_.row(f) << middle.transpose().array(), normal.transpose().array(), std::sqrt(square),
          normal.dot(middle);
    }
  }

  /// Takes over what is shorter than what a node has, and than the grid's limit. Expects a
  /// triangle near.
  void take(std::size_t slot, const std::vector<int>& near, Memory& memory) const {
    memory[0].clear(near.size());
    for (const int f : near) memory[0].add(f, disc_.row(f));
    take(slot, {0, 0, 0}, SampleGrid::kSide, memory.data());
  }

 private:
  void take(std::size_t slot, const std::array<int, 3>& first, int side, Candidates* near) const {
    // The ball round the block; what is farther than the nearest one by its width is no one's.
    const std::array<int, 3>& brick = grid_.sampled[slot];
    const Vec3 low(SampleGrid::kSide * brick[0] + first[0], SampleGrid::kSide * brick[1] + first[1],
                   SampleGrid::kSide * brick[2] + first[2]);
    const Vec3 center = grid_.origin + grid_.spacing * (low.array() + 0.5 * (side - 1)).matrix();
    const double reach = 0.5 * (side - 1) * std::sqrt(3.0) * grid_.spacing;
    near->measure(center);
    Eigen::Index nearest = 0;
    near->distance.head(near->count).minCoeff(&nearest);
    const int first_tried = near->triangle[static_cast<std::size_t>(nearest)];
    const double least =
        std::min(grid_.limit, to_triangle(center, first_tried).offset.norm() + reach);
    Candidates* left = near + 1;
    left->clear(static_cast<std::size_t>(near->count));
    for (Eigen::Index k = 0; k < near->count; ++k) {
      if (near->distance[k] - reach > least + kRounding) continue;
      left->add(near->triangle[static_cast<std::size_t>(k)], near->disc.row(k));
    }
    if (left->count == 0) return;

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
      take(value, p, first_tried);
      left->measure(p);
      for (Eigen::Index c = 0; c < left->count; ++c) {
        if (left->distance[c] - kRounding >= std::min(std::abs(value), grid_.limit)) continue;
        take(value, p, left->triangle[static_cast<std::size_t>(c)]);
      }
    }
  }

  static constexpr double kRounding = 1e-9;  // [mm]

  NearestOnTriangle to_triangle(const Vec3& p, Eigen::Index f) const {
    const Eigen::Vector3i t = surface_.triangles.col(f);
    return nearest_on_triangle(p, surface_.vertices.col(t[0]), surface_.vertices.col(t[1]),
                               surface_.vertices.col(t[2]));
  }

  void take(double& value, const Vec3& p, Eigen::Index f) const {
    const double bound = std::min(std::abs(value), grid_.limit);
    const NearestOnTriangle nearest = to_triangle(p, f);
    const double square = nearest.offset.squaredNorm();
    if (square >= bound * bound) return;
    const Vec3 normal = normal_of(nearest, normals_, f, surface_.triangles.col(f));
    value = nearest.offset.dot(normal) > 0.0 ? -std::sqrt(square) : std::sqrt(square);
  }

  SampleGrid& grid_;
  const Surface& surface_;
  const PseudoNormals normals_;
  Discs disc_;  // of each triangle
};

// ---------------------------------------------------------------- signs where no wall is near

using Index = std::array<int, 3>;  // of a node or a brick in the whole grid

/// Null where the node is beyond the grid or in a brick without samples.
double* value_at(SampleGrid& grid, const Index& n) {
  for (int d = 0; d < 3; ++d) {
    if (n[d] < 0 || n[d] >= SampleGrid::kSide * grid.bricks[d]) return nullptr;
  }
  const std::int32_t s = grid.slot[grid.brick_index(n[0] >> 3, n[1] >> 3, n[2] >> 3)];
  if (s < 0) return nullptr;
  return &grid.values[static_cast<std::size_t>(s) * SampleGrid::kVolume +
                      SampleGrid::node_index(n[0] & 7, n[1] & 7, n[2] & 7)];
}

template <class Visit>
void for_each_neighbour(const Index& n, const Visit& visit) {
  for (int d = 0; d < 3; ++d) {
    for (const int step : {-1, 1}) {
      Index neighbour = n;
      neighbour[d] += step;
      visit(neighbour);
    }
  }
}

/// To nodes: sweeps until nothing changes; each brick holds a few layers of them.
void spread_signs_over_nodes(SampleGrid& grid) {
  struct Signed {
    Index node;
    double value;
  };
  std::vector<Signed> front, next;
  const auto reach = [&](const Index& n, double value) {
    double* there = value_at(grid, n);
    if (there == nullptr || std::isfinite(*there)) return;
    *there = value;
    next.push_back({n, value});
  };
  // First those beside a distance.
  for (std::size_t s = 0; s < grid.sampled.size(); ++s) {
    const auto& [i, j, k] = grid.sampled[s];
    for (int v = 0; v < SampleGrid::kVolume; ++v) {
      if (std::isfinite(grid.values[s * SampleGrid::kVolume + static_cast<std::size_t>(v)])) {
        continue;
      }
      const Index n = {8 * i + (v & 7), 8 * j + ((v >> 3) & 7), 8 * k + (v >> 6)};
      for_each_neighbour(n, [&](const Index& neighbour) {
        const double* known = value_at(grid, neighbour);
        if (known == nullptr || !std::isfinite(*known)) return;
        front.push_back({n, std::copysign(grid.limit, *known)});
      });
    }
  }
  for (const Signed& first : front) reach(first.node, first.value);
  for (std::swap(front, next); !front.empty(); std::swap(front, next)) {
    next.clear();
    for (const Signed& at : front) {
      for_each_neighbour(at.node, [&](const Index& neighbour) { reach(neighbour, at.value); });
    }
  }
  for (double& value : grid.values) {
    if (!std::isfinite(value)) value = -grid.limit;  // a brick that no distance reached
  }
}

/// Whether a brick without samples lies at one whose samples on the shared face are inside.
bool touches_inside(SampleGrid& grid, const Index& brick) {
  for (int d = 0; d < 3; ++d) {
    for (const int side : {-1, 8}) {
      Index n = {8 * brick[0] + 4, 8 * brick[1] + 4, 8 * brick[2] + 4};
      n[d] = 8 * brick[d] + side;
      const double* value = value_at(grid, n);
      if (value != nullptr && *value > 0.0) return true;
    }
  }
  return false;
}

/// To bricks: from those with samples inward; the rest, and the rim of the grid, is outside.
void spread_signs_over_bricks(SampleGrid& grid) {
  const auto in_grid = [&](const Index& b) {
    return b[0] >= 0 && b[1] >= 0 && b[2] >= 0 && b[0] < grid.bricks[0] && b[1] < grid.bricks[1] &&
           b[2] < grid.bricks[2];
  };
  std::vector<Index> inside;
  for (int k = 0; k < grid.bricks[2]; ++k) {
    for (int j = 0; j < grid.bricks[1]; ++j) {
      for (int i = 0; i < grid.bricks[0]; ++i) {
        const bool has_samples = grid.slot[grid.brick_index(i, j, k)] >= 0;
        if (!has_samples && touches_inside(grid, {i, j, k})) inside.push_back({i, j, k});
      }
    }
  }
  while (!inside.empty()) {
    const Index b = inside.back();
    inside.pop_back();
    std::int32_t& s = grid.slot[grid.brick_index(b[0], b[1], b[2])];
    if (s != SampleGrid::kUnknown) continue;
    s = SampleGrid::kInside;
    for_each_neighbour(b, [&](const Index& neighbour) {
      if (in_grid(neighbour)) inside.push_back(neighbour);
    });
  }
  for (std::int32_t& s : grid.slot) {
    if (s == SampleGrid::kUnknown) s = SampleGrid::kOutside;
  }
}

}  // namespace

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
    thread_local BlockDistances::Memory memory;
    if (!near[s].empty()) distances.take(s, near[s], memory);
  });
}

void spread_signs(SampleGrid& grid) {
  spread_signs_over_nodes(grid);
  spread_signs_over_bricks(grid);
}

}  // namespace wireplan::simulate
