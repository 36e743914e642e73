#include "preprocess/volume/voxels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <utility>

namespace wireplan::preprocess {
namespace {

/// e^-t I_n(t) for 0, 1, ..., last, but for a factor: from far beyond, where it is nothing,
/// downward by I_n-1 = I_n+1 + 2 n / t I_n (Abramowitz and Stegun 9.6.26, 9.12).
std::vector<double> bessel_downward(double t, int last) {
  constexpr double kLarge = 1e200;
  std::vector<double> values(static_cast<std::size_t>(last) + 1);
  double above = 0.0, here = 1e-300;
  for (int n = 2 * last + 20; n >= 0; --n) {
    if (n <= last) values[static_cast<std::size_t>(n)] = here;
    const double below = above + 2.0 * n / t * here;
    above = here;
    here = below;
    if (here < kLarge) continue;
    above /= kLarge;
    here /= kLarge;
    for (double& value : values) value /= kLarge;
  }
  return values;
}

/// Weights of the discrete Gaussian of variance t [voxels^2] for 0, 1, ..., radius: e^-t I_n(t),
/// whose variance is t also where a sampled Gaussian would miss it (Lindeberg 1990).
std::vector<double> gaussian_weights(double t, int radius) {
  constexpr double kMostOfLibrary = 600.0;  // I_0 is beyond all numbers from 713 on
  std::vector<double> weights;
  if (t > kMostOfLibrary) weights = bessel_downward(t, radius);
  double sum = 0.0;
  for (int n = 0; n <= radius; ++n) {
    if (t <= kMostOfLibrary) weights.push_back(std::exp(-t) * std::cyl_bessel_i(n, t));
    sum += (n == 0 ? 1.0 : 2.0) * weights[static_cast<std::size_t>(n)];
  }
  for (double& weight : weights) {
    weight /= sum;
  }
  return weights;
}

std::vector<double> gaussian_weights(const Grid& grid, double sigma, int axis) {
  const double spacing = grid.spacing[axis];
  return gaussian_weights(std::pow(sigma / spacing, 2), smoothing_radius(sigma, spacing));
}

/// Weighted sum along one axis of the voxels up to weights.size() - 1 steps away.
void convolve_along(const Grid& grid, int axis, const std::vector<double>& weights,
                    std::vector<float>& values) {
  const int nx = grid.size[0], last = grid.size[axis] - 1;
  const int radius = static_cast<int>(weights.size()) - 1;
  std::vector<float> result(values.size());
#pragma omp parallel
  {
    std::vector<float> padded(static_cast<std::size_t>(nx + 2 * radius));
    std::vector<double> row(static_cast<std::size_t>(nx));
#pragma omp for schedule(static)
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        // a row of the result comes from whole rows: shifted ones along i, else neighbours
        if (axis == 0) {
          for (int i = -radius; i < nx + radius; ++i) {
            padded[static_cast<std::size_t>(i + radius)] =
                values[grid.index(std::clamp(i, 0, last), j, k)];
          }
        }
        const auto source = [&](int n) -> const float* {
          return axis == 0   ? padded.data() + radius + n
                 : axis == 1 ? values.data() + grid.index(0, std::clamp(j + n, 0, last), k)
                             : values.data() + grid.index(0, j, std::clamp(k + n, 0, last));
        };
        std::fill(row.begin(), row.end(), 0.0);
        for (int n = -radius; n <= radius; ++n) {
          const float* from = source(n);
          const double weight = weights[static_cast<std::size_t>(std::abs(n))];
          for (std::size_t i = 0; i < row.size(); ++i) {
            row[i] += weight * static_cast<double>(from[i]);
          }
        }
        float* to = result.data() + grid.index(0, j, k);
        std::transform(row.begin(), row.end(), to, [](double v) { return static_cast<float>(v); });
      }
    }
  }
  values.swap(result);
}

