#include "plan/anatomy/projection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace wireplan::plan {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-6;  // of angles                                           [rad]
// See find_projections(): what shows as much, and what counts as one angle.
constexpr double kAlike = 0.5 * kRadPerDeg, kOneAngle = 2.0 * kRadPerDeg;  //              [rad]

double foreshortening(const Vec3& direction, const Vec3& detector) {
  return std::max(0.0, 1.0 - direction.cross(detector).norm());
}

bool is_within(const View& view, const ArmLimits& limits, double slack) {
  return std::abs(view.rotation) <= limits.rotation + slack &&
         std::abs(view.tilt) <= limits.tilt + slack;
}

/// What is told of the view from a detector: at the arm's limits or without rotation where it is
/// less than half a degree from that.
Projection project(const Vec3& from, const Vec3& trunk, const Vec3& branch,
                   const ArmLimits& limits) {
  View view = view_from(from);
  if (std::abs(view.tilt) > 0.5 * kPi - kAlike) {
    view = {.rotation = 0.0, .tilt = std::copysign(0.5 * kPi, view.tilt)};
  }
  const bool reachable = is_within(view, limits, kAlike);
  if (reachable) {
    view.rotation = std::clamp(view.rotation, -limits.rotation, limits.rotation);
    view.tilt = std::clamp(view.tilt, -limits.tilt, limits.tilt);
  }
  const Vec3 detector = detector_direction(view);
  return {.view = view,
          .reachable = reachable,
          .trunk_foreshortening = foreshortening(trunk, detector),
          .branch_foreshortening = foreshortening(branch, detector)};
}

/// Of views that show as much as each other the one to tell. Expects one at least.
Projection choose(std::vector<Projection> views) {
  const auto keep_least = [&](const auto& value) {
    double least = kInfinite;
    for (const Projection& p : views) least = std::min(least, value(p));
    std::erase_if(views, [&](const Projection& p) { return value(p) > least + kOneAngle; });
  };
  const auto is_negative = [](double angle) { return angle < -kAlike ? 1.0 : 0.0; };
  keep_least([](const Projection& p) { return p.reachable ? 0.0 : 1.0; });
  keep_least([](const Projection& p) { return std::abs(p.view.tilt); });
  keep_least([](const Projection& p) { return std::abs(p.view.rotation); });
  keep_least([&](const Projection& p) { return is_negative(p.view.rotation); });
  keep_least([&](const Projection& p) { return is_negative(p.view.tilt); });
  return views.front();
}

/// `from` turned toward a direction across it by the least angle, from `least` to 90 deg, that is
/// within reach; none where none is. Expects unit vectors.
std::optional<Vec3> turn_into_reach(const Vec3& from, const Vec3& toward, double least,
                                    const ArmLimits& limits) {
  constexpr int kSteps = 45, kHalvings = 30;  // of 2 deg or less, to 1e-10 rad
  const auto turned = [&](double angle) -> Vec3 {
    return std::cos(angle) * from + std::sin(angle) * toward;
  };
  const auto reaches = [&](double angle) {
    return is_within(view_from(turned(angle)), limits, kRounding);
  };
  double before = least, there = least;
  for (int i = 1; i <= kSteps && !reaches(there); ++i) {
    before = there;
    there = least + (0.5 * kPi - least) * i / kSteps;
  }
  if (!reaches(there)) return {};
  for (int i = 0; i < kHalvings && there > before; ++i) {
    const double middle = 0.5 * (before + there);
    (reaches(middle) ? there : before) = middle;
  }
  return turned(there);
}

/// The best view of a branch that goes on as the trunk does.
Projection look_across(const Vec3& trunk, const Vec3& branch, const ArmLimits& limits) {
  const double front_to_back = std::sin(5.0 * kRadPerDeg);
  const auto across = [&](const Vec3& view) -> Vec3 { return view - view.dot(branch) * branch; };
  const Vec3 front = across(-Vec3::UnitY());
  if (front.norm() < front_to_back) return project(across(Vec3::UnitX()), trunk, branch, limits);
  const Vec3 from = front.normalized(), aside = from.cross(branch).normalized();
  std::vector<Projection> views;
  for (const double sign : {1.0, -1.0}) {
    const std::optional<Vec3> view = turn_into_reach(from, sign * aside, 0.0, limits);
    if (view) views.push_back(project(*view, trunk, branch, limits));
  }
  return views.empty() ? project(from, trunk, branch, limits) : choose(std::move(views));
}

