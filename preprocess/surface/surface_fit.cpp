#include "preprocess/surface/surface_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "preprocess/surface/vertex_graph.h"
#include "preprocess/surface/wall_profile.h"

namespace wireplan::preprocess {
namespace {

// Distances along the normal, in units: voxels (geometric mean of the spacing) at first, then what
// the edge is found to be blurred over, where that is more.
constexpr double kReach = 1.2;           // the edge is sought this far on either side
constexpr double kStep = 0.2;            // of the search
constexpr double kInside = 1.5;          // the lumen's value is taken here, and a step deeper
constexpr double kNearInside = 0.8;      // and here, the middle of a vessel thinner than that
constexpr double kOutside = 1.2;         // the surroundings' value is the least up to here
constexpr double kSmoothing = 2.0;       // shifts and the values outside are averaged over this far
                                         // along the surface
constexpr double kLevelSmoothing = 2.5;  // and the lumen's value over this
// Over more of it in a noisy image: where the lumen's values stray from their average by more than
// this part of the contrast (median), in proportion.
constexpr double kQuiet = 0.03, kMostOfSmoothing = 1.5;
constexpr double kUnitPerSigma = 1.7;  // of the blur ...
constexpr double kMostUnit = 2.0;      // ... but at most so many voxels
// A step less than this part of the usual one is no edge that a level could be put on.
constexpr double kLeastContrast = 0.35;
// How strongly a vertex without an edge is held where the mask has it, against one with an edge.
constexpr double kHold = 0.15;
constexpr int kRounds = 3;             // the first finds the unit
constexpr double kDeep = 0.8413;       // part of a blurred step one sigma inside of it
constexpr double kForWalls = 0.7;      // of kSmoothing, before and after walls are looked for
constexpr double kAcross = 0.3;        // a wall's normal this near to the slices' plane lies in it
constexpr double kThick = 1.2;         // slices so much thicker than pixels are thick
constexpr double kLikeInSlices = 1.2;  // blur along a normal, of that in slices, that is a Gaussian
// Smoothing rounds the rim of a cap about so deep, however thick the slices are [mm]; chosen.
constexpr double kRim = 1.7;
// Blur moves the half level of a disc by sigma^2/(2 r), but not by more than this part of sigma: in
// one thinner than 3 sigma it lowers the lumen's value, and so the level, as well.
constexpr double kMostMoved = 0.15;
// The wall round a lumen of this contrast [HU] is soft tissue, at least so bright. An image in
// other units has no such contrast, or lies above it.
constexpr double kWallHu = 20.0, kLeastHu = 100.0;
// Who drew a mask voxel by voxel knew the wall as well as this [voxels].
constexpr double kKnownTo = 0.5;
// Where it is further off than that in the median, the edge is sought so far [voxels].
constexpr double kFar = 2.0;
// Fewer vertices with an edge tell nothing of all; chosen.
constexpr double kLeastSeen = 0.25;

/// Values between voxels.
class Interpolated {
 public:
  explicit Interpolated(const Image& image) : image_(image) {
    const double least = image.grid.spacing.minCoeff();
    const double most = image.grid.spacing.maxCoeff(&thick_);
    is_thick_ = most > kThick * least;
    thickness_ = is_thick_ ? (most * most - least * least) / 12.0 : 0.0;
  }

  /// Linear; in a volume of slices thicker than their pixels cubic (Keys 1981, a = -1/2), which
  /// keeps second moments: linear would blur by a sixth of the squared thickness on average, twice
  /// what the slice itself does. Beyond the outermost centres their values go on.
  double at(const Vec3& point) const {
    const Vec3 p = image_.grid.ijk_from_lps(point);
    std::array<Taps, 3> taps;
    for (int a = 0; a < 3; ++a) taps[static_cast<std::size_t>(a)] = taps_at(a, p[a]);
    double sum = 0.0;
    for (int k = 0; k < taps[2].count; ++k) {
      double plane = 0.0;
      for (int j = 0; j < taps[1].count; ++j) {
        double row = 0.0;
        for (int i = 0; i < taps[0].count; ++i) {
          row += taps[0].weight[i] *
                 static_cast<double>(
                     image_.values[image_.grid.index(taps[0].at[i], taps[1].at[j], taps[2].at[k])]);
        }
        plane += taps[1].weight[j] * row;
      }
      sum += taps[2].weight[k] * plane;
    }
    return sum;
  }