/// Squared distances along rows: of each voxel to the nearest one of its row that is 0.
void measure_rows(const Grid& grid, std::vector<float>& squared) {
  const std::ptrdiff_t nx = grid.size[0], all = std::ssize(squared);
  const double h = grid.spacing[0];
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t start = 0; start < all; start += nx) {
    float* row = squared.data() + start;
    std::ptrdiff_t before = -1;  // the last one that is 0
    for (std::ptrdiff_t n = 0; n < nx; ++n) {
      if (row[n] != 0.0F) continue;
      // Up to the middle the one before is nearer, from there on this one.
      for (std::ptrdiff_t m = before + 1; m < n; ++m) {
        const double way =
            h * static_cast<double>(before < 0 ? n - m : std::min(m - before, n - m));
        row[m] = static_cast<float>(way * way);
      }
      before = n;
    }
    for (std::ptrdiff_t m = before + 1; before >= 0 && m < nx; ++m) {
      const double way = h * static_cast<double>(m - before);
      row[m] = static_cast<float>(way * way);
    }
  }
}

/// Lower envelope along one line: squared[n] becomes the least of squared[m] + (h (n - m))^2.
class Envelope {
 public:
  void apply(std::vector<double>& squared, double h) {
    result_.resize(squared.size());
    // What is 0 stays so, and nothing beyond it counts.
    for (std::size_t begin = 0, end = 0; begin < squared.size(); begin = end) {
      for (end = begin + 1; end < squared.size() && squared[end] != 0.0;) ++end;
      if (end > begin + 1 || squared[begin] != 0.0) {
        apply_between(squared, begin, std::min(end + 1, squared.size()), h);
      }
    }
  }

 private:
  /// The same of a part of the line, in which only the first and the last may be 0.
  void apply_between(std::vector<double>& squared, std::size_t begin, std::size_t end, double h) {
    apexes_.clear();
    starts_.clear();
    for (std::size_t n = begin; n < end; ++n) {
      if (!std::isfinite(squared[n])) {
        continue;
      }
      double start = -std::numeric_limits<double>::infinity();
      while (!apexes_.empty()) {
        // where this parabola falls below the last of the envelope
        const double m = static_cast<double>(apexes_.back()), x = static_cast<double>(n);
        start = ((squared[n] - squared[apexes_.back()]) / (h * h) + x * x - m * m) / (2 * (x - m));
        if (start > starts_.back()) {
          break;
        }
        apexes_.pop_back();
        starts_.pop_back();
        start = -std::numeric_limits<double>::infinity();
      }
      apexes_.push_back(n);
      starts_.push_back(start);
    }
    if (apexes_.empty()) {
      return;
    }
    std::size_t piece = 0;
    for (std::size_t n = begin; n < end; ++n) {
      while (piece + 1 < apexes_.size() && starts_[piece + 1] <= static_cast<double>(n)) {
        ++piece;
      }
      const double way = h * (static_cast<double>(n) - static_cast<double>(apexes_[piece]));
      result_[n] = squared[apexes_[piece]] + way * way;
    }
    std::copy(result_.begin() + static_cast<std::ptrdiff_t>(begin),
              result_.begin() + static_cast<std::ptrdiff_t>(end),
              squared.begin() + static_cast<std::ptrdiff_t>(begin));
  }

  std::vector<std::size_t> apexes_;  // of the parabolas in the envelope
  std::vector<double> starts_;       // from where on each of them is the lowest
  std::vector<double> result_;
};

}  // namespace

std::optional<Voxel> nearest_voxel(const Grid& grid, const Vec3& point) {
  const Vec3 rounded = grid.ijk_from_lps(point).array().round();
  Voxel voxel;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(rounded[axis] >= 0.0 && rounded[axis] < grid.size[axis])) {
      return std::nullopt;
    }
    voxel[axis] = static_cast<int>(rounded[axis]);
  }
  return voxel;
}

bool on_border(const Grid& grid, const Voxel& v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (v[axis] == 0 || v[axis] == grid.size[axis] - 1) {
      return true;
    }
  }
  return false;
}

Box grown(Box box, const Voxel& margin, const Grid& grid) {
  for (int axis = 0; axis < 3; ++axis) {
    box.first[axis] = std::max(0, box.first[axis] - margin[axis]);
    box.last[axis] = std::min(grid.size[axis] - 1, box.last[axis] + margin[axis]);
  }
  return box;
}

Box grown(const Box& box, double margin_mm, const Grid& grid) {
  Voxel margin;
  for (int axis = 0; axis < 3; ++axis) {
    margin[axis] = static_cast<int>(std::ceil(margin_mm / grid.spacing[axis]));
  }
  return grown(box, margin, grid);
}

