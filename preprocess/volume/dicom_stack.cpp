#include "preprocess/volume/dicom_stack.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {
namespace {

/// Tells what is wrong with the places [mm, sorted] of slices along their normal, and between which
/// two; nothing where they form a regular stack. Scanners round positions, some to one decimal, so
/// a slice may lie a tenth of the step from its place, or as far as two such roundings.
void find_uneven(const std::vector<double>& positions, Stack& stack) {
  constexpr double kSamePlace = 0.01, kRounding = 0.1;   // [mm]
  constexpr double kOfStep = 0.1, kMostRounding = 0.25;  // of the step
  const std::size_t gaps = positions.size() - 1;
  std::vector<double> sizes(gaps);
  for (std::size_t k = 0; k < gaps; ++k) sizes[k] = positions[k + 1] - positions[k];
  const auto same = static_cast<std::size_t>(
      std::count_if(sizes.begin(), sizes.end(), [&](double size) { return size <= kSamePlace; }));
  stack.places = gaps + 1 - same;
  const double step = (positions.back() - positions.front()) / static_cast<double>(gaps);
  const double most_off = std::max(kOfStep * step, std::min(kRounding, kMostRounding * step));
  bool even = step > 0.0;
  for (std::size_t k = 0; k <= gaps; ++k) {
    const double place = positions.front() + static_cast<double>(k) * step;
    even = even && std::abs(positions[k] - place) <= most_off;
  }
  if (even) return;

  const double usual = median(sizes);
  std::ostringstream text;
  if (2 * same >= gaps) {
    text << "images lie at the same place (" << positions.size()
         << " images, places: " << stack.places
         << "; contrast tracking, or several phases), expected one at each; keep one phase "
            "or "
            "reconstruction in the folder";
    stack.problem = text.str();
    return;
  }

  // Name the gap that differs most from the usual one.
  const auto differs = [&](double size) { return std::abs(size - usual); };
  const auto odd = std::max_element(sizes.begin(), sizes.end(),
                                    [&](double a, double b) { return differs(a) < differs(b); });
  const std::size_t k = static_cast<std::size_t>(odd - sizes.begin());
  const auto count = std::count_if(sizes.begin(), sizes.end(),
                                   [&](double size) { return differs(size) > kOfStep * usual; });
  text << "uneven slices: the ones at " << positions[k] << " and " << positions[k + 1]
       << " mm along the normal are " << *odd << " mm apart, the others " << usual << " mm";
  if (count > 1) text << " (" << count << " of " << gaps << " gaps differ)";
  if (*odd < 0.5 * usual) {
    text << "; images lie at the same place: keep one phase or reconstruction in the folder";
  } else {
    text << "; export the series again, with all its slices and one spacing, or resample it";
  }
  stack.problem = text.str();
  stack.images = {stack.order[k], stack.order[k + 1]};
}

/// The parts of steps from one image to the next that lie in their plane, less the usual one.
std::vector<Vec3> sidesteps(const std::vector<Vec3>& origins, const Stack& stack) {
  const Mat3& axes = stack.grid.direction;
  std::vector<Vec3> steps;
  for (std::size_t k = 1; k < origins.size(); ++k) {
    Vec3 step = axes.transpose() * (origins[stack.order[k]] - origins[stack.order[k - 1]]);
    step[2] = 0.0;
    steps.push_back(step);
  }
  Vec3 usual = Vec3::Zero();
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    std::vector<double> along;
    for (const Vec3& step : steps) along.push_back(step[axis]);
    usual[axis] = median(std::move(along));
  }
  for (Vec3& step : steps) step -= usual;
  return steps;
}

/// Refuses images off the line from first to last, as where the field of view was moved; told at
/// the one with the widest step. Of a tilted gantry all lie on that line.
void find_shift(const std::vector<Vec3>& origins, double most, Stack& stack) {
  const Vec3& first = origins[stack.order.front()];
  const Vec3 line = (origins[stack.order.back()] - first).normalized();
  double off_line = 0.0;
  for (const Vec3& origin : origins) {
    off_line = std::max(off_line, (origin - first).cross(line).norm());
  }
  if (off_line <= most) return;
  const std::vector<Vec3> steps = sidesteps(origins, stack);
  const auto widest = std::max_element(
      steps.begin(), steps.end(), [](const Vec3& a, const Vec3& b) { return a.norm() < b.norm(); });
  const double shift = widest->norm();
  stack.images = {stack.order[static_cast<std::size_t>(widest - steps.begin()) + 1]};
  stack.problem = "this slice is shifted by " + one_decimal(shift) +
                  " mm in its plane against the one before, and slices lie up to " +
                  one_decimal(off_line) +
                  " mm off the line from first to last (a field of view that was moved), expected "
                  "at most half a pixel; export the series again with one field of view, or "
                  "resample it";
}

}  // namespace

Stack stack(const std::vector<Vec3>& origins, const Grid& first) {
  Stack stack{.order = std::vector<std::size_t>(origins.size()), .grid = first};
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
  find_uneven(positions, stack);

  Grid& grid = stack.grid;
  grid.origin = origins[stack.order.front()];
  const Vec3 rise = origins[stack.order.back()] - grid.origin;
  const double along = normal.dot(rise), drift = (rise - normal * along).norm();
  // Half a pixel: beyond, the next one is nearer to where the value belongs.
  const double most = 0.5 * grid.spacing.head<2>().minCoeff();
  if (stack.problem.empty()) find_shift(origins, most, stack);
  if (stack.problem.empty() && drift > most) {
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
