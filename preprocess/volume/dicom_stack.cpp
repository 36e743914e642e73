#include "preprocess/volume/dicom_stack.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {
namespace {

/// What is wrong with the places [mm, sorted] of slices along their normal; empty where they form a
/// regular stack. Scanners round positions, so a slice may lie a tenth of the step from its place.
std::string find_uneven(const std::vector<double>& positions) {
  const std::size_t gaps = positions.size() - 1;
  const double step = (positions.back() - positions.front()) / static_cast<double>(gaps);
  bool even = step > 0.0;
  for (std::size_t k = 0; k <= gaps; ++k) {
    const double place = positions.front() + static_cast<double>(k) * step;
    even = even && std::abs(positions[k] - place) <= 0.1 * step;
  }
  if (even) return {};

  std::vector<double> sizes(gaps);
  for (std::size_t k = 0; k < gaps; ++k) sizes[k] = positions[k + 1] - positions[k];
  std::vector<double> sorted = sizes;
  std::nth_element(sorted.begin(), sorted.begin() + gaps / 2, sorted.end());
  const double usual = sorted[gaps / 2];
  std::ostringstream text;
  constexpr double kSamePlace = 0.01;  // [mm]
  const auto same =
      std::count_if(sizes.begin(), sizes.end(), [&](double size) { return size <= kSamePlace; });
  if (2 * static_cast<std::size_t>(same) >= gaps) {
    text << "images lie at the same place (" << positions.size()
         << " images, places: " << gaps + 1 - static_cast<std::size_t>(same)
         << "; contrast tracking, or several phases), expected one at each; keep one phase "
            "or "
            "reconstruction in the folder";
    return text.str();
  }

  // Name the gap that differs most from the usual one.
  const auto differs = [&](double size) { return std::abs(size - usual); };
  const auto odd = std::max_element(sizes.begin(), sizes.end(),
                                    [&](double a, double b) { return differs(a) < differs(b); });
  const std::size_t k = static_cast<std::size_t>(odd - sizes.begin());
  const auto count = std::count_if(sizes.begin(), sizes.end(),
                                   [&](double size) { return differs(size) > 0.1 * usual; });
  text << "uneven slices: the ones at " << positions[k] << " and " << positions[k + 1]
       << " mm along the normal are " << *odd << " mm apart, the others " << usual << " mm";
  if (count > 1) text << " (" << count << " of " << gaps << " gaps differ)";
  if (*odd < 0.5 * usual) {
    text << "; images lie at the same place: keep one phase or reconstruction in the folder";
  } else {
    text << "; export the series again, with all its slices and one spacing, or resample it";
  }
  return text.str();
}

}  // namespace

Stack stack(const std::vector<Vec3>& origins, const Grid& first) {
  Stack stack{.order = std::vector<std::size_t>(origins.size()), .grid = first, .problem = {}};
  if (origins.size() < 2) {
    stack.problem = "one DICOM slice, expected a series of at least 2";
    return stack;
  }
  const Vec3 normal = first.direction.col(2);
  std::iota(stack.order.begin(), stack.order.end(), std::size_t{0});
  std::stable_sort(stack.order.begin(), stack.order.end(), [&](std::size_t a, std::size_t b) {
    return normal.dot(origins[a]) < normal.dot(origins[b]);
  });
  std::vector<double> positions;
  for (const std::size_t k : stack.order) positions.push_back(normal.dot(origins[k]));
  stack.problem = find_uneven(positions);

  Grid& grid = stack.grid;
  grid.origin = origins[stack.order.front()];
  const Vec3 rise = origins[stack.order.back()] - grid.origin;
  const double along = normal.dot(rise), drift = (rise - normal * along).norm();
  if (stack.problem.empty() && drift > 0.5 * grid.spacing.head<2>().minCoeff()) {
    stack.problem = "the slices are shifted by " + one_decimal(drift) +
                    " mm in their plane from first to last (tilted gantry, " +
                    one_decimal(std::atan2(drift, along) / kRadPerDeg) +
                    " degrees); resample the series to an upright grid";
  }
  grid.size[2] = static_cast<int>(origins.size());
  grid.spacing[2] = along / static_cast<double>(origins.size() - 1);
  return stack;
}

}  // namespace wireplan::preprocess