/// Turning from the best view, or its mirror image, shortens trunk and branch whatever the way: on
/// each way the first view that is allowed is the best, and only the way is searched for.
std::optional<Projection> find_second(const Vec3& best, bool reachable, const Vec3& trunk,
                                      const Vec3& branch, const ArmLimits& limits) {
  constexpr int kWays = 120, kHalvings = 25;  // all round, then to 2e-9 rad
  constexpr double kApart = 2.0 * kPi / kWays;
  const double least_apart = reachable ? 30.0 * kRadPerDeg : 0.0;
  const double weight = reachable ? 0.1 : 1.0;  // of the trunk
  const Vec3 u = best.unitOrthogonal(), v = best.cross(u);
  const auto view_on = [&](double side, double way) {
    const Vec3 toward = std::cos(way) * u + std::sin(way) * v;
    return turn_into_reach(side * best, toward, least_apart, limits);
  };
  const auto cost_on = [&](double side, double way) {
    const std::optional<Vec3> view = view_on(side, way);
    if (!view) return kInfinite;
    return foreshortening(branch, *view) + weight * foreshortening(trunk, *view);
  };

  // The ways on which least is lost, each more than on those beside it.
  std::vector<std::pair<double, Vec3>> lows;
  for (const double side : {1.0, -1.0}) {
    std::vector<double> costs;
    for (int k = 0; k < kWays; ++k) costs.push_back(cost_on(side, k * kApart));
    for (std::size_t k = 0; k < costs.size(); ++k) {
      const double before = costs[k == 0 ? kWays - 1 : k - 1], behind = costs[(k + 1) % kWays];
      if (costs[k] == kInfinite || costs[k] > before || costs[k] >= behind) continue;
      double way = static_cast<double>(k) * kApart, cost = costs[k], step = kApart;
      for (int i = 0; i < kHalvings; ++i) {
        step *= 0.5;
        for (const double tried : {way - step, way + step}) {
          const double there = cost_on(side, tried);
          if (there >= cost) continue;
          cost = there;
          way = tried;
          break;
        }
      }
      lows.emplace_back(cost, *view_on(side, way));
    }
  }
  if (lows.empty()) return {};
  const double least = std::min_element(lows.begin(), lows.end(), [](const auto& a, const auto& b) {
                         return a.first < b.first;
                       })->first;
  std::vector<Projection> alike;
  for (const auto& [cost, view] : lows) {
    if (cost <= least + std::sin(kAlike)) alike.push_back(project(view, trunk, branch, limits));
  }
  return choose(std::move(alike));
}

}  // namespace

Vec3 detector_direction(const View& view) {
  return {std::sin(view.rotation) * std::cos(view.tilt),
          -std::cos(view.rotation) * std::cos(view.tilt), std::sin(view.tilt)};
}

View view_from(const Vec3& detector) {
  // Rounding may leave a -0, of which atan2 makes half a turn.
  const Vec3 d = detector.normalized() + Vec3::Zero();
  return {.rotation = std::atan2(d.x(), -d.y()), .tilt = std::asin(std::clamp(d.z(), -1.0, 1.0))};
}

Projections find_projections(const Vec3& trunk, const Vec3& branch, const ArmLimits& limits) {
  const double in_line = std::sin(5.0 * kRadPerDeg);
  const Vec3 normal = trunk.cross(branch);
  const bool plane = normal.norm() > in_line;
  Projections found;
  found.best = plane ? choose({project(normal, trunk, branch, limits),
                               project(-normal, trunk, branch, limits)})
                     : look_across(trunk, branch, limits);
  found.second = find_second(plane ? normal.normalized() : detector_direction(found.best.view),
                             found.best.reachable, trunk, branch, limits);
  return found;
}

}  // namespace wireplan::plan
