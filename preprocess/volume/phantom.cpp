#include "preprocess/volume/phantom.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "preprocess/volume/phantom_noise.h"
#include "preprocess/volume/phantom_shapes.h"

namespace wireplan::preprocess {
namespace {

struct Layer {
  std::variant<EllipseShape, TubeShape, PlaqueShape, StentShape> shape;
  double hu = 0.0;
  bool lumen = false;   // of an artery
  bool varies = false;  // a tube whose HU change along it, in place of `hu`
};

double clearance(const Layer& layer, const Vec3& p) {
  return std::visit([&](const auto& shape) { return clearance(shape, p); }, layer.shape);
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
    if (tube.wall_mm > 0.0) layers.push_back({make_tube(tube, tube.wall_mm), spec.tissue_hu});
    lumens.push_back({make_tube(tube, 0.0), tube.hu, kind == PhantomTubeKind::kArtery,
                      tube.hu_along.size() > 0});
  }
  layers.insert(layers.end(), lumens.begin(), lumens.end());
}

/// From below to above.
std::vector<Layer> build_layers(const PhantomSpec& spec) {
  std::vector<Layer> layers;
  add_body(spec, layers);
  for (const PhantomEllipsoid& organ : spec.organs) add_ellipsoid(organ, layers);
  add_tubes(spec, PhantomTubeKind::kTissue, layers);
  for (const PhantomVertebra& v : spec.vertebrae) add_vertebra(v, spec.tissue_hu, layers);
  add_tubes(spec, PhantomTubeKind::kVein, layers);
  add_tubes(spec, PhantomTubeKind::kThrombus, layers);
  add_tubes(spec, PhantomTubeKind::kArtery, layers);
  for (const PhantomCalcium& calcium : spec.calcium) {
    layers.push_back({make_plaque(calcium, tube_named(spec, calcium.tube)), calcium.hu});
  }
  for (const PhantomStent& stent : spec.stents) {
    layers.push_back({make_stent(stent, tube_named(spec, stent.tube)), stent.hu});
  }
  return layers;
}

// ---- Painting -----------------------------------------------------------------------------------

/// The layer without what cannot touch the ball: of a tube, the far segments.
Layer restrict_to_ball(const Layer& layer, const Vec3& center, double radius) {
  const TubeShape* tube = std::get_if<TubeShape>(&layer.shape);
  if (!tube) return layer;
  TubeShape near{.segments = {}, .inverse_slope = tube->inverse_slope};
  for (const TubeSegment& s : tube->segments) {
    if (-find_foot(s, center).depth * tube->inverse_slope <= radius) near.segments.push_back(s);
  }
  return {std::move(near), layer.hu, layer.lumen, layer.varies};
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
  /// `places` is the spec's grid, moved against what is painted.
  Painter(const PhantomSpec& spec, const Grid& places, Phantom& phantom)
      : spec_(spec), grid_(places), phantom_(phantom) {}

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
        float* values = phantom_.image.values.data() + row;
        for (int i = low(0); i < high(0); ++i) {
          *values++ = static_cast<float>(hu_of(top, i, j, k));
        }
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
          phantom_.image.values[voxel] = static_cast<float>(
              uniform ? hu_of(top, i, j, k)
                      : average(restrict_to_ball(layers, center, reach), i, j, k));
          phantom_.lumen.labels[voxel] = label_of(top);
        }
      }
    }
  }

  static std::uint8_t label_of(const Layer* layer) { return layer && layer->lumen ? 1 : 0; }
  double hu_of(const Layer* layer, double i, double j, double k) const {
    if (!layer) return spec_.air_hu;
    if (!layer->varies) return layer->hu;
    return hu_at(std::get<TubeShape>(layer->shape), grid_.lps_from_ijk(Vec3(i, j, k)));
  }

  /// Mean over a voxel, from the middles of its parts.
  double average(const std::vector<Layer>& layers, int i, int j, int k) const {
    const int n = spec_.supersampling;
    const auto part = [&](int voxel, int sample) { return voxel + (sample + 0.5) / n - 0.5; };
    double sum = 0.0;
    for (int c = 0; c < n; ++c) {
      for (int b = 0; b < n; ++b) {
        for (int a = 0; a < n; ++a) {
          const Vec3 ijk(part(i, a), part(j, b), part(k, c));
          const Layer* top = find_top(layers, grid_.lps_from_ijk(ijk));
          sum += hu_of(top, ijk.x(), ijk.y(), ijk.z());
        }
      }
    }
    return sum / (n * n * n);
  }

  const PhantomSpec& spec_;
  const Grid& grid_;
  Phantom& phantom_;
};

/// Whether a breath has moved what lies at this height.
bool is_moved(const PhantomSpec& spec, double z) {
  return spec.breath && z > spec.breath->above_z_mm;
}

/// Slices that are painted at once: a breath lies between two of them, not within one.
std::vector<int> slab_limits(const PhantomSpec& spec) {
  constexpr int kSlab = 8;  // slices
  const auto moved = [&](int k) {
    return is_moved(spec, spec.grid.lps_from_ijk(Vec3(0, 0, k)).z());
  };
  std::vector<int> limits;
  for (int k = 0; k < spec.grid.size[2]; ++k) {
    if (k % kSlab == 0 || moved(k) != moved(k - 1)) limits.push_back(k);
  }
  limits.push_back(spec.grid.size[2]);
  return limits;
}

