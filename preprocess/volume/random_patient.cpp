#include "preprocess/volume/random_patient.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "preprocess/volume/random_anatomy.h"

namespace wireplan::preprocess {
namespace {

/// Room for what is drawn, and the shares that kPatientFeatures tells.
DrawnScan draw_scan(Draws& draws, std::vector<std::string>& features) {
  DrawnScan scan;
  // Kernel and slice: soft to medium reconstructions (assumed).
  const std::array<double, 13> slices = {0.5,  0.625, 0.75, 1.0, 1.0, 1.0, 1.25,
                                         1.25, 1.5,   2.0,  3.0, 4.0, 5.0};
  scan.slice_mm = slices[static_cast<std::size_t>(draws.index(static_cast<int>(slices.size())))];
  scan.spacing_mm = std::round(100.0 * draws.between(0.6, 0.9)) / 100.0;
  const bool noisy = draws.chance(0.5);
  scan.noise_hu = noisy ? draws.between(24.0, 40.0) : draws.between(8.0, 24.0);
  scan.blur_mm = draws.between(0.4, 0.8);
  scan.texture_mm = draws.between(0.5, 0.9);
  const bool little = draws.chance(0.3);
  scan.contrast_hu = little ? draws.between(100.0, 200.0) : draws.between(200.0, 450.0);
  scan.fall = draws.between(0.0, 0.35);
  scan.veins = draws.chance(0.7);
  scan.organs = draws.chance(0.6);
  if (scan.slice_mm >= 2.5) features.emplace_back("thick slices");
  if (noisy) features.emplace_back("noise");
  if (little) features.emplace_back("little contrast");
  if (scan.veins) features.emplace_back("veins");
  if (scan.organs) features.emplace_back("organs");
  return scan;
}

double length_of(const Centerline& axis) { return axis.arc_length(axis.arc_length.size() - 1); }

Eigen::Index index_at(const Centerline& axis, double fraction) {
  return static_cast<Eigen::Index>(
      std::lround(fraction * static_cast<double>(axis.points.cols() - 1)));
}

Eigen::Index nearest_index(const Centerline& axis, const Vec3& p) {
  Eigen::Index nearest = 0;
  (axis.points.colwise() - p).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

/// The axes one after the other, each left where it comes nearest to the next.
Centerline join_axes(const std::vector<Centerline>& axes, Eigen::Index from, Eigen::Index to) {
  std::vector<Vec3> points;
  std::vector<double> radius;
  Eigen::Index begin = from;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    Eigen::Index end = to, next = 0;
    if (a + 1 < axes.size()) {
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index j = 0; j < axes[a + 1].points.cols(); ++j) {
        const Eigen::Index i = nearest_index(axes[a], axes[a + 1].points.col(j));
        const double gap = (axes[a].points.col(i) - axes[a + 1].points.col(j)).norm();
        if (gap < least) {
          least = gap;
          end = i;
          next = j;
        }
      }
    }
    for (Eigen::Index i = begin;; i += end > begin ? 1 : -1) {
      const Vec3 p = axes[a].points.col(i);
      if (points.empty() || (points.back() - p).norm() > 1e-6) {
        points.push_back(p);
        radius.push_back(axes[a].radius(i));
      }
      if (i == end) break;
    }
    begin = next;
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  Centerline line{Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count), {}};
  for (Eigen::Index i = 0; i < count; ++i) {
    line.points.col(i) = points[static_cast<std::size_t>(i)];
    line.radius(i) = radius[static_cast<std::size_t>(i)];
  }
  line.arc_length = arc_length_of(line.points);
  return line;
}

std::vector<Centerline> axes_of(const PhantomSpec& spec, const std::vector<std::string>& names) {
  std::vector<Centerline> axes;
  for (const std::string& name : names) axes.push_back(phantom_axis(tube_named(spec, name)));
  return axes;
}

/// Between the drawn places, before a breath moves anything.
Centerline drawn_way(const DrawnAnatomy& body, const PhantomSpec& spec) {
  const std::vector<Centerline> axes = axes_of(spec, body.way);
  return join_axes(axes, index_at(axes.front(), body.access_at),
                   index_at(axes.back(), body.target_at));
}

/// How far a point lies outside of a lumen [mm]; negative inside.
double outside(const Centerline& lumen, const Vec3& p) {
  return ((lumen.points.colwise() - p).colwise().norm().transpose() - lumen.radius).minCoeff();
}

/// Whether arteries of the way touch elsewhere than where one leaves the other, or one touches
/// itself: their lumens would be one there, and the way through that as true as the drawn one.
bool touches_itself(DrawnAnatomy& body) {
  constexpr double kApart = 0.25;  // mm between lumens: less is no wall
  std::vector<Centerline> way;
  for (const std::string& name : body.way) way.push_back(phantom_axis(body.tube(name)));
  for (const Centerline& axis : way) {
    for (Eigen::Index j = 0; j < axis.points.cols(); ++j) {
      for (Eigen::Index i = 0; i < j; ++i) {
        const double both = axis.radius(i) + axis.radius(j);
        if (axis.arc_length(j) - axis.arc_length(i) < 4.0 * both) break;
        if ((axis.points.col(i) - axis.points.col(j)).norm() < both + kApart) return true;
      }
    }
  }
  for (const Centerline& parent : way) {
    for (const Centerline& child : way) {
      if (&parent == &child || outside(child, parent.points.col(0)) < 0.0) continue;
      // What leaves the parent's lumen is clear of it soon.
      bool clear = outside(parent, child.points.col(0)) > 0.0;
      double left_at = 0.0;
      for (Eigen::Index j = 0; j < child.points.cols(); ++j) {
        const double away = outside(parent, child.points.col(j)), radius = child.radius(j);
        if (!clear && away < 0.0) left_at = child.arc_length(j);
        clear = clear || child.arc_length(j) - left_at > 3.0 * (radius + 1.0);
        if (clear && away < radius + kApart) return true;
      }
    }
  }
  return false;
}

void add_narrow_place(Draws& draws, const DrawnScan& scan, DrawnAnatomy& body) {
  // In an artery along z where slices are thick, and not so thin that they would cut it in two.
  std::vector<std::string> places;
  for (const std::string& name : body.way) {
    const bool loops = std::any_of(body.loops.begin(), body.loops.end(),
                                   [&](const DrawnLoop& one) { return one.tube == name; });
    const bool lies = loops || name.find("renal") != std::string::npos;
    if (name != "aorta" && (!lies || scan.slice_mm <= 1.25)) places.push_back(name);
  }
  if (places.empty()) return;
  PhantomTube& tube =
      body.tube(places[static_cast<std::size_t>(draws.index(static_cast<int>(places.size())))]);
  const double radius = tube.radius.minCoeff();
  const double least = std::max({1.2, 1.4 * scan.spacing_mm, 0.55 * scan.slice_mm});
  const double share = std::max(draws.between(0.4, 0.7), least / radius);
  if (share > 0.8) return;
  const bool first = tube.name == body.way.front(), last = tube.name == body.way.back();
  const double at = first  ? draws.between(0.3, 0.6) * body.access_at
                    : last ? draws.between(0.5, 0.75) * body.target_at
                           : draws.between(0.3, 0.7);
  add_stenosis(tube, at, draws.between(5.0, 12.0), share);
  body.features.emplace_back("stenosis");
}

DrawnAnatomy draw_body(bool abdomen, const DrawnScan& scan, Draws& draws) {
  DrawnAnatomy body = abdomen ? draw_abdomen(draws, scan) : draw_arch(draws, scan);
  const auto resample_all = [&] {
    for (PhantomTube& tube : body.tubes) {
      tube = with_points_every(tube, tube.kind == PhantomTubeKind::kArtery ? 2.5 : 5.0);
    }
  };
  resample_all();
  bend_all(body, draws);
  for (const DrawnLoop& loop : body.loops) {
    add_kissing_loop(body.tube(loop.tube), loop.side, loop.gap);
  }
  if (draws.chance(0.35)) add_narrow_place(draws, scan, body);
  resample_all();
  press_aside(body);
  return body;
}

/// HU along every vessel: of arteries the contrast falls from the height of the access to that of
/// the target; of veins with contrast a share of that.
void add_contrast(const DrawnScan& scan, const DrawnAnatomy& body, double z_access, double z_target,
                  PhantomSpec& spec) {
  for (std::size_t t = 0; t < spec.tubes.size(); ++t) {
    PhantomTube& tube = spec.tubes[t];
    const bool artery = tube.kind == PhantomTubeKind::kArtery;
    const double level = artery ? 1.0 : body.level[t];
    if (level == 0.0) continue;
    tube.hu_along.resize(tube.points.cols());
    for (Eigen::Index i = 0; i < tube.points.cols(); ++i) {
      const double way =
          std::clamp((tube.points(2, i) - z_access) / (z_target - z_access), 0.0, 1.0);
      tube.hu_along(i) = level * (kBloodHu + scan.contrast_hu * (1.0 - scan.fall * way));
    }
    tube.hu = tube.hu_along.mean();
  }
}

void add_plaques(Draws& draws, const std::vector<std::string>& arteries, const Vec3& access,
                 const Vec3& target, PhantomSpec& spec) {
  const int count = 3 + draws.index(8);
  for (int k = 0; k < count; ++k) {
    const PhantomTube& tube = tube_named(
        spec, arteries[static_cast<std::size_t>(draws.index(static_cast<int>(arteries.size())))]);
    PhantomCalcium calcium{.tube = tube.name,
                           .at = draws.between(0.08, 0.92),
                           .angle_deg = draws.between(-180.0, 180.0),
                           .length_mm = draws.between(3.0, 12.0),
                           .width_deg = draws.between(35.0, 100.0),
                           .thickness_mm = draws.between(0.7, 2.2),
                           .hu = draws.between(500.0, 1300.0)};
    const Centerline axis = phantom_axis(tube);
    const double arc = calcium.at * length_of(axis);
    double radius = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < axis.points.cols(); ++i) {
      if (std::abs(axis.arc_length(i) - arc) > 0.5 * calcium.length_mm + 4.0) continue;
      radius = std::min(radius, axis.radius(i));
    }
    calcium.thickness_mm = std::min(calcium.thickness_mm, 0.4 * radius);
    // Neither where somebody clicks nor opposite another, which would close the lumen.
    const Vec3 place = axis.points.col(index_at(axis, calcium.at));
    const double near = 0.5 * calcium.length_mm + 6.0;
    bool taken = (place - access).norm() < near || (place - target).norm() < near;
    for (const PhantomCalcium& other : spec.calcium) {
      const double apart = std::abs(other.at - calcium.at) * length_of(axis);
      taken = taken || (other.tube == calcium.tube &&
                        apart < 0.5 * (other.length_mm + calcium.length_mm) + 2.0);
    }
    if (!taken) spec.calcium.push_back(calcium);
  }
}

