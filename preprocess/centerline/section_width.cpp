#include "preprocess/centerline/section_width.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

namespace wireplan::preprocess {
namespace {

constexpr double kMeanOver = 1.5;    // of line to either side                             [mm]
constexpr double kLeastChord = 1.0;  // to either side, for the direction                  [mm]
// Round the point, in 5 degrees. A wall that turns away by more than 60 degrees from across a ray
// runs into a branch (an oval would have to be 3.7 times as long as wide); its rim begins where it
// turns by 17.
constexpr std::size_t kRays = 72;
constexpr double kRay = 2.0 * kPi / kRays;
constexpr double kSteep = 1.7, kRim = 0.3;  // of the radius, per radian
constexpr double kBack = 1.1;               // of the radius at one rim: the other has come near
constexpr std::size_t kWidestMouth = 30;    // rays: more is no mouth of a branch
// Tilted cuts: by the first angle in so many directions as long as that makes them smaller, then by
// half of it, and on to the last. Smaller ones lie within so many radii of the first. A cut across
// the line stands where none has much less of its area: noise alone makes some smaller.
constexpr double kFirstTilt = kPi / 9.0, kLastTilt = kPi / 40.0;
constexpr int kTilts = 6, kTiltTries = 4;
constexpr double kNear = 2.5;
constexpr double kMuchLess = 0.9;
// A section is open where, against the inscribed sphere, it is so many times as wide as the median
// within so much line to either side.
constexpr double kOpen = 1.2;
constexpr double kBeside = 20.0;  // [mm]
// So many points are cut out of one part of the surface, which holds what lies within so many
// radii of them.
constexpr Eigen::Index kStretch = 16;
constexpr double kReach = 3.0;

/// An edge of the surface as a key.
std::uint64_t key_of(int a, int b) {
  const auto [low, high] = std::minmax(a, b);
  return static_cast<std::uint64_t>(low) << 32U | static_cast<std::uint32_t>(high);
}

/// The closed polygons in which a plane cuts the surface; each side is that of one triangle, which
/// goes from one cut edge to another.
class PlaneCut {
 public:
  PlaneCut(const Surface& surface, const Vec3& point, const Vec3& normal)
      : surface_(surface),
        heights_((normal.transpose() * (surface.vertices.colwise() - point)).transpose()) {
    for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
      std::uint64_t from = 0, to = 0;
      for (int corner = 0; corner < 3; ++corner) {
        const int a = surface.triangles(corner, t), b = surface.triangles((corner + 1) % 3, t);
        const bool up = heights_(a) < 0.0 && heights_(b) >= 0.0;
        const bool down = heights_(a) >= 0.0 && heights_(b) < 0.0;
        if (up) from = key_of(a, b);
        if (down) to = key_of(a, b);
      }
      if (from != 0 || to != 0) next_[from] = to;  // along the rim, always the same way round
    }
  }

  /// Each loop once, without those that end where the surface does.
  std::vector<std::vector<Vec3>> loops() {
    std::vector<std::vector<Vec3>> all;
    while (!next_.empty()) {
      std::vector<Vec3> loop;
      const std::uint64_t first = next_.begin()->first;
      std::uint64_t edge = first;
      for (auto found = next_.find(edge); found != next_.end(); found = next_.find(edge)) {
        loop.push_back(crossing(edge));
        edge = found->second;
        next_.erase(found);
      }
      if (edge == first) all.push_back(std::move(loop));
    }
    return all;
  }

 private:
  Vec3 crossing(std::uint64_t edge) const {
    const auto a = static_cast<Eigen::Index>(edge >> 32U),
               b = static_cast<Eigen::Index>(edge & 0xffffffffU);
    const double part = heights_(a) / (heights_(a) - heights_(b));
    return surface_.vertices.col(a) + part * (surface_.vertices.col(b) - surface_.vertices.col(a));
  }

