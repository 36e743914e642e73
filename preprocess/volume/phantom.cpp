#include "preprocess/volume/phantom.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include "preprocess/volume/phantom_noise.h"

namespace wireplan::preprocess {
namespace {

// ---- Shapes -------------------------------------------------------------------------------------
// Each shape has a clearance: negative inside, zero on its surface, and never changing faster than
// the point moves. So |clearance| > r at the middle of a ball of radius r proves that no surface of
// the shape crosses that ball, which is what makes painting fast.

/// Ellipsoid, or elliptic cylinder along its third axis (`half_height` finite or infinite).
struct Ellipse {
  Vec3 center = Vec3::Zero();
  Mat3 to_unit = Mat3::Identity();  // maps the ellipsoid to the unit ball, the cylinder to r < 1
  double min_axis = 1.0;
  Vec3 along = Vec3::UnitZ();  // direction of the cylinder
  double half_height = std::numeric_limits<double>::infinity();
};

double clearance(const Ellipse& e, const Vec3& p) {
  const Vec3 d = p - e.center;
  return std::max(((e.to_unit * d).norm() - 1.0) * e.min_axis,
                  std::abs(d.dot(e.along)) - e.half_height);
}

/// A piece of a tube: all balls with centre on a segment and linearly changing radius.
struct Segment {
  Vec3 a = Vec3::Zero(), ab = Vec3::Zero();
  double inverse_squared_length = 0.0;
  double radius_a = 0.0, radius_ab = 0.0;  // radius at a, and its change from a to b
  double arc_a = 0.0, length = 0.0;
};

struct Tube {
  std::vector<Segment> segments;
  double inverse_slope = 1.0;  // 1/sqrt(1 + (dr/ds)^2), largest slope: bounds the clearance's
};

/// The point of a tube nearest to another, and how far it lies inside.
struct Foot {
  const Segment* segment = nullptr;
  double t = 0.0;      // along the segment, 0 to 1
  double depth = 0.0;  // below the tube's surface; negative outside                    [mm]
};

Foot find_foot(const Segment& s, const Vec3& p) {
  const double t = std::clamp((p - s.a).dot(s.ab) * s.inverse_squared_length, 0.0, 1.0);
  return {&s, t, s.radius_a + t * s.radius_ab - (p - s.a - t * s.ab).norm()};
}

Foot find_foot(const Tube& tube, const Vec3& p) {
  Foot deepest{nullptr, 0.0, -std::numeric_limits<double>::infinity()};
  for (const Segment& s : tube.segments) {
    const Foot foot = find_foot(s, p);
    if (foot.depth > deepest.depth) deepest = foot;
  }
  return deepest;
}

double clearance(const Tube& tube, const Vec3& p) {
  return -find_foot(tube, p).depth * tube.inverse_slope;
}

/// Unit vector normal to `tangent` from which angles round a tube are counted.
Vec3 reference_direction(const Vec3& tangent) {
  const Vec3 anterior = -Vec3::UnitY() + tangent.y() * tangent;
  if (anterior.norm() > 1e-3) return anterior.normalized();
  return (Vec3::UnitZ() - tangent.z() * tangent).normalized();
}

/// The part of a tube less deep than a thickness that falls from the middle to the rim.
struct Plaque {
  Tube tube;  // the stretch on which it lies
  double arc = 0.0, half_length = 0.0;
  double angle = 0.0, half_width = 0.0;  //                                             [rad]
  double thickness = 0.0;
  double inverse_slope = 1.0;
};

double clearance(const Plaque& plaque, const Vec3& p) {
  const Foot foot = find_foot(plaque.tube, p);
  if (foot.depth < 0.0) return -foot.depth * plaque.inverse_slope;
  // Where p lies along and round the tube, measured from the plaque's middle to its rim.
  const Segment& s = *foot.segment;
  const Vec3 tangent = s.ab.normalized(), anterior = reference_direction(tangent);
  const Vec3 outward = p - s.a - foot.t * s.ab;
  const double angle =
      std::atan2(outward.dot(tangent.cross(anterior)), outward.dot(anterior)) - plaque.angle;
  const double along = (s.arc_a + foot.t * s.length - plaque.arc) / plaque.half_length;
  const double around = std::remainder(angle, 2.0 * kPi) / plaque.half_width;
  // A parabola, cut off beyond the rim so that its slope stays bounded.
  const double thickness = plaque.thickness * std::max(1.0 - along * along - around * around, -1.0);
  return (foot.depth - thickness) * plaque.inverse_slope;
}

struct Layer {
  std::variant<Ellipse, Tube, Plaque> shape;
  double hu = 0.0;
  bool lumen = false;  // of an artery
};

double clearance(const Layer& layer, const Vec3& p) {
  return std::visit([&](const auto& shape) { return clearance(shape, p); }, layer.shape);
}

// ---- From the description to layers -------------------------------------------------------------

Ellipse make_ellipsoid(const Vec3& center, const Vec3& semi_axes, const Mat3& rotation) {
  expects((semi_axes.array() > 0.0).all());
  return {.center = center,
          .to_unit = semi_axes.cwiseInverse().asDiagonal() * rotation.transpose(),
          .min_axis = semi_axes.minCoeff()};
}

Ellipse make_cylinder(const Vec3& center, const Vec3& semi_axes) {
  expects((semi_axes.array() > 0.0).all());
  return {.center = center,
          .to_unit = Vec3(1.0 / semi_axes.x(), 1.0 / semi_axes.y(), 0.0).asDiagonal(),
          .min_axis = semi_axes.head<2>().minCoeff(),
          .half_height = semi_axes.z()};
}

/// A tube round the axis, `margin` wider than it.
Tube make_tube(const Centerline& axis, double margin) {
  Tube tube;
  double steepest = 0.0;
  for (Eigen::Index i = 0; i + 1 < axis.points.cols(); ++i) {
    const Vec3 a = axis.points.col(i), ab = axis.points.col(i + 1) - a;
    const double change = axis.radius(i + 1) - axis.radius(i);
    tube.segments.push_back({.a = a,
                             .ab = ab,
                             .inverse_squared_length = 1.0 / ab.squaredNorm(),
                             .radius_a = axis.radius(i) + margin,
                             .radius_ab = change,
                             .arc_a = axis.arc_length(i),
                             .length = ab.norm()});
    steepest = std::max(steepest, std::abs(change) / ab.norm());
  }
  tube.inverse_slope = 1.0 / std::sqrt(1.0 + steepest * steepest);
  return tube;
}

Plaque make_plaque(const PhantomCalcium& calcium, const Centerline& axis) {
  const Tube whole = make_tube(axis, 0.0);
  const double end = axis.arc_length(axis.arc_length.size() - 1);
  Plaque plaque{.tube = {},
                .arc = calcium.at * end,
                .half_length = 0.5 * calcium.length_mm,
                .angle = calcium.angle_deg * kRadPerDeg,
                .half_width = 0.5 * calcium.width_deg * kRadPerDeg,
                .thickness = calcium.thickness_mm};
  // The stretch reaches past both rims, so that no point of the plaque has its foot at an end.
  double radius = std::numeric_limits<double>::infinity();
  for (const Segment& s : whole.segments) {
    if (std::abs(s.arc_a - plaque.arc) > plaque.half_length + 2.0) continue;
    plaque.tube.segments.push_back(s);
    radius = std::min(radius, s.radius_a);
  }
  expects(plaque.half_length > 0.0 && plaque.half_width > 0.0);
  expects(plaque.thickness > 0.0 && plaque.thickness < 0.5 * radius);
  // Largest slopes of the parabola, along and round the tube, down to its cut-off.
  const double steepness = 2.0 * std::numbers::sqrt2 * plaque.thickness;
  const double along = steepness / plaque.half_length;
  const double around = steepness / (plaque.half_width * (radius - plaque.thickness));
  plaque.inverse_slope = whole.inverse_slope / std::sqrt(1.0 + along * along + around * around);
  return plaque;
}

void add_body(const PhantomSpec& spec, std::vector<Layer>& layers) {
  const double infinite = std::numeric_limits<double>::infinity();
  const auto inset = [&](double depth) {
    const Vec3& outer = spec.body_semi_axes;
    return make_cylinder(spec.body_center, {outer.x() - depth, outer.y() - depth, infinite});
  };
  layers.push_back({inset(0.0), spec.tissue_hu});
  layers.push_back({inset(spec.skin_mm), spec.fat_hu});
  layers.push_back({inset(spec.skin_mm + spec.fat_mm), spec.tissue_hu});
}

void add_ellipsoid(const PhantomEllipsoid& organ, std::vector<Layer>& layers) {
  if (organ.shell_mm > 0.0) {
    layers.push_back(
        {make_ellipsoid(organ.center, organ.semi_axes, organ.rotation), organ.shell_hu});
  }
  const Vec3 inner = organ.semi_axes.array() - organ.shell_mm;
  layers.push_back({make_ellipsoid(organ.center, inner, organ.rotation), organ.hu});
}

void add_vertebra(const PhantomVertebra& v, double canal_hu, std::vector<Layer>& layers) {
  const double width = v.semi_axes.x(), depth = v.semi_axes.y(), height = v.semi_axes.z();
  const Vec3 canal = v.center + Vec3(0.0, depth + 0.45 * width, 0.0);
  const auto bone = [&](const Vec3& center, const Vec3& semi_axes) {
    add_ellipsoid({.name = {},
                   .hu = v.core_hu,
                   .center = center,
                   .semi_axes = semi_axes,
                   .shell_mm = v.shell_mm,
                   .shell_hu = v.shell_hu},
                  layers);
  };
  // Behind the body: processes, then the arch, hollowed by the canal.
  const Vec3 back = canal + Vec3(0.0, 0.5 * width, 0.0);
  bone(back + Vec3(0.0, 0.6 * depth, -0.3 * height), {0.18 * width, depth, 0.6 * height});
  for (const double side : {-1.0, 1.0}) {
    bone(canal + Vec3(side * 1.05 * width, 0.1 * width, 0.0),
         {0.75 * width, 0.2 * width, 0.4 * height});
  }
  layers.push_back({make_cylinder(canal, {0.68 * width, 0.62 * width, 0.7 * height}), v.shell_hu});
  layers.push_back({make_cylinder(canal, {0.46 * width, 0.38 * width, height}), canal_hu});
  // The body.
  const Vec3 inner = v.semi_axes.array() - v.shell_mm;
  layers.push_back({make_cylinder(v.center, v.semi_axes), v.shell_hu});
  layers.push_back({make_cylinder(v.center, inner), v.core_hu});
}

/// All walls of a kind lie under all lumens of that kind, so that branches open into each other.
void add_tubes(const PhantomSpec& spec, PhantomTubeKind kind, std::vector<Layer>& layers) {
  std::vector<Layer> lumens;
  for (const PhantomTube& tube : spec.tubes) {
    if (tube.kind != kind) continue;
    const Centerline axis = phantom_axis(tube);
    if (tube.wall_mm > 0.0) layers.push_back({make_tube(axis, tube.wall_mm), spec.tissue_hu});
    lumens.push_back({make_tube(axis, 0.0), tube.hu, kind == PhantomTubeKind::kArtery});
  }
  layers.insert(layers.end(), lumens.begin(), lumens.end());
}

void add_calcium(const PhantomSpec& spec, std::vector<Layer>& layers) {
  for (const PhantomCalcium& calcium : spec.calcium) {
    const auto tube =
        std::find_if(spec.tubes.begin(), spec.tubes.end(),
                     [&](const PhantomTube& candidate) { return candidate.name == calcium.tube; });
    expects(tube != spec.tubes.end());
    layers.push_back({make_plaque(calcium, phantom_axis(*tube)), calcium.hu});
  }
}

/// From below to above.
std::vector<Layer> build_layers(const PhantomSpec& spec) {
  std::vector<Layer> layers;
  add_body(spec, layers);
  for (const PhantomEllipsoid& organ : spec.organs) add_ellipsoid(organ, layers);
  add_tubes(spec, PhantomTubeKind::kTissue, layers);
  for (const PhantomVertebra& v : spec.vertebrae) add_vertebra(v, spec.tissue_hu, layers);
  add_tubes(spec, PhantomTubeKind::kVein, layers);
  add_tubes(spec, PhantomTubeKind::kArtery, layers);
  add_calcium(spec, layers);
  return layers;
}

// ---- Painting -----------------------------------------------------------------------------------

/// The layer without what cannot touch the ball: of a tube, the far segments.
Layer restrict_to_ball(const Layer& layer, const Vec3& center, double radius) {
  const Tube* tube = std::get_if<Tube>(&layer.shape);
  if (!tube) return layer;
  Tube near{.segments = {}, .inverse_slope = tube->inverse_slope};
  for (const Segment& s : tube->segments) {
    if (-find_foot(s, center).depth * tube->inverse_slope <= radius) near.segments.push_back(s);
  }
  return {std::move(near), layer.hu, layer.lumen};
}

/// The layers that can be seen within the ball, from below to above.
std::vector<Layer> restrict_to_ball(const std::vector<Layer>& layers, const Vec3& center,
                                    double radius) {
  std::vector<Layer> seen;
  for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
    const double gap = clearance(*layer, center);
    if (gap > radius) continue;
    seen.push_back(restrict_to_ball(*layer, center, radius));
    if (gap < -radius) break;  // hides all that lies under it
  }
  std::reverse(seen.begin(), seen.end());
  return seen;
}

/// What is on top at a point; null: air.
const Layer* find_top(const std::vector<Layer>& layers, const Vec3& p) {
  for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
    if (clearance(*layer, p) < 0.0) return &*layer;
  }
  return nullptr;
}