void add_struts(Draws& draws, const std::vector<std::string>& arteries, PhantomSpec& spec) {
  const std::string& name =
      arteries[static_cast<std::size_t>(draws.index(static_cast<int>(arteries.size())))];
  const PhantomTube& tube = tube_named(spec, name);
  const Centerline axis = phantom_axis(tube);
  const double share = std::min(draws.between(25.0, 60.0) / length_of(axis), 0.6);
  const double from = draws.between(0.15, 0.85 - share);
  const double radius = axis.radius.mean();
  spec.stents.push_back({.tube = name,
                         .from = from,
                         .to = from + share,
                         .strut_mm = draws.between(0.2, 0.45),
                         .pitch_mm = std::max(3.0, draws.between(0.6, 1.2) * radius),
                         .amplitude_mm = draws.between(0.2, 0.4) * radius,
                         .crowns = 5 + draws.index(4),
                         .hu = draws.between(1500.0, 3000.0)});
}

/// The box round the way with what lies up to `aside` beside it.
Grid crop(const DrawnScan& scan, const Centerline& way, double aside, double beyond) {
  const auto radius = way.radius.transpose().replicate(3, 1).array();
  const Vec3 margin(aside, aside, beyond - way.radius.minCoeff());
  const Vec3 low = (way.points.array() - radius).rowwise().minCoeff().matrix() - margin;
  const Vec3 high = (way.points.array() + radius).rowwise().maxCoeff().matrix() + margin;
  Grid grid;
  grid.spacing = {scan.spacing_mm, scan.spacing_mm, scan.slice_mm};
  for (int axis = 0; axis < 3; ++axis) {
    grid.origin(axis) = std::round(100.0 * low(axis)) / 100.0;
    grid.size[axis] = 1 + static_cast<int>((high(axis) - low(axis)) / grid.spacing(axis));
  }
  return grid;
}