  const Surface& surface_;
  Eigen::VectorXd heights_;
  std::unordered_map<std::uint64_t, std::uint64_t> next_;
};

/// Area of a plane polygon, and how often it goes round a point of its plane.
std::pair<double, int> area_and_turns(const std::vector<Vec3>& loop, const Vec3& point,
                                      const Vec3& normal) {
  double area = 0.0, angle = 0.0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Vec3 a = loop[k] - point, b = loop[(k + 1) % loop.size()] - point;
    const double twice = normal.dot(a.cross(b));
    area += 0.5 * twice;
    angle += std::atan2(twice, a.dot(b));
  }
  return {std::abs(area), static_cast<int>(std::lround(angle / (2.0 * kPi)))};
}

/// From the point to the first wall in each direction of the loop's plane; turns as the loop does.
std::array<double, kRays> ways_out(const std::vector<Vec3>& loop, const Vec3& point,
                                   const Vec3& normal) {
  const Vec3 u = normal.unitOrthogonal(), w = normal.cross(u);
  std::array<double, kRays> ways{};
  for (std::size_t ray = 0; ray < kRays; ++ray) {
    const double angle = kRay * static_cast<double>(ray);
    const Vec3 along = std::cos(angle) * u + std::sin(angle) * w;
    const Vec3 across = normal.cross(along);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec3 a = loop[k] - point, b = loop[(k + 1) % loop.size()] - point;
      const double from = across.dot(a), to = across.dot(b);
      if ((from < 0.0) == (to < 0.0)) continue;
      const double way = along.dot(a + from / (from - to) * (b - a));
      if (way > 0.0) least = std::min(least, way);
    }
    ways[ray] = least;
  }
  return ways;
}

/// Replaces what lies in the mouth of a branch by a straight way from rim to rim: from each ray
/// after which the wall turns away, on to where it comes back. False where there is no mouth.
bool close_mouths(std::array<double, kRays>& ways) {
  bool closed = false;
  const auto rises = [&](std::size_t k) {
    return (ways[(k + 1) % kRays] - ways[k % kRays]) / (kRay * ways[k % kRays]);
  };
  for (std::size_t start = kRays; start < 2 * kRays; ++start) {
    if (rises(start) <= kSteep) continue;
    std::size_t rim = start, back = start + 1;
    while (rim > start - kWidestMouth && rises(rim - 1) > kRim) --rim;
    const double here = ways[rim % kRays];
    while (back < rim + kWidestMouth && ways[back % kRays] > kBack * here) ++back;
    while (back < rim + kWidestMouth && rises(back) < -kRim) ++back;
    if (back >= rim + kWidestMouth) continue;
    const double there = ways[back % kRays];
    for (std::size_t k = rim + 1; k < back; ++k) {
      const double part = static_cast<double>(k - rim) / static_cast<double>(back - rim);
      ways[k % kRays] = here + part * (there - here);
    }
    closed = true;
  }
  return closed;
}

/// The part of a cut that is the vessel's, without the branches that it runs into.
double area_without_branches(const std::vector<Vec3>& loop, double whole, const Vec3& point,
                             const Vec3& normal) {
  std::array<double, kRays> ways = ways_out(loop, point, normal);
  bool closed = close_mouths(ways);
  std::reverse(ways.begin(), ways.end());  // a mouth that is steep on its other side
  closed = close_mouths(ways) || closed;
  if (!closed) return whole;
  double twice = 0.0;
  for (std::size_t k = 0; k < kRays; ++k) {
    twice += std::sin(kRay) * ways[k] * ways[(k + 1) % kRays];
  }
  return std::min(whole, 0.5 * twice);
}

/// Unit, along the chord.
Vec3 direction_at(const Centerline& line, Eigen::Index k) {
  const double reach = std::max(kLeastChord, line.radius(k));
  Eigen::Index before = k, after = k;
  while (before > 0 && line.arc_length(k) - line.arc_length(before) < reach) --before;
  const Eigen::Index last = line.points.cols() - 1;
  while (after < last && line.arc_length(after) - line.arc_length(k) < reach) ++after;
  return (line.points.col(after) - line.points.col(before)).normalized();
}

