#include "preprocess/centerline/grid_search.h"

#include <algorithm>

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

}  // namespace wireplan::preprocess