/// As much of the body as a volume of modest size holds.
Grid draw_grid(const DrawnScan& scan, const Centerline& way, Draws& draws) {
  constexpr double kMostVoxels = 1e7;
  const double beyond = scan.slice_mm > 0.8 ? draws.between(10.0, 18.0) : 7.0;
  double aside = draws.between(20.0, 38.0);
  Grid grid = crop(scan, way, aside, beyond);
  while (static_cast<double>(grid.voxels()) > kMostVoxels && aside > 12.0) {
    aside -= 2.0;
    grid = crop(scan, way, aside, beyond);
  }
  return grid;
}

/// Between two slices where the way runs along z, away from its ends.
std::optional<PhantomBreath> draw_breath(const Centerline& way, Draws& draws) {
  std::vector<Eigen::Index> places;
  const double whole = length_of(way);
  for (Eigen::Index i = 4; i + 4 < way.points.cols(); ++i) {
    if (way.arc_length(i) < 15.0 || way.arc_length(i) > whole - 15.0) continue;
    const Vec3 along = (way.points.col(i + 4) - way.points.col(i - 4)).normalized();
    if (std::abs(along.z()) > 0.7) places.push_back(i);
  }
  const double share = draws.between(0.0, 1.0), angle = draws.between(0.0, 2.0 * kPi);
  const double asked = draws.between(1.0, 4.0);
  if (places.empty()) return std::nullopt;
  const Eigen::Index i =
      places[static_cast<std::size_t>(share * static_cast<double>(places.size()))];
  const double z = way.points(2, i);
  // The lumens on either side overlap.
  double radius = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < way.points.cols(); ++k) {
    if (std::abs(way.points(2, k) - z) < 3.0) radius = std::min(radius, way.radius(k));
  }
  const double shift = std::min(asked, 0.9 * radius);
  return PhantomBreath{.above_z_mm = z,
                       .shift_mm = {shift * std::cos(angle), shift * std::sin(angle), 0.0}};
}