/// Of the smallest loop of a cut that goes round the point; infinite where none does.
double area_of_cut(const Surface& surface, const Vec3& point, const Vec3& normal) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::vector<Vec3>& loop : PlaneCut(surface, point, normal).loops()) {
    const auto [area, turns] = area_and_turns(loop, point, normal);
    if (turns != 0) least = std::min(least, area);
  }
  return least;
}

/// The triangles of the surface that come within `reach` of a point.
Surface near_part(const Surface& surface, const Vec3& point, double reach) {
  const Eigen::Index n = surface.vertices.cols();
  std::vector<int> index(static_cast<std::size_t>(n), -1);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index v = 0; v < n; ++v) {
    if ((surface.vertices.col(v) - point).squaredNorm() > reach * reach) continue;
    index[static_cast<std::size_t>(v)] = static_cast<int>(kept.size());
    kept.push_back(v);
  }
  Surface part;
  part.vertices = surface.vertices(Eigen::all, kept);
  std::vector<Eigen::Vector3i> triangles;
  for (const auto& t : surface.triangles.colwise()) {
    const Eigen::Vector3i moved(index[static_cast<std::size_t>(t(0))],
                                index[static_cast<std::size_t>(t(1))],
                                index[static_cast<std::size_t>(t(2))]);
    if (moved.minCoeff() >= 0) triangles.push_back(moved);
  }
  part.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    part.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }
  return part;
}

/// The direction across which a cut through the point is smallest, tilted from the one along the
/// line as long as that makes it smaller: where the line turns from one vessel into another its
/// chord runs across both.
Vec3 smallest_cut(const Surface& part, const Vec3& point, Vec3 normal, double area) {
  for (double tilt = kFirstTilt; tilt >= kLastTilt; tilt *= 0.5) {
    for (int tries = 0; tries < kTiltTries; ++tries) {
      const Vec3 u = normal.unitOrthogonal(), w = normal.cross(u);
      double least = area;
      Vec3 best = normal;
      for (int k = 0; k < kTilts; ++k) {
        const double angle = 2.0 * kPi * k / kTilts;
        const Vec3 tilted =
            (normal + std::tan(tilt) * (std::cos(angle) * u + std::sin(angle) * w)).normalized();
        const double found = area_of_cut(part, point, tilted);
        if (found >= least) continue;
        least = found;
        best = tilted;
      }
      if (least >= area) break;
      area = least;
      normal = best;
    }
  }
  return normal;
}

/// Of the smallest loop that goes round the point, without branches.
double area_of_vessel(const Surface& surface, const Vec3& point, const Vec3& normal) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::vector<Vec3>& loop : PlaneCut(surface, point, normal).loops()) {
    const auto [whole, turns] = area_and_turns(loop, point, normal);
    if (turns == 0 || whole >= least) continue;
    least = area_without_branches(loop, whole, point, normal);
  }
  return least;
}

/// Points of a line from `first` to before `last`, and the surface round them.
struct Stretch {
  Eigen::Index first, last;
  Surface part;
  double reach;  // of the part, from each of the points                                   [mm]
};

Stretch stretch_from(const Surface& surface, const Centerline& line, Eigen::Index first) {
  const Eigen::Index last = std::min(first + kStretch, line.points.cols());
  const Vec3 middle = line.points.col((first + last) / 2);
  const auto points = line.points.middleCols(first, last - first);
  const double half = (points.colwise() - middle).colwise().norm().maxCoeff();
  const double reach =
      kReach * std::max(kLeastChord, line.radius.segment(first, last - first).maxCoeff());
  return {first, last, near_part(surface, middle, half + reach), reach};
}

