#include "preprocess/centerline/grid_search.h"

#include <algorithm>
#include <cmath>

namespace wireplan::preprocess {

Vec3 leave_wall(const NearestWall& wall, Vec3 point, double depth) {
  Nearest here = wall.find(point);
  while (here.distance < depth) {
    const Vec3 next = point + 0.5 * (point - here.foot);
    const Nearest there = wall.find(next, here);
    if (there.distance < 1.2 * here.distance) break;  // free growth is by 1.5: near the ridge
    point = next;
    here = there;
  }
  return point;
}

double grid_spacing(double volume, double nodes_wanted) {
  constexpr double kFinest = 0.25, kCoarsest = 1.0, kMostNodesWanted = 400e3;
  const double coarsest = std::max(kCoarsest, std::cbrt(volume / kMostNodesWanted));
  return std::clamp(std::cbrt(volume / nodes_wanted), kFinest, coarsest);
}

void GridSearch::stay_near(const Points& route) {
  // Balls in the middle of the vessel: the route itself may run along the wall.
  std::vector<std::pair<Vec3, double>> balls;  // centre, squared radius
  for (const Vec3& p : route) {
    const Vec3 center = leave_wall(wall_, p, kInfinite);
    balls.emplace_back(center, std::pow(1.5 * wall_.find(center).distance, 2));
  }
  const auto covered = [&](const Vec3& p) {
    return std::any_of(balls.begin(), balls.end(), [&](const auto& ball) {
      return (p - ball.first).squaredNorm() <= ball.second;
    });
  };
  for (Node& n : nodes_) n.allowed = covered(n.point);
  for (const int end : {kStart, kGoal}) nodes_[static_cast<std::size_t>(end)].allowed = true;
}

Guide::Guide(const NearestWall& wall, const Points& way) {
  constexpr double kApart = 1.0;  // of balls, about; chosen                               [mm]
  const auto add = [&](const Vec3& p, double arc) {
    const Vec3 center = leave_wall(wall, p, kInfinite);
    balls_.push_back({.center = center, .radius = wall.find(center).distance, .arc = arc});
  };
  double arc = 0.0;
  for (std::size_t k = 0; k + 1 < way.size(); ++k) {
    const Vec3 edge = way[k + 1] - way[k];
    const double length = edge.norm();
    const double since = balls_.empty() ? kApart : arc - balls_.back().arc;
    const int parts = static_cast<int>(std::ceil(length / kApart));
    for (int part = since < kApart ? 1 : 0; part < parts; ++part) {
      add(way[k] + edge * part / parts, arc + length * part / parts);
    }
    arc += length;
  }
  if (!way.empty()) add(way.back(), arc);
}

double Guide::arc_of(const Vec3& p) const {
  double least = kInfinite, arc = 0.0;
  for (const Ball& ball : balls_) {
    const double beside = (p - ball.center).norm() - ball.radius;
    if (beside >= least) continue;
    least = beside;
    arc = ball.arc;
  }
  return arc;
}

void GridSearch::follow(const Guide& guide) {
  guide_ = &guide;
  for (Node& n : nodes_) n.arc = guide.arc_of(n.point);
}

}  // namespace wireplan::preprocess