Box united(Box a, const Box& b) {
  for (int axis = 0; axis < 3; ++axis) {
    a.first[axis] = std::min(a.first[axis], b.first[axis]);
    a.last[axis] = std::max(a.last[axis], b.last[axis]);
  }
  return a;
}

Box bounding_box(const Grid& grid, const Labels& labels, Box box) {
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] != 0) {
      const Voxel v = voxel_at(grid, n);
      box = united(box, {v, v});
    }
  }
  return box;
}

Grid cropped(const Grid& grid, const Box& box) {
  Grid crop = grid;
  for (int axis = 0; axis < 3; ++axis) {
    crop.size[axis] = box.last[axis] - box.first[axis] + 1;
  }
  crop.origin = grid.lps_from_ijk(Vec3(box.first[0], box.first[1], box.first[2]));
  return crop;
}

std::vector<std::size_t> voxels_in_ball(const Grid& grid, const Vec3& point, double radius) {
  std::vector<std::size_t> found;
  const std::optional<Voxel> center = nearest_voxel(grid, point);
  if (!center) {
    return found;
  }
  const auto collect = [&](const Box& box, const auto& is_near) {
    for_each_row(grid, box, [&](std::size_t start) {
      for (int i = 0; i <= box.last[0] - box.first[0]; ++i) {
        const std::size_t n = start + static_cast<std::size_t>(i);
        if (is_near(n)) found.push_back(n);
      }
    });
  };
  const Box box = grown({*center, *center}, radius, grid);
  collect(box, [&](std::size_t n) { return (center_of(grid, n) - point).norm() <= radius; });
  if (!found.empty()) return found;
  const Vec3 place = grid.ijk_from_lps(point);
  collect(grown(box, Voxel{1, 1, 1}, grid), [&](std::size_t n) {
    const Voxel v = voxel_at(grid, n);
    const Vec3 beyond = (place - Vec3(v[0], v[1], v[2])).cwiseAbs().array() - 0.5;
    return beyond.cwiseMax(0.0).cwiseProduct(grid.spacing).norm() <= radius;
  });
  return found;
}

std::vector<std::size_t> neighbourhood(const Grid& grid, const Voxel& v, int reach) {
  const Box box = grown({v, v}, {reach, reach, reach}, grid);
  std::vector<std::size_t> all;
  for_each_row(grid, box, [&](std::size_t start) {
    for (int i = 0; i <= box.last[0] - box.first[0]; ++i) {
      all.push_back(start + static_cast<std::size_t>(i));
    }
  });
  return all;
}

std::size_t count(const Labels& labels) {
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), 1));
}

NearestLabel nearest_label(const Grid& grid, const Labels& labels, const Vec3& point) {
  NearestLabel nearest;
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] == 0) continue;
    const double here = (center_of(grid, n) - point).norm();
    if (here < nearest.distance) nearest = {n, here};
  }
  const std::optional<Voxel> own = nearest_voxel(grid, point);
  if (own && labels[index_of(grid, *own)] != 0) nearest = {index_of(grid, *own), 0.0};
  return nearest;
}