/// By the cut across the line, or by a tilted one; the sphere's where none goes round the point.
double diameter_at(const Surface& surface, const Stretch& stretch, const Centerline& line,
                   Eigen::Index k) {
  const Vec3 point = line.points.col(k), across = direction_at(line, k);
  double area = area_of_cut(stretch.part, point, across);
  const bool leaves_part = !std::isfinite(area);
  if (leaves_part) area = area_of_cut(surface, point, across);
  if (!std::isfinite(area)) return 2.0 * line.radius(k);
  const double reach = kNear * std::sqrt(area / kPi);
  const Surface& from = leaves_part || reach > stretch.reach ? surface : stretch.part;
  const Surface part = near_part(from, point, reach);
  const Vec3 tilted = smallest_cut(part, point, across, area);
  const bool turns = area_of_cut(part, point, tilted) < kMuchLess * area;
  double closed = area_of_vessel(from, point, across);
  if (turns) closed = std::min(closed, area_of_vessel(from, point, tilted));
  return std::sqrt(4.0 * closed / kPi);
}

/// Of open sections, what a closed one as wide beside its sphere as those near it would have.
Eigen::VectorXd without_openings(const Centerline& line, const Eigen::VectorXd& diameters) {
  const Eigen::VectorXd times = diameters.array() / (2.0 * line.radius.array()).max(1e-9);
  Eigen::VectorXd result = diameters;
  std::vector<double> beside;
  for (Eigen::Index k = 0; k < line.points.cols(); ++k) {
    beside.clear();
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      if (std::abs(line.arc_length(i) - line.arc_length(k)) <= kBeside) beside.push_back(times(i));
    }
    const double usual = median(beside);
    if (times(k) > kOpen * usual) result(k) = usual * 2.0 * line.radius(k);
  }
  return result;
}

}  // namespace

Eigen::VectorXd section_diameters(const Surface& surface, const Centerline& line) {
  const Eigen::Index count = line.points.cols();
  expects(count >= 2);
  Eigen::VectorXd single(count), mean(count);
#pragma omp parallel for schedule(dynamic)
  for (Eigen::Index first = 0; first < count; first += kStretch) {
    const Stretch stretch = stretch_from(surface, line, first);
    for (Eigen::Index k = first; k < stretch.last; ++k) {
      single(k) = diameter_at(surface, stretch, line, k);
    }
  }
  single = without_openings(line, single);
  for (Eigen::Index k = 0; k < count; ++k) {
    double sum = 0.0;
    int some = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (std::abs(line.arc_length(i) - line.arc_length(k)) > kMeanOver) continue;
      sum += single(i);
      ++some;
    }
    mean(k) = sum / some;
  }
  return mean;
}

bool shares_section(const Surface& surface, const Centerline& line, Eigen::Index k,
                    const Centerline& other) {
  const Vec3 point = line.points.col(k), normal = direction_at(line, k);
  const auto goes_round = [&](const std::vector<Vec3>& loop, const Vec3& place) {
    return area_and_turns(loop, place, normal).second != 0;
  };
  std::vector<std::vector<Vec3>> loops = PlaneCut(surface, point, normal).loops();
  std::erase_if(loops, [&](const std::vector<Vec3>& loop) { return !goes_round(loop, point); });
  if (loops.empty()) return false;
  for (Eigen::Index i = 1; i < other.points.cols(); ++i) {
    const Vec3 a = other.points.col(i - 1), b = other.points.col(i);
    const double from = normal.dot(a - point), to = normal.dot(b - point);
    if ((from < 0.0) == (to < 0.0)) continue;
    const Vec3 place = a + from / (from - to) * (b - a);
    const bool inside = std::all_of(loops.begin(), loops.end(), [&](const std::vector<Vec3>& loop) {
      return goes_round(loop, place);
    });
    if (inside) return true;
  }
  return false;
}

}  // namespace wireplan::preprocess
