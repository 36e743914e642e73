/// The lumen's field from the vessel's surface; look-ups in it are in lumen.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "simulate/wall/lumen.h"
#include "simulate/wall/mouths.h"
#include "simulate/wall/parallel.h"
#include "simulate/wall/sample_grid.h"
#include "simulate/wall/signed_distances.h"

namespace wireplan::simulate {
namespace {

/// A grid round the surface and what is free before its openings, with room for the field's limit
/// and the splines' support.
SampleGrid surround(const Surface& surface, const std::vector<Mouth>& mouths, double spacing,
                    double limit) {
  SampleGrid grid;
  grid.spacing = spacing;
  grid.limit = limit;
  const double margin = grid.limit + 2.0 * spacing, brick_side = SampleGrid::kSide * spacing;
  const Vec3 least = surface.vertices.rowwise().minCoeff().array() - margin;
  Vec3 low = least, high = surface.vertices.rowwise().maxCoeff().array() + margin;
  for (const Mouth& mouth : mouths) {
    low = low.cwiseMin(mouth.low);
    high = high.cwiseMax(mouth.high);
  }
  // Whole bricks are added, so that an opening moves no sample elsewhere.
  for (int d = 0; d < 3; ++d) {
    grid.origin[d] = least[d] - brick_side * std::ceil((least[d] - low[d]) / brick_side);
    grid.bricks[d] = static_cast<int>(std::ceil((high[d] - grid.origin[d]) / brick_side));
  }
  grid.slot.assign(grid.brick_index(0, 0, grid.bricks[2]), SampleGrid::kUnknown);
  return grid;
}

/// Exact distances near the closed wall, signs beyond; then the openings.
SampleGrid measure_field(const Surface& surface, const std::vector<Mouth>& mouths, double spacing,
                         double limit) {
  SampleGrid grid = surround(surface, mouths, spacing, limit);
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    add_samples(grid, node_box(grid, surface, f));
  }
  for (const Mouth& mouth : mouths) add_samples(grid, node_box(grid, mouth.low, mouth.high));
  grid.values.assign(grid.sampled.size() * SampleGrid::kVolume,
                     std::numeric_limits<double>::infinity());
  scatter_distances(grid, surface, {whole_box(grid)});
  spread_signs(grid);
  if (!mouths.empty()) open_caps(grid, surface, mouths);
  return grid;
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

}  // namespace

Lumen::Lumen(const Surface& surface, const LumenOptions& options)
    : spacing_(options.grid_spacing), band_(options.band), openings_(options.openings) {
  expects(surface.triangles.cols() > 0 && spacing_ > 0.0 && band_ > 0.0);

  const double limit = band_ + 2.0 * spacing_;
  std::vector<Mouth> mouths;
  for (const preprocess::Opening& opening : openings_) {
    mouths.push_back(describe_mouth(surface, opening, limit));
  }
  const SampleGrid grid = measure_field(surface, mouths, spacing_, limit);
  keep_bricks(grid, spline_coefficients(grid));
  measure_deviation(surface);
}

void Lumen::keep_bricks(const SampleGrid& grid, const std::vector<double>& coefficients) {
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
}

void Lumen::measure_deviation(const Surface& surface) {
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

}  // namespace wireplan::simulate
