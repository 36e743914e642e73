#include "pipeline/bench/segmented_patient.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "pipeline/bench/bench_report.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/centerline/path_place.h"
#include "preprocess/centerline/section_width.h"
#include "preprocess/cores.h"
#include "preprocess/surface/surface.h"
#include "preprocess/volume/phantom_lumen.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using preprocess::Grid;
using preprocess::Labels;
using preprocess::Mask;
using preprocess::SegmentStatistics;

constexpr double kNearWay = 3.0;  // true radii
constexpr double kRadiusTolerance = 0.05;
constexpr double kWideEnough = 2.0;  // voxels in radius, for a radius to be asked for

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double p95_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, values.size() * 95 / 100)];
}

bool is_near_way(const Centerline& way, const Vec3& p) {
  for (Eigen::Index i = 0; i < way.points.cols(); ++i) {
    const double reach = kNearWay * way.radius(i);
    if ((way.points.col(i) - p).squaredNorm() <= reach * reach) return true;
  }
  return false;
}

/// 2 |A and B| / (|A| + |B|) over the voxels that `counts` takes.
template <typename Counts>
double overlap(const Labels& a, const Labels& b, Counts counts) {
  double both = 0.0, sum = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    if ((a[n] | b[n]) == 0 || !counts(n)) continue;
    both += 2.0 * (a[n] & b[n]);
    sum += a[n] + b[n];
  }
  return sum > 0.0 ? both / sum : 0.0;
}

/// Places that the warnings of stage segment name.
std::vector<Vec3> told_places(const SegmentStatistics& statistics) {
  std::vector<Vec3> places;
  for (const preprocess::Leak& leak : statistics.search.leaks) places.push_back(leak.place);
  for (const preprocess::Leak& part : statistics.doubtful) places.push_back(part.place);
  for (const preprocess::Leak& branch : statistics.branches) places.push_back(branch.place);
  for (const preprocess::Touch& touch : statistics.touches) places.push_back(touch.place);
  for (const preprocess::Loop& loop : statistics.loops.left) places.push_back(loop.place);
  for (const preprocess::WayDoubt& doubt : statistics.way_doubts) places.push_back(doubt.place);
  return places;
}

int count_warnings(const SegmentStatistics& statistics, int handles) {
  constexpr std::size_t kLeaksTold = 5;  // as the stage tells them
  return static_cast<int>(std::min(statistics.search.leaks.size(), kLeaksTold) +
                          statistics.doubtful.size() + statistics.touches.size() +
                          statistics.way_doubts.size()) +
         (statistics.branches.empty() ? 0 : 1) + (statistics.loops.left.empty() ? 0 : 1) +
         (statistics.touches_border ? 1 : 0) + (handles > 0 ? 1 : 0);
}

/// What the mask holds that neither is nor is next to truth, corners included: all of it, and that
/// of pieces to which no told place comes near, over the truth.
void measure_outside(const Grid& grid, const Labels& mask, const Labels& truth,
                     const std::vector<Vec3>& told, PatientRow& row) {
  Labels outside = mask;
  std::size_t true_voxels = 0;
  for (std::size_t n = 0; n < truth.size(); ++n) {
    if (truth[n] == 0) continue;
    ++true_voxels;
    outside[n] = 0;
    preprocess::for_each_neighbour(grid, n, [&](std::size_t m, const auto&) { outside[m] = 0; });
  }
  constexpr double kNamed = 10.0;  // mm from the piece: a person who looks there sees it
  std::size_t all = 0, silent = 0;
  for (std::size_t start = 0; start < outside.size(); ++start) {
    if (outside[start] == 0) continue;
    std::vector<std::size_t> piece = {start};
    outside[start] = 0;
    bool named = false;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const Vec3 p = preprocess::center_of(grid, piece[next]);
      named = named || std::any_of(told.begin(), told.end(),
                                   [&](const Vec3& q) { return (p - q).norm() < kNamed; });
      preprocess::for_each_neighbour(grid, piece[next], [&](std::size_t m, const auto&) {
        if (outside[m] != 0) piece.push_back(m);
        outside[m] = 0;
      });
    }
    all += piece.size();
    silent += named ? 0 : piece.size();
  }
  const double whole = static_cast<double>(std::max<std::size_t>(true_voxels, 1));
  row.outside = static_cast<double>(all) / whole;
  row.outside_silent = static_cast<double>(silent) / whole;
}