  /// By how much the variance of the blur across the slices is more than in their plane, since each
  /// is the mean over its thickness; 0 where slices are as thin as pixels.                 [mm^2]
  double thickness_variance() const { return thickness_; }
  /// Unit vector across the slices.
  Vec3 across_slices() const { return image_.grid.direction.col(thick_); }

  /// Where a cut vessel is capped: within a voxel of the outermost centres, but no further than the
  /// rim of a cap is round.
  bool at_border(const Vec3& point) const {
    const Vec3 p = image_.grid.ijk_from_lps(point);
    for (int a = 0; a < 3; ++a) {
      const double depth = std::min(1.0, kRim / image_.grid.spacing[a]);
      if (p[a] < depth || p[a] > image_.grid.size[a] - 1.0 - depth) return true;
    }
    return false;
  }

 private:
  /// The voxels that count along an axis, and how much.
  struct Taps {
    std::array<int, 4> at{};
    std::array<double, 4> weight{};
    int count = 2;
  };

  Taps taps_at(int axis, double x) const {
    const int last = image_.grid.size[axis] - 1;
    x = std::clamp(x, 0.0, static_cast<double>(last));
    const int low = std::min(static_cast<int>(x), std::max(0, last - 1));
    const double f = x - low;
    if (!is_thick_) {
      return {.at = {low, std::min(low + 1, last)}, .weight = {1.0 - f, f}, .count = 2};
    }
    return {.at = {std::max(low - 1, 0), low, std::min(low + 1, last), std::min(low + 2, last)},
            .weight = {((-0.5 * f + 1.0) * f - 0.5) * f, (1.5 * f - 2.5) * f * f + 1.0,
                       ((-1.5 * f + 2.0) * f + 0.5) * f, (0.5 * f - 0.5) * f * f},
            .count = 4};
  }

  const Image& image_;
  Eigen::Index thick_ = 2;  // the axis across the slices
  bool is_thick_ = false;
  double thickness_ = 0.0;
};

/// Where the values along a normal pass the level nearest to 0 [in steps], rising or falling
/// outward as asked.
std::optional<double> crossing(const std::vector<double>& profile, double level, bool falling) {
  std::optional<double> best;
  const auto middle = static_cast<double>(profile.size() / 2);
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const double a = profile[k] - level, b = profile[k + 1] - level;
    if (falling ? !(a > 0.0 && b <= 0.0) : !(a < 0.0 && b >= 0.0)) continue;
    const double at = static_cast<double>(k) + a / (a - b) - middle;
    if (!best || std::abs(at) < std::abs(*best)) best = at;
  }
  return best;
}

/// From a crossing [in steps] inward to where the values have passed `level` [in steps].
std::optional<double> way_inward(const std::vector<double>& profile, double from, double level,
                                 bool falling) {
  const auto middle = static_cast<double>(profile.size() / 2);
  for (auto k = static_cast<int>(std::floor(from + middle)); k >= 0; --k) {
    const double inner = profile[static_cast<std::size_t>(k)] - level;
    const double outer = profile[static_cast<std::size_t>(k) + 1] - level;
    if (falling ? inner < 0.0 : inner > 0.0) continue;
    return from + middle - (static_cast<double>(k) + inner / (inner - outer));
  }
  return {};
}

/// How far blur moves the edge inward at each vertex: sigma^2 times the mean curvature, to first
/// order, as averaging over the surface by so many passes moves the vertices themselves. Between
/// whole passes in proportion.
Eigen::VectorXd moved_by_blur(const Surface& surface, const Neighbours& neighbours,
                              const Eigen::Matrix3Xd& normals, double passes) {
  Eigen::VectorXd inward = Eigen::VectorXd::Zero(surface.vertices.cols());
  const int whole = static_cast<int>(passes);
  const double rest = passes - whole;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::VectorXd start = surface.vertices.row(axis);
    Eigen::VectorXd place = start, weight = Eigen::VectorXd::Ones(place.size());
    average(neighbours, whole, place, weight);
    if (rest > 0.0) {
      Eigen::VectorXd next = place;
      average(neighbours, 1, next, weight);
      place += rest * (next - place);
    }
    inward -= (place - start).cwiseProduct(normals.row(axis).transpose());
  }
  return inward;
}