/// True where one thing alone is seen within the ball.
bool is_uniform(const std::vector<Layer>& layers, const Vec3& center, double radius) {
  for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
    const double gap = clearance(*layer, center);
    if (gap < -radius) return true;
    if (gap <= radius) return false;
  }
  return true;
}

class Painter {
 public:
  Painter(const PhantomSpec& spec, Phantom& phantom)
      : spec_(spec), grid_(spec.grid), phantom_(phantom) {}

  /// Paints the voxels from `low` to before `high`, halving the box until it shows one thing alone
  /// or is small.
  void paint(const Eigen::Array3i& low, const Eigen::Array3i& high,
             const std::vector<Layer>& layers) {
    const Eigen::Array3i size = high - low;
    const Vec3 middle = grid_.lps_from_ijk(0.5 * (low + high - 1).cast<double>().matrix());
    const double radius = 0.5 * size.cast<double>().matrix().cwiseProduct(grid_.spacing).norm();
    if (is_uniform(layers, middle, radius)) return fill(low, high, find_top(layers, middle));
    const std::vector<Layer> seen = restrict_to_ball(layers, middle, radius);
    Eigen::Index longest = 0;
    if (size.maxCoeff(&longest) <= kSmallBox) return paint_voxels(low, high, seen);
    Eigen::Array3i low_end = high, high_begin = low;
    low_end(longest) = high_begin(longest) = low(longest) + size(longest) / 2;
    paint(low, low_end, seen);
    paint(high_begin, high, seen);
  }