/// Of the vertices near the way and away from where the volume cuts the vessel.
void measure_surface(const Surface& surface, const Grid& grid, const Centerline& way,
                     const preprocess::PhantomLumen& truth, PatientRow& row) {
  constexpr Eigen::Index kMost = 6000;  // vertices looked at
  const Eigen::Index step = std::max<Eigen::Index>(1, surface.vertices.cols() / kMost);
  std::vector<double> errors;
  for (Eigen::Index v = 0; v < surface.vertices.cols(); v += step) {
    const Vec3 p = surface.vertices.col(v), ijk = grid.ijk_from_lps(p);
    bool capped = false;
    for (int axis = 0; axis < 3; ++axis) {
      capped = capped || ijk[axis] < 2.0 || ijk[axis] > grid.size[axis] - 3.0;
    }
    if (!capped && is_near_way(way, p)) errors.push_back(std::abs(truth.distance(p)));
  }
  if (errors.empty()) return;
  row.surface_mean_mm = mean_of(errors);
  row.surface_p95_mm = p95_of(errors);
}

/// How far from the way a line may be: the radius there, or that of a wider artery whose lumen is
/// one with it there, as at its mouth, since lines cut corners.
Centerline widened(Centerline way) {
  const Centerline narrow = way;
  for (Eigen::Index i = 0; i < way.points.cols(); ++i) {
    for (Eigen::Index j = 0; j < way.points.cols(); ++j) {
      const double apart = (narrow.points.col(i) - narrow.points.col(j)).norm();
      if (apart > narrow.radius(i) + narrow.radius(j)) continue;
      way.radius(i) = std::max(way.radius(i), narrow.radius(j));
    }
  }
  return way;
}

/// The point of a line so far along it.
Vec3 point_at(const Centerline& line, double arc) {
  const Eigen::Index last = line.points.cols() - 1;
  const double* const begin = line.arc_length.data();
  const auto after = std::clamp<Eigen::Index>(
      std::upper_bound(begin, begin + last + 1, begin[0] + arc) - begin, 1, last);
  const double step = begin[after] - begin[after - 1];
  const double t =
      step > 0.0 ? std::clamp((begin[0] + arc - begin[after - 1]) / step, 0.0, 1.0) : 0.0;
  return (1.0 - t) * line.points.col(after - 1) + t * line.points.col(after);
}

/// Whether all of the straight step from a to b lies in the lumen.
bool is_open(const Vec3& a, const Vec3& b, const InLumen& in_lumen) {
  constexpr double kEvery = 0.1;  // mm
  const int steps = static_cast<int>(std::ceil((b - a).norm() / kEvery));
  for (int k = 0; k <= steps; ++k) {
    const double t = steps > 0 ? static_cast<double>(k) / steps : 0.0;
    if (!in_lumen((1.0 - t) * a + t * b)) return false;
  }
  return true;
}

constexpr double kSameRadius = 0.01;  // of the radius

/// Whether the true lumen at point i of the way is as deep as the way's radius there: mouths of
/// branches and places within a wider vessel are deeper, places by plaque less deep.
bool is_single(const Centerline& way, Eigen::Index i, const preprocess::PhantomLumen& truth) {
  const double radius = way.radius(i);
  return std::abs(-truth.distance(way.points.col(i)) - radius) <= kSameRadius * radius;
}

/// Whether its wall lies at that radius all round, across the way.
bool is_closed(const Centerline& way, Eigen::Index i, const preprocess::PhantomLumen& truth) {
  constexpr int kDirections = 24;
  const double radius = way.radius(i);
  const Eigen::Index last = way.points.cols() - 1;
  const Vec3 along =
      (way.points.col(std::min(i + 1, last)) - way.points.col(std::max<Eigen::Index>(i - 1, 0)))
          .normalized();
  const Vec3 u = along.unitOrthogonal(), w = along.cross(u);
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2.0 * kPi * k / kDirections;
    const Vec3 wall = way.points.col(i) + radius * (std::cos(angle) * u + std::sin(angle) * w);
    if (std::abs(truth.distance(wall)) > kSameRadius * radius) return false;
  }
  return true;
}

