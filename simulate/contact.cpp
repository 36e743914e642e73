#include "simulate/contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

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

/// Offset of a point from the nearest point of a triangle, and the normal of the feature that it
/// lies on (Ericson, "Real-Time Collision Detection", 5.1.5).
struct NearestOnTriangle {
  Vec3 offset;
  const double* normal;
};

NearestOnTriangle nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
                                      const PseudoNormals& normals, Eigen::Index f,
                                      const Eigen::Vector3i& t) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {ap, normals.vertex.col(t[0]).data()};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {bp, normals.vertex.col(t[1]).data()};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    return {ap - (d1 / (d1 - d3)) * ab, normals.edge[f][0].data()};
  }
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {cp, normals.vertex.col(t[2]).data()};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    return {ap - (d2 / (d2 - d6)) * ac, normals.edge[f][2].data()};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {bp - w * (c - b), normals.edge[f][1].data()};
  }
  const double inverse = 1.0 / (va + vb + vc);
  return {ap - (vb * inverse) * ab - (vc * inverse) * ac, normals.face.col(f).data()};
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
  std::vector<std::int32_t> slot;  // of each brick; negative: no samples there
  std::vector<double> values;      // kVolume per slot

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

/// Grid indices whose nodes lie within `reach` of the box of a triangle.
struct NodeBox {
  std::array<int, 3> low, high;
};

NodeBox node_box(const SampleGrid& grid, const Surface& surface, Eigen::Index f, double reach) {
  NodeBox box{};
  for (int d = 0; d < 3; ++d) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (int c = 0; c < 3; ++c) {
      const double x = surface.vertices(d, surface.triangles(c, f));
      low = std::min(low, x);
      high = std::max(high, x);
    }
    box.low[d] =
        std::max(0, static_cast<int>(std::ceil((low - reach - grid.origin[d]) / grid.spacing)));
    box.high[d] =
        std::min(grid.bricks[d] * SampleGrid::kSide - 1,
                 static_cast<int>(std::floor((high + reach - grid.origin[d]) / grid.spacing)));
  }
  return box;
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