/// The square of the part of `direction` that lies in the surface at each vertex, and the surface's
/// normal curvature [1/mm] along that part, positive where the lumen is convex, averaged over the
/// surface by `passes`.
struct CurvatureAlong {
  Eigen::VectorXd inside, curvature;  // (n)
};

CurvatureAlong curvature_along(const Surface& surface, const Neighbours& neighbours,
                               const Eigen::Matrix3Xd& normals, const Vec3& direction, int passes) {
  const Eigen::Index n = surface.vertices.cols();
  CurvatureAlong along{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(n);
  for (Eigen::Index v = 0; v < n; ++v) {
    const Vec3 normal = normals.col(v), tangent = direction - normal.dot(direction) * normal;
    along.inside(v) = tangent.squaredNorm();
    if (along.inside(v) < 1e-3) continue;
    const Vec3 u = tangent.normalized();
    double turned = 0.0, steps = 0.0;  // by least squares over the edges
    const std::size_t end = neighbours.first[static_cast<std::size_t>(v) + 1];
    for (std::size_t k = neighbours.first[static_cast<std::size_t>(v)]; k < end; ++k) {
      const int w = neighbours.list[k];
      const double step = u.dot(surface.vertices.col(w) - surface.vertices.col(v));
      turned += step * u.dot(normals.col(w) - normal);
      steps += step * step;
    }
    if (steps <= 0.0) continue;
    along.curvature(v) = turned / steps;
    weight(v) = steps;
  }
  average(neighbours, passes, along.curvature, weight);
  return along;
}

/// What the lumen holds near each vertex and what lies just outside, as the image reads and
/// averaged along the surface.
struct Levels {
  Eigen::VectorXd lumen, outside, beyond;         // (n)
  double usual_lumen = 0.0, usual_outside = 0.0;  // medians
  double reach = 0.0;                             // of averages along the surface    [units]
  double contrast() const { return usual_lumen - usual_outside; }
};

/// The edge along the normal of each vertex.
struct Edges {
  Eigen::VectorXd shift;      // (n) outward to it, back to the mask where there is none      [mm]
  Eigen::VectorXd certainty;  // (n) 1, or kHold where there is none
  Eigen::VectorXd width;      // (n) from it to where the lumen is one sigma deep, or 0       [mm]
};

/// The surface while it moves.
class Fit {
 public:
  Fit(const Surface& surface, const Image& image)
      : grey_(image),
        neighbours_(find_neighbours(surface)),
        voxel_(std::cbrt(image.grid.spacing.prod())),
        edge_(mean_edge(surface)),
        unit_(voxel_),
        fitted_(surface),
        total_(Eigen::VectorXd::Zero(surface.vertices.cols())),
        fixed_(static_cast<std::size_t>(surface.vertices.cols())) {
    for (Eigen::Index v = 0; v < total_.size(); ++v) {
      fixed_[v] = grey_.at_border(surface.vertices.col(v)) ? 1 : 0;
    }
  }

  /// Walls are looked for once the blur is known.
  void round(FitStatistics* statistics) {
    const Eigen::Matrix3Xd normals = area_weighted_normals(fitted_);
    Levels levels = read_levels(normals);
    if (statistics) {
      statistics->lumen_value = levels.usual_lumen;
      statistics->outside_value = levels.usual_outside;
    }
    // The wall is soft tissue, though thin enough for the fat behind it to be what was read.
    if (levels.contrast() > kLeastHu) {
      levels.outside = levels.outside.cwiseMax(kWallHu);
      if (sigma_ > 0.0) look_for_walls(normals, levels);
    }

    Edges edges = find_edges(normals, levels);
    certainty_ = edges.certainty;
    undo_blur(normals, edges);
    if (statistics) {
      statistics->fitted_fraction = static_cast<double>((edges.certainty.array() == 1.0).count()) /
                                    static_cast<double>(total_.size());
    }
    // Against noise and gaps: the average of the neighbourhood.
    average(neighbours_, passes_for(levels.reach * unit_, edge_), edges.shift, edges.certainty);
    move(normals, edges.shift);
  }

  /// Where half of the contrast lies from the given surface in the median, outward; 0 where the
  /// image hardly shows an edge.                                                           [mm]
  double usual_shift() const {
    std::vector<double> moved;
    for (Eigen::Index v = 0; v < total_.size(); ++v) {
      if (fixed_[v] == 0 && certainty_(v) == 1.0) moved.push_back(total_(v));
    }
    const bool seen =
        static_cast<double>(moved.size()) >= kLeastSeen * static_cast<double>(total_.size());
    return seen ? median(std::move(moved)) : 0.0;
  }

  /// Whether who drew the mask cannot have meant it to be so far off.
  bool is_far(double shift) const { return std::abs(shift) > kKnownTo * voxel_; }

  /// Lets vertices move by two voxels from here on.
  void reach_further() { far_ = kFar * voxel_; }

  /// Moves the surface back by what it usually moved, and no vertex further from where it began
  /// than its mask is known.
  void restore_width(double shift) {
    const double most = kKnownTo * voxel_;
    const Eigen::VectorXd beside = (total_ - shift * certainty_).cwiseMin(most).cwiseMax(-most);
    move(area_weighted_normals(fitted_), beside - total_);
  }

  const Surface& surface() const { return fitted_; }
  double mean_shift() const { return total_.cwiseAbs().mean(); }

 private:
  Levels read_levels(const Eigen::Matrix3Xd& normals) const {
    const Eigen::Index n = total_.size();
    Levels levels{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
#pragma omp parallel for schedule(static)
    for (Eigen::Index v = 0; v < n; ++v) {
      const Vec3 p = fitted_.vertices.col(v), out = unit_ * normals.col(v);
      const double deep = 0.5 * (grey_.at(p - kInside * out) + grey_.at(p - (kInside + 0.5) * out));
      levels.lumen(v) = std::max(deep, grey_.at(p - kNearInside * out));
      levels.beyond(v) = grey_.at(p + kOutside * out);
      levels.outside(v) = levels.beyond(v);
      for (double way = kStep; way < kOutside; way += kStep) {
        levels.outside(v) = std::min(levels.outside(v), grey_.at(p + way * out));
      }
    }
    levels.usual_lumen = median({levels.lumen.begin(), levels.lumen.end()});
    levels.usual_outside = median({levels.outside.begin(), levels.outside.end()});

    Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
    const Eigen::VectorXd as_read = levels.lumen;
    average(neighbours_, passes_for(kLevelSmoothing * unit_, edge_), levels.lumen, weight);
    const Eigen::VectorXd off = (as_read - levels.lumen).cwiseAbs();
    const double noise = median({off.begin(), off.end()}) /
                         std::max(std::abs(levels.contrast()), std::numeric_limits<double>::min());
    levels.reach = kSmoothing * std::clamp(noise / kQuiet, 1.0, kMostOfSmoothing);
    weight.setOnes();
    average(neighbours_, passes_for(levels.reach * unit_, edge_), levels.outside, weight);
    return levels;
  }

  /// Where fat or air lies outside, the wall before it is in the profile across the edge.
  void look_for_walls(const Eigen::Matrix3Xd& normals, Levels& levels) {
    const Eigen::Index n = total_.size();
    WallProfiles profiles(n);
    const Vec3 across = grey_.across_slices();
#pragma omp parallel for schedule(static)
    for (Eigen::Index v = 0; v < n; ++v) {
      const Vec3 p = fitted_.vertices.col(v), out = normals.col(v);
      const double slope = out.dot(across);
      const double sigma = std::sqrt(sigma_ * sigma_ + grey_.thickness_variance() * slope * slope);
      profiles.sigma(v) = sigma;
      for (int k = 0; k < WallProfiles::kSamples; ++k) {
        const double way = sigma * (WallProfiles::kFirst + k * WallProfiles::kStep);
        profiles.values(k, v) = static_cast<float>(grey_.at(p + way * out));
      }
    }
    const int passes = passes_for(kForWalls * levels.reach * unit_, edge_);
    average_profiles(neighbours_, passes, profiles);
    WallsSeen seen = see_walls(profiles);
    // Across thick slices the blur is no Gaussian.
    seen.outside = (profiles.sigma.array() < kLikeInSlices * sigma_)
                       .select(seen.outside, std::numeric_limits<double>::quiet_NaN());
    if (seen.outside.array().isNaN().all()) return;
    levels.outside = seen.outside.array().isNaN().select(levels.outside, seen.outside);
    Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
    average(neighbours_, passes, levels.outside, weight);
    blur_ = seen.blur * sigma_;
  }

  Edges find_edges(const Eigen::Matrix3Xd& normals, const Levels& levels) const {
    const Eigen::Index n = total_.size();
    const int half = static_cast<int>(std::lround(kReach / kStep));
    // Darker outside, if only between the lumen and a bone; else brighter, or no edge.
    const double least = kLeastContrast * std::abs(levels.contrast());
    Edges edges{-total_, Eigen::VectorXd::Constant(n, kHold), Eigen::VectorXd::Zero(n)};
#pragma omp parallel
    {
      std::vector<double> profile(static_cast<std::size_t>(2 * half + 1));
#pragma omp for schedule(static)
      for (Eigen::Index v = 0; v < n; ++v) {
        const double lumen = levels.lumen(v);
        const bool falls = lumen - levels.outside(v) >= least;
        if (!falls && levels.beyond(v) - lumen < least) continue;
        const Vec3 p = fitted_.vertices.col(v), out = kStep * unit_ * normals.col(v);
        for (int k = -half; k <= half; ++k) {
          profile[static_cast<std::size_t>(k + half)] = grey_.at(p + k * out);
        }
        const double level = 0.5 * (lumen + (falls ? levels.outside(v) : levels.beyond(v)));
        const std::optional<double> at = crossing(profile, level, falls);
        if (!at) continue;
        edges.shift(v) = *at * kStep * unit_;
        edges.certainty(v) = 1.0;
        const double deep = level + (2.0 * kDeep - 1.0) * (lumen - level);
        edges.width(v) = way_inward(profile, *at, deep, falls).value_or(0.0) * kStep * unit_;
      }
    }
    return edges;
  }

  /// Of the edges that show the blur within slices, if these are thick.
  double sigma_in_plane(const Eigen::Matrix3Xd& normals, const Edges& edges, double of_all) const {
    if (grey_.thickness_variance() <= 0.0) return of_all;
    const Vec3 across = grey_.across_slices();
    std::vector<double> widths;
    for (Eigen::Index v = 0; v < edges.width.size(); ++v) {
      const bool lies_so = std::abs(normals.col(v).dot(across)) < kAcross;
      if (edges.width(v) > 0.0 && lies_so) widths.push_back(edges.width(v));
    }
    return widths.empty() ? of_all : std::min(of_all, median(std::move(widths)));
  }

  /// Blur moved the edges toward the middle of the vessel. Its width is the next round's unit.
  void undo_blur(const Eigen::Matrix3Xd& normals, Edges& edges) {
    std::vector<double> widths;
    std::copy_if(edges.width.begin(), edges.width.end(), std::back_inserter(widths),
                 [](double w) { return w > 0.0; });
    if (widths.empty()) return;
    const double sigma = median(widths);
    sigma_ = sigma_in_plane(normals, edges, sigma);
    const bool by_walls = blur_ > 0.0 && grey_.thickness_variance() <= 0.0;
    const double blur = by_walls ? blur_ : sigma;
    // Spread along each of the surface's two directions by sigma. By walls it is known to less than
    // a pass.
    const double spread = std::sqrt(2.0) * blur;
    const double blur_passes =
        by_walls ? passes_within(spread, edge_) : static_cast<double>(passes_for(spread, edge_));
    Eigen::VectorXd inward = moved_by_blur(fitted_, neighbours_, normals, blur_passes);
    Eigen::VectorXd most = Eigen::VectorXd::Constant(inward.size(), kMostMoved * blur);
    // More across the slices: by half of that variance times the curvature there.
    if (const double more = grey_.thickness_variance(); more > 0.0) {
      const int passes = passes_for(std::sqrt(2.0 * more), edge_);
      const CurvatureAlong along =
          curvature_along(fitted_, neighbours_, normals, grey_.across_slices(), passes);
      inward += 0.5 * more * along.inside.cwiseProduct(along.curvature);
      most = kMostMoved * (blur * blur + more * along.inside.array()).sqrt().matrix();
    }
    edges.shift += (edges.certainty.array() == 1.0).select(inward.cwiseMin(most), 0.0).matrix();
    unit_ = std::clamp(kUnitPerSigma * sigma, voxel_, kMostUnit * voxel_);
  }

  void move(const Eigen::Matrix3Xd& normals, const Eigen::VectorXd& shift) {
    for (Eigen::Index v = 0; v < total_.size(); ++v) {
      if (fixed_[v] != 0) continue;
      const double most = std::max(kReach * unit_, far_);
      const double way = std::clamp(total_(v) + shift(v), -most, most) - total_(v);
      total_(v) += way;
      fitted_.vertices.col(v) += way * normals.col(v);
    }
  }

  Interpolated grey_;
  Neighbours neighbours_;
  double voxel_, edge_;  // sizes of the image's voxels and of the surface's edges          [mm]
  double unit_;          // of distances along the normal                                   [mm]
  double sigma_ = 0.0;   // of the blur, in slices, by the last edges' inner half           [mm]
  double blur_ = 0.0;    // the same by profiles with the wall, or 0: not found              [mm]
  double far_ = 0.0;     // how far vertices may move in any case                           [mm]
  Surface fitted_;
  Eigen::VectorXd total_;      // (n) moved so far, outward                                 [mm]
  Eigen::VectorXd certainty_;  // (n) that of the last round's edges
  std::vector<char> fixed_;    // (n) at the image's border, where the vessel is cut
};

}  // namespace

Surface fit_to_image(const Surface& surface, const Image& image, FitStatistics* statistics,
                     FitWidth width) {
  expects(image.values.size() == image.grid.voxels() && surface.triangles.cols() > 0);
  Fit fit(surface, image);
  for (int round = 0; round < kRounds; ++round) fit.round(statistics);
  double shift = width == FitWidth::kOfMask ? fit.usual_shift() : 0.0;
  const bool wide_as_image = fit.is_far(shift);
  if (wide_as_image) {
    fit.reach_further();
    for (int round = 0; round < kRounds; ++round) fit.round(statistics);
    shift = fit.usual_shift();
  } else if (width == FitWidth::kOfMask) {
    fit.restore_width(shift);
  }
  if (statistics) {
    statistics->mean_shift_mm = fit.mean_shift();
    statistics->beyond_half_mm = -shift;
    statistics->wide_as_image = wide_as_image;
  }
  return fit.surface();
}

}  // namespace wireplan::preprocess