/// The line that was found against the true way. A radius counts where the lumen there is a single
/// round tube, so neither at mouths of branches nor by plaque, and where it is over two voxels.
void measure_line(const Surface& surface, const Centerline& line, const Centerline& way,
                  double voxel_mm, const preprocess::PhantomLumen& truth, PatientRow& row) {
  std::vector<double> off;
  const Eigen::VectorXd section = 0.5 * preprocess::section_diameters(surface, line);
  int asked = 0, within = 0, ball_within = 0, closed = 0, closed_within = 0;
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    const Vec3 p = line.points.col(i);
    off.push_back(preprocess::find_place(p, way).from_axis);
    Eigen::Index nearest = 0;
    (way.points.colwise() - p).colwise().squaredNorm().minCoeff(&nearest);
    const double radius = way.radius(nearest);
    if (radius < kWideEnough * voxel_mm || !is_single(way, nearest, truth)) continue;
    ++asked;
    const auto is_near = [&](double r) {
      return std::abs(r - radius) <= kRadiusTolerance * radius;
    };
    within += is_near(section(i)) ? 1 : 0;
    ball_within += is_near(line.radius(i)) ? 1 : 0;
    if (!is_closed(way, nearest, truth)) continue;
    ++closed;
    closed_within += is_near(section(i)) ? 1 : 0;
  }
  row.axis_mean_mm = mean_of(off);
  row.axis_p95_mm = p95_of(off);
  if (asked == 0) return;
  row.radius_within = static_cast<double>(within) / asked;
  row.ball_within = static_cast<double>(ball_within) / asked;
  if (closed > 0) row.closed_within = static_cast<double>(closed_within) / closed;
}

/// The steps on which a patient can end. Returns the surface's centerline.
std::optional<Centerline> find_line(const preprocess::Image& image, const Vec3& access,
                                    const Vec3& target, preprocess::Segmentation& found,
                                    Surface& surface, PatientRow& row) {
  const double start = process_cpu_seconds();
  try {
    found = preprocess::segment(image, {.seeds = {access}, .target = target});
  } catch (const Error& error) {
    row.outcome = PatientOutcome::kRefused;
    row.message = error.what();
  }
  row.segment_s = process_cpu_seconds() - start;
  if (row.outcome != PatientOutcome::kDone) return std::nullopt;
  try {
    surface = preprocess::surface_from_image(image, found.mask, {});
    row.handles = (2 - preprocess::check_surface(surface).euler_number) / 2;
    row.warnings = count_warnings(found.statistics, *row.handles);
  } catch (const Error& error) {
    row.outcome = PatientOutcome::kNoSurface;
    row.message = error.what();
    return std::nullopt;
  }
  try {
    std::vector<Vec3> guide;
    if (!found.statistics.ways.empty()) {
      for (const Vec3& p : found.statistics.ways.back().points.colwise()) guide.push_back(p);
    }
    return preprocess::find_centerline(surface, access, target, {.guide = guide});
  } catch (const Error& error) {
    row.outcome = PatientOutcome::kNoCenterline;
    row.message = error.what();
    return std::nullopt;
  }
}

}  // namespace

bool is_way_right(const Centerline& line, const Centerline& way, const InLumen& in_lumen) {
  const Centerline wide = widened(way);
  preprocess::PathPlace before{.radius = wide.radius(0)};
  const auto skips = [](double arc, double radius) { return arc > 2.5 * radius + 5.0; };
  for (const Vec3& p : line.points.colwise()) {
    const preprocess::PathPlace place = preprocess::find_place(p, wide);
    if (place.from_axis > place.radius && !is_open(p, point_at(wide, place.arc), in_lumen)) {
      return false;
    }
    if (skips(place.arc - before.arc, std::max(place.radius, before.radius))) return false;
    before = place;
  }
  return !skips(wide.arc_length(wide.arc_length.size() - 1) - before.arc, before.radius);
}