/// Distances of all nodes within `limit` of the surface. Unreached nodes keep the value +infinity.
void scatter_distances(SampleGrid& grid, const Surface& surface) {
  const Eigen::Index m = surface.triangles.cols();
  const double reach = grid.limit;
  std::int32_t slots = 0;
  for (Eigen::Index f = 0; f < m; ++f) {
    for_each_brick(grid, node_box(grid, surface, f, reach), [&](std::int32_t& s, int, int, int) {
      if (s < 0) s = slots++;
    });
  }
  grid.values.assign(static_cast<std::size_t>(slots) * SampleGrid::kVolume,
                     std::numeric_limits<double>::infinity());

  const PseudoNormals normals = compute_pseudo_normals(surface);
  for (Eigen::Index f = 0; f < m; ++f) {
    const Eigen::Vector3i t = surface.triangles.col(f);
    const Vec3 a = surface.vertices.col(t[0]), b = surface.vertices.col(t[1]),
               c = surface.vertices.col(t[2]);
    const Vec3 plane = normals.face.col(f);
    const NodeBox box = node_box(grid, surface, f, reach);
    for_each_brick(grid, box, [&](std::int32_t& s, int bi, int bj, int bk) {
      double* values = grid.values.data() + static_cast<std::size_t>(s) * SampleGrid::kVolume;
      for (int k = std::max(box.low[2], 8 * bk); k <= std::min(box.high[2], 8 * bk + 7); ++k) {
        for (int j = std::max(box.low[1], 8 * bj); j <= std::min(box.high[1], 8 * bj + 7); ++j) {
          for (int i = std::max(box.low[0], 8 * bi); i <= std::min(box.high[0], 8 * bi + 7); ++i) {
            double& value = values[SampleGrid::node_index(i & 7, j & 7, k & 7)];
            const Vec3 p = grid.origin + grid.spacing * Vec3(i, j, k);
            const double bound = std::min(std::abs(value), reach);
            if (std::abs(plane.dot(p - a)) >= bound) continue;
            const NearestOnTriangle nearest = nearest_on_triangle(p, a, b, c, normals, f, t);
            const double squared_distance = nearest.offset.squaredNorm();
            if (squared_distance >= bound * bound) continue;
            const bool outside = nearest.offset.dot(Eigen::Map<const Vec3>(nearest.normal)) > 0.0;
            value = outside ? -std::sqrt(squared_distance) : std::sqrt(squared_distance);
          }
        }
      }
    });
  }
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
  for (int k = 0; k < grid.bricks[2]; ++k) {
    for (int j = 0; j < grid.bricks[1]; ++j) {
      for (int i = 0; i < grid.bricks[0]; ++i) {
        if (grid.slot[grid.brick_index(i, j, k)] < 0) continue;
        for (int v = 0; v < SampleGrid::kVolume; ++v) {
          const std::array<int, 3> n = {8 * i + (v & 7), 8 * j + ((v >> 3) & 7), 8 * k + (v >> 6)};
          if (std::isfinite(*value_at(n))) front.push_back(n);
        }
      }
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

/// Coefficients c of the cubic B-spline that takes the sampled values s at the nodes: B c = s, by
/// c <- c + (s - B c). Three rounds: smooth parts are then interpolated to the eighth order, while
/// kinks (the middle of a vessel) stay rounded instead of ringing.
std::vector<double> spline_coefficients(const SampleGrid& grid) {
  constexpr int kRounds = 3, kHalo = 10;
  std::vector<double> coefficients = grid.values, updated(grid.values.size());
  std::array<double, kHalo * kHalo * kHalo> halo{}, pass{};
  const auto at = [](std::array<double, kHalo * kHalo * kHalo>& a, int i, int j, int k) -> double& {
    return a[static_cast<std::size_t>(i + kHalo * (j + kHalo * k))];
  };
  for (int round = 0; round < kRounds; ++round) {
    for (int bk = 0; bk < grid.bricks[2]; ++bk) {
      for (int bj = 0; bj < grid.bricks[1]; ++bj) {
        for (int bi = 0; bi < grid.bricks[0]; ++bi) {
          const std::int32_t s = grid.slot[grid.brick_index(bi, bj, bk)];
          if (s < 0) continue;
          for (int k = 0; k < kHalo; ++k) {
            for (int j = 0; j < kHalo; ++j) {
              for (int i = 0; i < kHalo; ++i) {
                at(halo, i, j, k) =
                    grid.at(coefficients, 8 * bi + i - 1, 8 * bj + j - 1, 8 * bk + k - 1);
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
            const std::size_t n =
                static_cast<std::size_t>(s) * SampleGrid::kVolume + static_cast<std::size_t>(v);
            updated[n] = coefficients[n] + grid.values[n] - smoothed;
          }
        }
      }
    }
    std::swap(coefficients, updated);
  }
  return coefficients;
}

/// Values, first and second derivatives of the four cubic B-splines at a fraction of a cell, in
/// cells.
struct SplineWeights {
  double value[4], first[4], second[4];
};

SplineWeights spline_weights(double t) {
  const double u = 1.0 - t;
  return {{u * u * u / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
           (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0, t * t * t / 6.0},
          {-0.5 * u * u, -2.0 * t + 1.5 * t * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t},
          {u, -2.0 + 3.0 * t, -2.0 + 3.0 * u, t}};
}

}  // namespace

Lumen::Lumen(const Surface& surface, const LumenOptions& options)
    : spacing_(options.grid_spacing), band_(options.band) {
  expects(surface.triangles.cols() > 0 && spacing_ > 0.0 && band_ > 0.0);

  // 1. A grid round the surface with room for the band and the splines' support.
  SampleGrid grid;
  grid.spacing = spacing_;
  grid.limit = band_ + 2.0 * spacing_;
  const Vec3 low = surface.vertices.rowwise().minCoeff(),
             high = surface.vertices.rowwise().maxCoeff();
  const double margin = grid.limit + 2.0 * spacing_;
  grid.origin = low.array() - margin;
  for (int d = 0; d < 3; ++d) {
    const double extent = high[d] - low[d] + 2.0 * margin;
    grid.bricks[d] = static_cast<int>(std::ceil(extent / (SampleGrid::kSide * spacing_)));
  }
  grid.slot.assign(grid.brick_index(0, 0, grid.bricks[2]), SampleGrid::kUnknown);

  // 2. Exact distances near the wall, signs beyond, spline coefficients.
  scatter_distances(grid, surface);
  spread_signs(grid);
  const std::vector<double> coefficients = spline_coefficients(grid);

  // 3. Bricks that carry all coefficients that their cells need, so that a look-up stays in one.
  origin_ = grid.origin;
  bricks_ = grid.bricks;
  brick_ = grid.slot;
  const std::size_t slots = grid.values.size() / SampleGrid::kVolume;
  coefficients_.resize(slots * kNodes * kNodes * kNodes);
  for (int bk = 0; bk < bricks_[2]; ++bk) {
    for (int bj = 0; bj < bricks_[1]; ++bj) {
      for (int bi = 0; bi < bricks_[0]; ++bi) {
        const std::int32_t s = brick_[grid.brick_index(bi, bj, bk)];
        if (s < 0) continue;
        float* target =
            coefficients_.data() + static_cast<std::size_t>(s) * kNodes * kNodes * kNodes;
        for (int k = 0; k < kNodes; ++k) {
          for (int j = 0; j < kNodes; ++j) {
            for (int i = 0; i < kNodes; ++i) {
              *target++ = static_cast<float>(grid.at(coefficients, kCells * bi + i - 1,
                                                     kCells * bj + j - 1, kCells * bk + k - 1));
            }
          }
        }
      }
    }
  }

  // 4. How well the smooth wall follows the triangles.
  double sum = 0.0;
  Eigen::Index count = 0;
  const auto measure = [&](const Vec3& p) {
    const double deviation = std::abs(distance(p));
    max_deviation_ = std::max(max_deviation_, deviation);
    sum += deviation;
    ++count;
  };
  for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) measure(surface.vertices.col(v));
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    const Eigen::Vector3i t = surface.triangles.col(f);
    measure((surface.vertices.col(t[0]) + surface.vertices.col(t[1]) + surface.vertices.col(t[2])) /
            3.0);
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

double Lumen::distance(const Vec3& point) const {
  const Place place = find_place(point);
  if (place.coefficients == nullptr) return place.sign * band_;
  const SplineWeights x = spline_weights(place.fraction[0]), y = spline_weights(place.fraction[1]),
                      z = spline_weights(place.fraction[2]);
  double sum = 0.0;
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      const float* row = place.coefficients + place.cell[0] +
                         kNodes * (place.cell[1] + j + kNodes * (place.cell[2] + k));
      const double along =
          x.value[0] * row[0] + x.value[1] * row[1] + x.value[2] * row[2] + x.value[3] * row[3];
      sum += z.value[k] * y.value[j] * along;
    }
  }
  return std::clamp(sum, -band_, band_);
}

WallSample Lumen::sample(const Vec3& point) const {
  const Place place = find_place(point);
  WallSample result;
  result.distance = place.sign * band_;
  if (place.coefficients == nullptr) return result;
  const SplineWeights x = spline_weights(place.fraction[0]), y = spline_weights(place.fraction[1]),
                      z = spline_weights(place.fraction[2]);
  // Sums over z of (sums over y of (sums over x)); names tell the derivatives taken.
  double f = 0.0, fx = 0.0, fy = 0.0, fz = 0.0, fxx = 0.0, fxy = 0.0, fxz = 0.0, fyy = 0.0,
         fyz = 0.0, fzz = 0.0;
  for (int k = 0; k < 4; ++k) {
    double g = 0.0, gx = 0.0, gy = 0.0, gxx = 0.0, gxy = 0.0, gyy = 0.0;
    for (int j = 0; j < 4; ++j) {
      const float* row = place.coefficients + place.cell[0] +
                         kNodes * (place.cell[1] + j + kNodes * (place.cell[2] + k));
      double h = 0.0, hx = 0.0, hxx = 0.0;
      for (int i = 0; i < 4; ++i) {
        const double c = row[i];
        h += x.value[i] * c;
        hx += x.first[i] * c;
        hxx += x.second[i] * c;
      }
      g += y.value[j] * h;
      gx += y.value[j] * hx;
      gy += y.first[j] * h;
      gxx += y.value[j] * hxx;
      gxy += y.first[j] * hx;
      gyy += y.second[j] * h;
    }
    f += z.value[k] * g;
    fx += z.value[k] * gx;
    fy += z.value[k] * gy;
    fz += z.first[k] * g;
    fxx += z.value[k] * gxx;
    fxy += z.value[k] * gxy;
    fyy += z.value[k] * gyy;
    fxz += z.first[k] * gx;
    fyz += z.first[k] * gy;
    fzz += z.second[k] * g;
  }
  if (std::abs(f) >= band_) {
    result.distance = std::copysign(band_, f);
    return result;
  }
  const double per_mm = 1.0 / spacing_, per_mm2 = per_mm * per_mm;
  result.distance = f;
  result.gradient = per_mm * Vec3(fx, fy, fz);
  result.hessian << fxx, fxy, fxz, fxy, fyy, fyz, fxz, fyz, fzz;
  result.hessian *= per_mm2;
  return result;
}

std::size_t Lumen::memory_bytes() const {
  return coefficients_.size() * sizeof(float) + brick_.size() * sizeof(std::int32_t);
}

}  // namespace wireplan::simulate