void paint_layers(const PhantomSpec& spec, Phantom& phantom) {
  const std::vector<Layer> layers = build_layers(spec);
  const auto& size = spec.grid.size;
  const std::vector<int> limits = slab_limits(spec);
  const int slabs = static_cast<int>(limits.size()) - 1;
#pragma omp parallel for schedule(dynamic)
  for (int slab = 0; slab < slabs; ++slab) {
    const int begin = limits[slab], end = limits[slab + 1];
    Grid places = spec.grid;
    if (is_moved(spec, spec.grid.lps_from_ijk(Vec3(0, 0, begin)).z())) {
      places.origin -= spec.breath->shift_mm;
    }
    Painter(spec, places, phantom).paint({0, 0, begin}, {size[0], size[1], end}, layers);
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

/// Points of a line, from `begin` to before `end`, that are seen where they are or shifted.
struct SeenRun {
  Eigen::Index begin = 0, end = 0;
  bool shifted = false;
};

/// Runs of the line's points that a volume with a breath shows, in their order along the line. A
/// shift up shows what lies just below the breath's height twice, one down hides what lies above.
std::vector<SeenRun> find_seen(const PhantomBreath& breath, const Eigen::Matrix3Xd& points) {
  std::vector<SeenRun> runs;
  for (const bool shifted : {false, true}) {
    bool open = false;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const double z = points(2, i) + (shifted ? breath.shift_mm.z() : 0.0);
      const bool seen = (z > breath.above_z_mm) == shifted;
      if (seen && !open) runs.push_back({i, i, shifted});
      open = seen;
      if (seen) runs.back().end = i + 1;
    }
  }
  // What is seen twice and leads nowhere else counts once.
  std::vector<SeenRun> kept;
  for (const SeenRun& run : runs) {
    const bool within = std::any_of(runs.begin(), runs.end(), [&](const SeenRun& other) {
      if (&other == &run || other.begin > run.begin || other.end < run.end) return false;
      return other.begin < run.begin || other.end > run.end || run.shifted;
    });
    if (!within) kept.push_back(run);
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const SeenRun& a, const SeenRun& b) { return a.begin < b.begin; });
  return kept;
}

/// The line as the volume shows it.
Centerline move_line(const PhantomSpec& spec, const Centerline& line) {
  if (!spec.breath) return line;
  std::vector<Vec3> points;
  std::vector<double> radius;
  for (const SeenRun& run : find_seen(*spec.breath, line.points)) {
    const Vec3 shift = run.shifted ? spec.breath->shift_mm : Vec3(Vec3::Zero());
    for (Eigen::Index i = run.begin; i < run.end; ++i) {
      points.emplace_back(line.points.col(i) + shift);
      radius.push_back(line.radius(i));
    }
  }
  Centerline moved{
      .points = Eigen::Matrix3Xd(3, static_cast<Eigen::Index>(points.size())),
      .radius = Eigen::VectorXd::Map(radius.data(), static_cast<Eigen::Index>(radius.size())),
      .arc_length = {}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    moved.points.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  moved.arc_length = arc_length_of(moved.points);
  return moved;
}

}  // namespace

const PhantomTube& tube_named(const PhantomSpec& spec, const std::string& name) {
  const auto tube = std::find_if(spec.tubes.begin(), spec.tubes.end(),
                                 [&](const PhantomTube& one) { return one.name == name; });
  expects(tube != spec.tubes.end());
  return *tube;
}

Vec3 moved_by_breath(const PhantomSpec& spec, const Vec3& point) {
  return is_moved(spec, point.z()) ? Vec3(point + spec.breath->shift_mm) : point;
}

double thinnest_part(const PhantomVertebra& vertebra) {
  const Vec3& body = vertebra.semi_axes;
  return std::min({0.18 * body.x(), body.y(), 0.4 * body.z()});
}

Phantom make_phantom(const PhantomSpec& spec) {
  const Grid& grid = spec.grid;
  expects(grid.voxels() > 0 && (grid.spacing.array() > 0.0).all());
  expects(spec.supersampling >= 1 && spec.blur_mm >= 0.0 && spec.noise_hu >= 0.0 &&
          spec.noise_texture_mm >= 0.0);
  Phantom phantom;
  phantom.image = {grid, std::vector<float>(grid.voxels())};
  phantom.lumen = {grid, std::vector<std::uint8_t>(grid.voxels())};
  paint_layers(spec, phantom);

  if (spec.noise_texture_mm > 0.0) {
    blur(spec.blur_mm, phantom.image);
    add_textured_noise(spec.noise_hu, spec.seed, spec.noise_texture_mm, phantom.image);
  } else {
    add_noise_and_blur(spec.noise_hu, spec.seed, spec.blur_mm, phantom.image);
  }

  for (const PhantomTube& tube : spec.tubes) {
    if (tube.kind != PhantomTubeKind::kArtery) continue;
    phantom.names.push_back(tube.name);
    phantom.centerlines.push_back(clip_to_volume(move_line(spec, phantom_axis(tube)), grid));
  }
  return phantom;
}

}  // namespace wireplan::preprocess
