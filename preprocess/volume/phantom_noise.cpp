#include "preprocess/volume/phantom_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace wireplan::preprocess {
namespace {

/// SplitMix64's finaliser: well mixed bits from a counter.
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// A standard normal number that depends on seed and counter alone, hence not on the threads:
/// Box-Muller from two numbers of 53 bits, the first in (0, 1].
double normal_number(std::uint64_t seed, std::uint64_t counter) {
  const std::uint64_t first = mix(mix(seed) ^ counter), second = mix(first);
  const double u = (static_cast<double>(first >> 11) + 1.0) * 0x1p-53;
  const double v = static_cast<double>(second >> 11) * 0x1p-53;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * v);
}

/// One half of a Gaussian sampled at whole voxels, middle first, which sums to 1 with its mirror
/// image. Sigma in voxels.
std::vector<double> gaussian_weights(double sigma) {
  const int reach = static_cast<int>(std::ceil(4.0 * sigma));
  std::vector<double> weights(static_cast<std::size_t>(reach) + 1);
  double sum = 0.0;
  for (int i = 0; i <= reach; ++i) {
    weights[i] = sigma > 0.0 ? std::exp(-0.5 * i * i / (sigma * sigma)) : 1.0;
    sum += (i == 0 ? 1.0 : 2.0) * weights[i];
  }
  for (double& w : weights) w /= sum;
  return weights;
}

/// By how much a blur of three axes with these weights lowers the sigma of white noise.
double noise_gain(const std::array<std::vector<double>, 3>& weights) {
  double gain = 1.0;
  for (const std::vector<double>& w : weights) {
    double squares = w[0] * w[0];
    for (std::size_t i = 1; i < w.size(); ++i) squares += 2.0 * w[i] * w[i];
    gain *= std::sqrt(squares);
  }
  return gain;
}

void add_white_noise(double sigma, std::uint64_t seed, std::vector<float>& values) {
  const auto count = static_cast<std::int64_t>(values.size());
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < count; ++i) {
    values[i] += static_cast<float>(sigma * normal_number(seed, static_cast<std::uint64_t>(i)));
  }
}

/// Blurs along one axis the plane of `lines` lines of `length` voxels; the steps say how far apart
/// lines and voxels lie. Beyond the ends the last value goes on. The plane is worked on row by row,
/// whichever direction is contiguous, through a copy in `buffer`.
void blur_plane(float* plane, int lines, std::size_t line_step, int length, std::size_t step,
                const std::vector<double>& weights, std::vector<float>& buffer) {
  buffer.resize(static_cast<std::size_t>(lines) * static_cast<std::size_t>(length));
  const auto at = [&](int line, int i) { return static_cast<std::size_t>(i) * lines + line; };
  for (int i = 0; i < length; ++i) {
    for (int line = 0; line < lines; ++line) {
      buffer[at(line, i)] = plane[line * line_step + i * step];
    }
  }
  const int reach = static_cast<int>(weights.size()) - 1;
  for (int i = 0; i < length; ++i) {
    for (int line = 0; line < lines; ++line) {
      double sum = weights[0] * buffer[at(line, i)];
      for (int r = 1; r <= reach; ++r) {
        sum += weights[r] * (static_cast<double>(buffer[at(line, std::max(i - r, 0))]) +
                             buffer[at(line, std::min(i + r, length - 1))]);
      }
      plane[line * line_step + i * step] = static_cast<float>(sum);
    }
  }
}

/// One half of the Gaussian of each axis.
std::array<std::vector<double>, 3> weights_of(double sigma_mm, const Vec3& spacing) {
  std::array<std::vector<double>, 3> weights;
  for (int axis = 0; axis < 3; ++axis) weights[axis] = gaussian_weights(sigma_mm / spacing(axis));
  return weights;
}

/// Of two kernels, each given by its half: the sum of their products.
double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = a[0] * b[0];
  for (std::size_t i = 1; i < std::min(a.size(), b.size()); ++i) sum += 2.0 * a[i] * b[i];
  return sum;
}

void blur_volume(const std::array<std::vector<double>, 3>& weights, Image& image) {
  const auto [nx, ny, nz] = image.grid.size;
  const std::size_t row = static_cast<std::size_t>(nx), slice = row * ny;
  float* values = image.values.data();
#pragma omp parallel
  {
    std::vector<float> buffer;
#pragma omp for schedule(static)
    for (int k = 0; k < nz; ++k) {
      blur_plane(values + k * slice, ny, row, nx, 1, weights[0], buffer);
      blur_plane(values + k * slice, nx, 1, ny, row, weights[1], buffer);
    }
#pragma omp for schedule(static)
    for (int j = 0; j < ny; ++j) {
      blur_plane(values + j * row, nx, 1, nz, slice, weights[2], buffer);
    }
  }
}

}  // namespace

void blur(double blur_mm, Image& image) {
  if (blur_mm > 0.0) blur_volume(weights_of(blur_mm, image.grid.spacing), image);
}

void add_noise_and_blur(double noise_hu, std::uint64_t seed, double blur_mm, Image& image) {
  // White noise goes in before the blur, stronger by what the blur takes away.
  const std::array<std::vector<double>, 3> weights = weights_of(blur_mm, image.grid.spacing);
  if (noise_hu > 0.0) add_white_noise(noise_hu / noise_gain(weights), seed, image.values);
  blur(blur_mm, image);
}

void add_textured_noise(double noise_hu, std::uint64_t seed, double texture_mm, Image& image) {
  if (noise_hu <= 0.0) return;
  const auto fine = weights_of(texture_mm, image.grid.spacing);
  const auto coarse = weights_of(2.0 * texture_mm, image.grid.spacing);
  // Sum of squares of the difference of the two kernels in the plane.
  const auto in_plane = [](const auto& a, const auto& b) {
    return product(a[0], b[0]) * product(a[1], b[1]);
  };
  const double gain =
      std::sqrt(in_plane(fine, fine) + in_plane(coarse, coarse) - 2.0 * in_plane(fine, coarse));
  const int nx = image.grid.size[0], ny = image.grid.size[1], nz = image.grid.size[2];
  const std::size_t row = static_cast<std::size_t>(nx), slice = row * static_cast<std::size_t>(ny);
#pragma omp parallel
  {
    std::vector<float> narrow(slice), wide(slice), buffer;
#pragma omp for schedule(static)
    for (int k = 0; k < nz; ++k) {
      const std::size_t first = static_cast<std::size_t>(k) * slice;
      for (std::size_t i = 0; i < slice; ++i) {
        narrow[i] = static_cast<float>(noise_hu / gain * normal_number(seed, first + i));
      }
      wide = narrow;
      blur_plane(narrow.data(), ny, row, nx, 1, fine[0], buffer);
      blur_plane(narrow.data(), nx, 1, ny, row, fine[1], buffer);
      blur_plane(wide.data(), ny, row, nx, 1, coarse[0], buffer);
      blur_plane(wide.data(), nx, 1, ny, row, coarse[1], buffer);
      for (std::size_t i = 0; i < slice; ++i) image.values[first + i] += narrow[i] - wide[i];
    }
  }
}

}  // namespace wireplan::preprocess