 private:
  static constexpr int kSmallBox = 4;  // voxels; 6 takes the same time, 8 half as much again

  void fill(const Eigen::Array3i& low, const Eigen::Array3i& high, const Layer* top) {
    for (int k = low(2); k < high(2); ++k) {
      for (int j = low(1); j < high(1); ++j) {
        const std::size_t row = grid_.index(low(0), j, k);
        std::fill_n(phantom_.image.values.begin() + row, high(0) - low(0),
                    static_cast<float>(hu_of(top)));
        std::fill_n(phantom_.lumen.labels.begin() + row, high(0) - low(0), label_of(top));
      }
    }
  }

  void paint_voxels(const Eigen::Array3i& low, const Eigen::Array3i& high,
                    const std::vector<Layer>& layers) {
    const double reach = 0.5 * grid_.spacing.norm();
    for (int k = low(2); k < high(2); ++k) {
      for (int j = low(1); j < high(1); ++j) {
        for (int i = low(0); i < high(0); ++i) {
          const Vec3 center = grid_.lps_from_ijk(Vec3(i, j, k));
          const Layer* top = find_top(layers, center);
          const bool uniform = is_uniform(layers, center, reach);
          const std::size_t voxel = grid_.index(i, j, k);
          phantom_.image.values[voxel] =
              static_cast<float>(uniform ? hu_of(top) : average(layers, i, j, k));
          phantom_.lumen.labels[voxel] = label_of(top);
        }
      }
    }
  }

