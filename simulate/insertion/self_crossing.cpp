#include "simulate/insertion/self_crossing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wireplan::simulate {
namespace {

constexpr Eigen::Index kEdgesPerStretch = 16;
constexpr double kRadiiApart = 4.0;  // along the wire: a thick one that bends is no crossing

/// Nearest points of two edges, as parts of them.
struct Nearest {
  double s = 0.0, t = 0.0, squared_distance = 0.0;
};

/// Ericson, Real-Time Collision Detection, 5.1.9. Expects edges of some length.
Nearest find_nearest(const Vec3& p, const Vec3& d, const Vec3& q, const Vec3& e) {
  const Vec3 r = p - q;
  const double a = d.squaredNorm(), b = d.dot(e), c = e.squaredNorm();
  const double f = d.dot(r), g = e.dot(r), sine = a * c - b * b;
  double s = sine > 1e-12 * a * c ? std::clamp((b * g - f * c) / sine, 0.0, 1.0) : 0.0;
  double t = (b * s + g) / c;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((b * t - f) / a, 0.0, 1.0);
  }
  return {s, t, (r + s * d - t * e).squaredNorm()};
}

/// No less than the angle whose half has this sine: every term of the series of the arcsine beyond
/// the first is at most as large at the third power, and they sum up to a right angle at 1.
double angle_bound(double half_sine) {
  const double x = std::min(1.0, half_sine);
  return 2.0 * (x + (0.5 * kPi - 1.0) * x * x * x);
}

}  // namespace

std::string describe_crossing(const SelfCrossing& crossing, double radius) {
  char text[160];
  std::snprintf(
      text, sizeof text,
      " mm: what is %.1f and %.1f mm behind its tip comes within %.2f mm, and the wire is "
      "%.2f mm thick",
      crossing.from_tip, crossing.other_from_tip, crossing.distance, 2.0 * radius);
  return "the wire crosses itself at " + place_text(crossing.point) + text;
}

std::optional<SelfCrossing> CrossingFinder::find(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes,
                                                 double radius) {
  const Eigen::Index edges = nodes.cols() - 1;
  if (edges < 2) return {};
  const double apart = std::max(kCrossingApart, kRadiiApart * radius);
  double distance = 2.0 * radius;

  // Arc length, and how much the wire turns at most.
  arc_.resize(static_cast<std::size_t>(edges) + 1);
  turned_.resize(static_cast<std::size_t>(edges));
  arc_[0] = turned_[0] = 0.0;
  Vec3 before = Vec3::Zero();
  for (Eigen::Index i = 0; i < edges; ++i) {
    const Vec3 edge = nodes.col(i + 1) - nodes.col(i);
    const double length = edge.norm();
    const auto k = static_cast<std::size_t>(i);
    arc_[k + 1] = arc_[k] + length;
    const Vec3 tangent = edge / length;
    if (i > 0) turned_[k] = turned_[k - 1] + angle_bound(0.5 * (tangent - before).norm());
    before = tangent;
  }
  if (!may_meet(0, edges, apart, distance)) return {};

  stretches_.clear();
  for (Eigen::Index first = 0; first < edges; first += kEdgesPerStretch) {
    const Eigen::Index last = std::min(edges, first + kEdgesPerStretch);
    const auto own = nodes.middleCols(first, last - first + 1);
    stretches_.push_back({first, last, own.rowwise().minCoeff(), own.rowwise().maxCoeff()});
  }
  std::optional<SelfCrossing> nearest;
  for (std::size_t i = 0; i < stretches_.size(); ++i) {
    for (std::size_t j = i; j < stretches_.size(); ++j) {
      const Stretch &behind = stretches_[i], &ahead = stretches_[j];
      if (!may_meet(behind.first, ahead.last, apart, distance)) continue;
      const Vec3 between =
          (ahead.low - behind.high).cwiseMax(behind.low - ahead.high).cwiseMax(0.0);
      if (between.squaredNorm() < distance * distance) {
        compare(nodes, behind, ahead, apart, nearest, distance);
      }
    }
  }
  return nearest;
}

/// Whether two parts of these edges may be that near to each other.
bool CrossingFinder::may_meet(Eigen::Index first, Eigen::Index last, double apart,
                              double distance) const {
  const auto from = static_cast<std::size_t>(first), to = static_cast<std::size_t>(last);
  if (arc_[to] - arc_[from] < apart) return false;
  const double turn = turned_[to - 1] - turned_[from];
  return turn >= kPi || apart * std::cos(0.5 * turn) < distance;
}

void CrossingFinder::compare(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const Stretch& behind,
                             const Stretch& ahead, double apart,
                             std::optional<SelfCrossing>& nearest, double& distance) const {
  const double whole = arc_.back();
  for (Eigen::Index i = behind.first; i < behind.last; ++i) {
    const Vec3 p = nodes.col(i), d = nodes.col(i + 1) - p;
    const auto a = static_cast<std::size_t>(i);
    for (Eigen::Index j = std::max(ahead.first, i + 1); j < ahead.last; ++j) {
      const auto b = static_cast<std::size_t>(j);
      if (arc_[b + 1] - arc_[a] < apart) continue;
      const Vec3 q = nodes.col(j), e = nodes.col(j + 1) - q;
      const double reach = 0.5 * (arc_[a + 1] - arc_[a] + arc_[b + 1] - arc_[b]) + distance;
      if ((p + 0.5 * d - q - 0.5 * e).squaredNorm() >= reach * reach) continue;
      // Of edges that are only in part so far apart, their outer nodes.
      const bool whole_edges = arc_[b] - arc_[a + 1] >= apart;
      const Nearest found =
          whole_edges ? find_nearest(p, d, q, e) : Nearest{0.0, 1.0, (q + e - p).squaredNorm()};
      if (found.squared_distance >= distance * distance) continue;
      distance = std::sqrt(found.squared_distance);
      nearest = {.distance = distance,
                 .from_tip = whole - arc_[b] - found.t * (arc_[b + 1] - arc_[b]),
                 .other_from_tip = whole - arc_[a] - found.s * (arc_[a + 1] - arc_[a]),
                 .point = 0.5 * (p + found.s * d + q + found.t * e)};
    }
  }
}

}  // namespace wireplan::simulate