PatientRow segment_patient(const preprocess::RandomPatient& patient) {
  PatientRow row;
  row.patient = std::to_string(patient.spec.seed);
  row.features = patient.anatomy;
  for (const std::string& feature : patient.features) row.features += ", " + feature;
  row.slice_mm = patient.spec.grid.spacing.z();
  row.spacing_mm = patient.spec.grid.spacing.x();
  row.access_contrast_hu = patient.access_contrast_hu;
  row.target_contrast_hu = patient.target_contrast_hu;
  row.noise_hu = patient.spec.noise_hu;
  const preprocess::Phantom phantom = preprocess::make_phantom(patient.spec);
  const Centerline way = preprocess::true_way(patient);
  const preprocess::PhantomLumen truth(patient.spec);

  const double start = process_cpu_seconds();
  preprocess::Segmentation found;
  Surface surface;
  const std::optional<Centerline> line =
      find_line(phantom.image, patient.access.point, patient.target.point, found, surface, row);
  row.all_s = process_cpu_seconds() - start;
  if (row.outcome == PatientOutcome::kRefused) return row;

  const Grid& grid = phantom.image.grid;
  const auto everywhere = [](std::size_t) { return true; };
  row.dice = overlap(found.mask.labels, phantom.lumen.labels, everywhere);
  row.dice_way = overlap(found.mask.labels, phantom.lumen.labels, [&](std::size_t n) {
    return is_near_way(way, preprocess::center_of(grid, n));
  });
  measure_outside(grid, found.mask.labels, phantom.lumen.labels, told_places(found.statistics),
                  row);
  if (row.outcome == PatientOutcome::kNoSurface) return row;
  measure_surface(surface, grid, way, truth, row);
  if (!line) return row;
  measure_line(surface, *line, way, std::cbrt(grid.spacing.prod()), truth, row);
  preprocess::PhantomSpec bare = patient.spec;
  bare.calcium.clear();  // a line that goes round plaque goes down no other artery
  const preprocess::PhantomLumen arteries(bare);
  row.way_right =
      is_way_right(*line, way, [&](const Vec3& p) { return arteries.distance(p) < 0.0; });
  return row;
}

std::vector<LabelledCase> find_labelled_cases(const fs::path& data) {
  std::vector<LabelledCase> cases;
  const fs::path dissection = data / "ct-aorta-dissection-labelled";
  if (fs::exists(dissection / "ct_cropped.nii.gz")) {
    LabelledCase one{.name = "ct-aorta-dissection-labelled",
                     .volume = dissection / "ct_cropped.nii.gz",
                     .lumen = dissection / "aorta_true_lumen.nii.gz",
                     .others = {},
                     .access = {-5.7, -149.2, 552.2},
                     .target = {16.8, -170.2, 780.2}};
    for (const char* artery :
         {"brachiocephalic_trunk", "common_carotid_artery_left", "subclavian_artery_left",
          "celiac_trunk", "superior_mesenteric_artery"}) {
      one.others.push_back(dissection / (std::string(artery) + ".nii.gz"));
    }
    cases.push_back(std::move(one));
  }
  return cases;
}

PatientRow segment_labelled(const LabelledCase& given) {
  PatientRow row;
  row.patient = given.name;
  row.features = "real";
  try {
    const preprocess::Image image = preprocess::read_image(given.volume);
    const Mask lumen = preprocess::read_mask(given.lumen);
    Labels allowed = lumen.labels;
    for (const fs::path& other : given.others) {
      const Mask more = preprocess::read_mask(other);
      for (std::size_t n = 0; n < allowed.size(); ++n) allowed[n] |= more.labels.at(n);
    }
    row.slice_mm = image.grid.spacing.z();
    row.spacing_mm = image.grid.spacing.x();
    const double start = process_cpu_seconds();
    preprocess::Segmentation found;
    Surface surface;
    find_line(image, given.access, given.target, found, surface, row);
    row.all_s = process_cpu_seconds() - start;
    if (row.outcome == PatientOutcome::kRefused) return row;
    row.dice = overlap(found.mask.labels, lumen.labels, [](std::size_t) { return true; });
    measure_outside(image.grid, found.mask.labels, allowed, told_places(found.statistics), row);
  } catch (const Error& error) {  // a file of it
    row.outcome = PatientOutcome::kRefused;
    row.message = error.what();
  }
  return row;
}

}  // namespace wireplan::pipeline