  static std::uint8_t label_of(const Layer* layer) { return layer && layer->lumen ? 1 : 0; }
  double hu_of(const Layer* layer) const { return layer ? layer->hu : spec_.air_hu; }

  /// Mean over a voxel, from the middles of its parts.
  double average(const std::vector<Layer>& layers, int i, int j, int k) const {
    const int n = spec_.supersampling;
    const auto part = [&](int voxel, int sample) { return voxel + (sample + 0.5) / n - 0.5; };
    double sum = 0.0;
    for (int c = 0; c < n; ++c) {
      for (int b = 0; b < n; ++b) {
        for (int a = 0; a < n; ++a) {
          const Vec3 ijk(part(i, a), part(j, b), part(k, c));
          sum += hu_of(find_top(layers, grid_.lps_from_ijk(ijk)));
        }
      }
    }
    return sum / (n * n * n);
  }

  const PhantomSpec& spec_;
  const Grid& grid_;
  Phantom& phantom_;
};

void paint_layers(const PhantomSpec& spec, Phantom& phantom) {
  const std::vector<Layer> layers = build_layers(spec);
  const auto& size = spec.grid.size;
  constexpr int kSlab = 8;  // slices
  const int slabs = (size[2] + kSlab - 1) / kSlab;
#pragma omp parallel for schedule(dynamic)
  for (int slab = 0; slab < slabs; ++slab) {
    Painter(spec, phantom)
        .paint({0, 0, kSlab * slab}, {size[0], size[1], std::min(kSlab * (slab + 1), size[2])},
               layers);
  }
}