std::vector<BackgroundRun> find_background(const Grid& grid, const Labels& labels, Joined joined) {
  const int nx = grid.size[0], ny = grid.size[1], nz = grid.size[2];
  const std::size_t reach = joined == Joined::kByCorners ? 1 : 0;
  std::vector<BackgroundRun> runs(1);
  const auto first_of_part = [&](std::size_t run) {
    while (runs[run].part != run) run = runs[run].part = runs[runs[run].part].part;
    return run;
  };
  const auto unite = [&](std::size_t a, std::size_t b) {
    const auto [low, high] = std::minmax({first_of_part(a), first_of_part(b)});
    runs[high].part = low;
  };
  std::vector<std::size_t> row_start;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      const std::size_t begin = runs.size(), row = grid.index(0, j, k);
      row_start.push_back(begin);
      const bool at_border = j == 0 || k == 0 || j == ny - 1 || k == nz - 1;
      for (int i = 0; i < nx; ++i) {
        const std::size_t first = row + static_cast<std::size_t>(i);
        if (labels[first] != 0) continue;
        const bool from_border = at_border || i == 0;
        while (i + 1 < nx && labels[row + static_cast<std::size_t>(i) + 1] == 0) ++i;
        runs.push_back({first, row + static_cast<std::size_t>(i) + 1 - first, runs.size()});
        if (from_border || i == nx - 1) unite(0, runs.size() - 1);
      }
      const std::size_t end = runs.size();
      for (const auto& [dj, dk] : {std::pair(-1, 0), {0, -1}, {-1, -1}, {1, -1}}) {
        if (j + dj < 0 || j + dj >= ny || k + dk < 0 ||
            (joined == Joined::kByFaces && dj * dk != 0)) {
          continue;
        }
        const std::size_t other = static_cast<std::size_t>(j + dj) +
                                  static_cast<std::size_t>(ny) * static_cast<std::size_t>(k + dk);
        const std::size_t back = row - grid.index(0, j + dj, k + dk);
        std::size_t m = row_start[other];
        const std::size_t last = row_start[other + 1];
        for (std::size_t n = begin; n < end; ++n) {
          const std::size_t from = runs[n].first, to = from + runs[n].count;
          while (m < last && runs[m].first + runs[m].count + back + reach <= from) ++m;
          for (std::size_t q = m; q < last && runs[q].first + back < to + reach; ++q) unite(n, q);
        }
      }
    }
  }
  for (std::size_t n = 0; n < runs.size(); ++n) runs[n].part = first_of_part(n);
  return runs;
}

void fill_cavities(const Grid& grid, Labels& labels, double largest) {
  const std::vector<BackgroundRun> runs = find_background(grid, labels, Joined::kByFaces);
  std::vector<double> voxels(runs.size(), 0.0);  // of each part
  for (const BackgroundRun& run : runs) voxels[run.part] += static_cast<double>(run.count);
  for (const BackgroundRun& run : runs) {
    if (run.part == 0 || voxels[run.part] > largest) continue;
    std::fill_n(labels.begin() + static_cast<std::ptrdiff_t>(run.first), run.count, 1);
  }
}

std::vector<float> distance_to(std::uint8_t label, const Grid& grid, const Labels& labels) {
  std::vector<float> distance(labels.size());
  std::transform(labels.begin(), labels.end(), distance.begin(), [&](std::uint8_t l) {
    return l == label ? 0.0F : std::numeric_limits<float>::infinity();
  });
  measure_rows(grid, distance);
  const std::array<std::size_t, 3> stride = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  for (int axis = 1; axis < 3; ++axis) {
    const int a = 0, b = axis == 2 ? 1 : 2;  // the other two axes
#pragma omp parallel
    {
      Envelope envelope;
      std::vector<double> line(static_cast<std::size_t>(grid.size[axis]));
#pragma omp for schedule(static)
      for (int v = 0; v < grid.size[b]; ++v) {
        for (int u = 0; u < grid.size[a]; ++u) {
          float* first = distance.data() + static_cast<std::size_t>(u) * stride[a] +
                         static_cast<std::size_t>(v) * stride[b];
          double most = 0.0;
          for (std::size_t n = 0; n < line.size(); ++n) {
            line[n] = static_cast<double>(first[n * stride[axis]]);
            most = std::max(most, line[n]);
          }
          if (most == 0.0) continue;  // as it is
          envelope.apply(line, grid.spacing[axis]);
          for (std::size_t n = 0; n < line.size(); ++n) {
            first[n * stride[axis]] = static_cast<float>(line[n]);
          }
        }
      }
    }
  }
  std::transform(distance.begin(), distance.end(), distance.begin(),
                 [](float squared) { return std::sqrt(squared); });
  return distance;
}

int smoothing_radius(double sigma, double spacing) {
  return sigma > 0.0 ? 1 + static_cast<int>(std::ceil(4.0 * sigma / spacing)) : 0;
}

void smooth(const Grid& grid, double sigma, std::vector<float>& values) {
  for (int axis = 0; axis < 3; ++axis) {
    convolve_along(grid, axis, gaussian_weights(grid, sigma, axis), values);
  }
}

double smoothed_noise(const Grid& grid, double sigma) {
  double factor = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> weights = gaussian_weights(grid, sigma, axis);
    double squares = weights[0] * weights[0];
    for (std::size_t n = 1; n < weights.size(); ++n) {
      squares += 2.0 * weights[n] * weights[n];
    }
    factor *= std::sqrt(squares);
  }
  return factor;
}

}  // namespace wireplan::preprocess
