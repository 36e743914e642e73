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

Guide::Guide(const NearestWall& wall, const Points& way) : wall_(wall) {
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

const Guide::Ball& Guide::nearest(const Vec3& p) const {
  double least = kInfinite;
  const Ball* best = &balls_.front();
  for (const Ball& ball : balls_) {
    const double away = (p - ball.center).norm() - ball.radius;
    if (away >= least) continue;
    least = away;
    best = &ball;
  }
  return *best;
}

double Guide::arc_of(const Vec3& p) const { return empty() ? 0.0 : nearest(p).arc; }

bool Guide::is_beside(const Vec3& p) const {
  constexpr double kNeck = 0.6;                         // of the lesser side; chosen
  constexpr double kSample = 0.25, kLeastSample = 0.1;  // of the ball's radius, but so much  [mm]
  if (empty()) return false;
  const Ball& ball = nearest(p);
  const Vec3 on = ball.center - p;
  const double sample = std::max(kSample * ball.radius, kLeastSample);
  const int steps = static_cast<int>(std::ceil(on.norm() / sample));
  double widest = 0.0;
  Nearest here = wall_.find(ball.center);
  for (int k = steps; k >= 0; --k) {  // from `p`
    here = wall_.find(ball.center - on * k / std::max(steps, 1), here);
    if (here.distance < kNeck * std::min(widest, ball.radius)) return true;
    widest = std::max(widest, here.distance);
  }
  return false;
}

std::optional<Vec3> Guide::departure_of(const Points& path) const {
  if (empty()) return std::nullopt;
  double arc_before = arc_of(path.front()), radius = 0.0, beside = 0.0;
  Vec3 before = path.front();
  for (const Vec3& p : path) {
    const double arc = arc_of(p), here = wall_.find(p).distance;
    if (is_shortcut(arc_before, arc, std::max(radius, here))) return p;
    beside = is_beside(p) ? beside + (p - before).norm() : 0.0;
    if (beside > long_for(here)) return p;
    arc_before = arc;
    radius = here;
    before = p;
  }
  return std::nullopt;
}

void GridSearch::follow(const Guide& guide) {
  guide_ = &guide;
  for (Node& n : nodes_) place_along_guide(n);
}

}  // namespace wireplan::preprocess