// ---- Truth --------------------------------------------------------------------------------------

bool inside(const Grid& grid, const Vec3& p) {
  const Vec3 ijk = grid.ijk_from_lps(p);
  const Eigen::Array3d last(grid.size[0] - 0.5, grid.size[1] - 0.5, grid.size[2] - 0.5);
  return (ijk.array() > -0.5).all() && (ijk.array() < last).all();
}

/// The longest stretch of the line inside the volume, arc length counted from its beginning.
Centerline clip_to_volume(const Centerline& line, const Grid& grid) {
  Eigen::Index best_begin = 0, best_count = 0, count = 0;
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    count = inside(grid, line.points.col(i)) ? count + 1 : 0;
    if (count > best_count) {
      best_count = count;
      best_begin = i + 1 - count;
    }
  }
  Centerline part{line.points.middleCols(best_begin, best_count),
                  line.radius.segment(best_begin, best_count),
                  line.arc_length.segment(best_begin, best_count)};
  if (best_count > 0) part.arc_length.array() -= line.arc_length(best_begin);
  return part;
}

/// A point between b and c, at u from 0 to 1, of the centripetal Catmull-Rom curve through a, b, c
/// and d, by the pyramid of Barry and Goldman (SIGGRAPH 1988).
Vec3 catmull_rom(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double u) {
  const double t_b = std::sqrt((b - a).norm());
  const double t_c = t_b + std::sqrt((c - b).norm());
  const double t_d = t_c + std::sqrt((d - c).norm());
  const double t = t_b + u * (t_c - t_b);
  const auto mixed = [t](const Vec3& p, const Vec3& q, double t_p, double t_q) -> Vec3 {
    return ((t_q - t) * p + (t - t_p) * q) / (t_q - t_p);
  };
  const Vec3 ab = mixed(a, b, 0.0, t_b), bc = mixed(b, c, t_b, t_c), cd = mixed(c, d, t_c, t_d);
  const Vec3 abc = mixed(ab, bc, 0.0, t_c), bcd = mixed(bc, cd, t_b, t_d);
  return mixed(abc, bcd, t_b, t_c);
}