/// In the slice next to the place, off the axis there by up to half the radius and 4 mm.
ClickedPoint click(const std::string& name, const Centerline& axis, Eigen::Index at,
                   const Grid& grid, Draws& draws) {
  const double k = std::round((axis.points(2, at) - grid.origin.z()) / grid.spacing.z());
  const double z = grid.origin.z() + k * grid.spacing.z();
  Eigen::Index nearest = at;
  for (Eigen::Index i = std::max<Eigen::Index>(at - 10, 0);
       i <= std::min<Eigen::Index>(at + 10, axis.points.cols() - 1); ++i) {
    if (std::abs(axis.points(2, i) - z) < std::abs(axis.points(2, nearest) - z)) nearest = i;
  }
  const double off = std::abs(axis.points(2, nearest) - z), radius = axis.radius(nearest);
  const double room = std::sqrt(std::max(0.36 * radius * radius - off * off, 0.0));
  const double aside = std::min({draws.between(0.0, 0.5) * radius, 4.0, room});
  const double angle = draws.between(0.0, 2.0 * kPi);
  const Vec3 p = axis.points.col(nearest);
  const auto rounded = [](double x) { return std::round(10.0 * x) / 10.0; };
  return {name,
          {rounded(p.x() + aside * std::cos(angle)), rounded(p.y() + aside * std::sin(angle)), z}};
}

}  // namespace

RandomPatient draw_patient(std::uint64_t seed) {
  Draws draws(seed);
  RandomPatient patient;
  const bool abdomen = draws.chance(0.65);
  patient.anatomy = abdomen ? "abdomen" : "arch";
  const DrawnScan scan = draw_scan(draws, patient.features);
  DrawnAnatomy body;
  do {
    body = draw_body(abdomen, scan, draws);
  } while (touches_itself(body));

  PhantomSpec& spec = patient.spec;
  spec.body_center = body.body_center;
  spec.body_semi_axes = body.body_semi_axes;
  spec.organs = body.organs;
  spec.vertebrae = body.vertebrae;
  spec.tubes = body.tubes;
  spec.blur_mm = scan.blur_mm;
  spec.noise_hu = scan.noise_hu;
  spec.noise_texture_mm = scan.texture_mm;
  spec.seed = seed;
  spec.supersampling = scan.slice_mm > 1.5 ? 3 : 2;

  const Centerline way = drawn_way(body, spec);
  const Vec3 start = way.points.col(0), end = way.points.col(way.points.cols() - 1);
  add_contrast(scan, body, start.z(), end.z(), spec);
  spec.grid = draw_grid(scan, way, draws);
  if (draws.chance(0.6)) add_plaques(draws, body.way, start, end, spec);
  if (draws.chance(0.2)) add_struts(draws, body.stentable, spec);
  if (draws.chance(0.24)) spec.breath = draw_breath(way, draws);

  const std::vector<Centerline> axes = axes_of(spec, body.way);
  patient.access = click(body.access_name, axes.front(), index_at(axes.front(), body.access_at),
                         spec.grid, draws);
  patient.target =
      click(body.target_name, axes.back(), index_at(axes.back(), body.target_at), spec.grid, draws);
  for (ClickedPoint* clicked : {&patient.access, &patient.target}) {
    clicked->point = moved_by_breath(spec, clicked->point);
  }
  patient.way = body.way;
  patient.access_contrast_hu = scan.contrast_hu;
  patient.target_contrast_hu = scan.contrast_hu * (1.0 - scan.fall);
  patient.features.insert(patient.features.end(), body.features.begin(), body.features.end());
  if (!spec.calcium.empty()) patient.features.emplace_back("calcium");
  if (!spec.stents.empty()) patient.features.emplace_back("stent");
  if (spec.breath) patient.features.emplace_back("breath");
  return patient;
}

Centerline true_way(const RandomPatient& patient) {
  std::vector<Centerline> axes = axes_of(patient.spec, patient.way);
  for (Centerline& axis : axes) {
    for (Eigen::Index i = 0; i < axis.points.cols(); ++i) {
      axis.points.col(i) = moved_by_breath(patient.spec, axis.points.col(i));
    }
  }
  return join_axes(axes, nearest_index(axes.front(), patient.access.point),
                   nearest_index(axes.back(), patient.target.point));
}

}  // namespace wireplan::preprocess