/// The same line with its points evenly spaced, at most `spacing` apart.
Centerline resample(const Centerline& line, double spacing) {
  const Eigen::Index last = line.points.cols() - 1;
  const double length = line.arc_length(last);
  const auto pieces = static_cast<Eigen::Index>(std::ceil(length / spacing));
  Centerline even{Eigen::Matrix3Xd(3, pieces + 1), Eigen::VectorXd(pieces + 1),
                  Eigen::VectorXd::LinSpaced(pieces + 1, 0.0, length)};
  Eigen::Index i = 0;
  for (Eigen::Index k = 0; k <= pieces; ++k) {
    while (i + 2 <= last && line.arc_length(i + 1) < even.arc_length(k)) ++i;
    const double t =
        (even.arc_length(k) - line.arc_length(i)) / (line.arc_length(i + 1) - line.arc_length(i));
    even.points.col(k) = (1.0 - t) * line.points.col(i) + t * line.points.col(i + 1);
    even.radius(k) = (1.0 - t) * line.radius(i) + t * line.radius(i + 1);
  }
  return even;
}

}  // namespace

double thinnest_part(const PhantomVertebra& vertebra) {
  const Vec3& body = vertebra.semi_axes;
  return std::min({0.18 * body.x(), body.y(), 0.4 * body.z()});
}

Centerline phantom_axis(const PhantomTube& tube) {
  const Eigen::Index controls = tube.points.cols();
  expects(controls >= 2 && tube.radius.size() == controls && (tube.radius.array() > 0.0).all());
  // Beyond either end the polygon goes on straight.
  Eigen::Matrix3Xd polygon(3, controls + 2);
  polygon << 2.0 * tube.points.col(0) - tube.points.col(1), tube.points,
      2.0 * tube.points.col(controls - 1) - tube.points.col(controls - 2);
  // Fine samples with their arc length.
  constexpr Eigen::Index kSamples = 100;  // per span
  const Eigen::Index count = (controls - 1) * kSamples + 1;
  Centerline fine{Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index span = std::min(i / kSamples, controls - 2);
    const double u = static_cast<double>(i - span * kSamples) / static_cast<double>(kSamples);
    expects(polygon.col(span + 1) != polygon.col(span + 2));
    fine.points.col(i) = catmull_rom(polygon.col(span), polygon.col(span + 1),
                                     polygon.col(span + 2), polygon.col(span + 3), u);
    fine.radius(i) = (1.0 - u) * tube.radius(span) + u * tube.radius(span + 1);
    fine.arc_length(i) =
        i == 0 ? 0.0
               : fine.arc_length(i - 1) + (fine.points.col(i) - fine.points.col(i - 1)).norm();
  }
  return resample(fine, 0.5);
}

Phantom make_phantom(const PhantomSpec& spec) {
  const Grid& grid = spec.grid;
  expects(grid.voxels() > 0 && (grid.spacing.array() > 0.0).all());
  expects(spec.supersampling >= 1 && spec.blur_mm >= 0.0 && spec.noise_hu >= 0.0);
  Phantom phantom;
  phantom.image = {grid, std::vector<float>(grid.voxels())};
  phantom.lumen = {grid, std::vector<std::uint8_t>(grid.voxels())};
  paint_layers(spec, phantom);

  add_noise_and_blur(spec.noise_hu, spec.seed, spec.blur_mm, phantom.image);

  for (const PhantomTube& tube : spec.tubes) {
    if (tube.kind != PhantomTubeKind::kArtery) continue;
    phantom.names.push_back(tube.name);
    phantom.centerlines.push_back(clip_to_volume(phantom_axis(tube), grid));
  }
  return phantom;
}

}  // namespace wireplan::preprocess
