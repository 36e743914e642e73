#pragma once
/// Cheapest paths through the lumen on a grid; for use in this folder.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "preprocess/centerline/nearest_wall.h"
#include "preprocess/vessel.h"

namespace wireplan::preprocess {

using Points = std::vector<Vec3>;

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();
inline constexpr std::size_t kMostNodes =
    3'000'000;  // bounds memory (0.5 GB) and time (about 30 s)

/// Spacing [mm] of a grid that has about `nodes_wanted` nodes in a lumen of this volume [mm^3], but
/// 0.25 to 1 mm, and wider where a lumen is so large that it would have over 400 thousand nodes
/// (the arteries from groin to head have 300): so a first search is never much longer than theirs.
double grid_spacing(double volume, double nodes_wanted);

/// Moves a point near the wall straight away from it, as long as its distance from the wall grows
/// and until that is `depth`. Its inscribed ball is then large enough to reach points of the grid.
Vec3 leave_wall(const NearestWall& wall, Vec3 point, double depth);

struct Node {
  Vec3 point = Vec3::Zero();
  Eigen::Vector3i ijk = Eigen::Vector3i::Zero();  // of a grid point; not used by the two ends
  Nearest wall;
  double cost = kInfinite;  // from the start
  int parent = -1;
  bool settled = false;
  bool allowed = true;  // may the path pass here?
  double arc = 0.0;     // along the guide, if there is one                                [mm]
  bool beside = false;  // in another vessel than the guide
};

/// Which cost a path has per length, for inscribed radius r [mm]. kRoute, 1 + 1/r^2, finds the
/// shortest passable way: a length counts twice where r is 1 mm. kMiddle, 1/r^2, keeps a path in
/// the middle of the vessel.
enum class Cost { kRoute, kMiddle };

inline double cost_per_mm(Cost cost, double r) {
  const double narrow = 1.0 / (r * r);
  return cost == Cost::kRoute ? 1.0 + narrow : narrow;
}

/// A way that is known. Each place of the lumen belongs to a part of it: that whose ball it is
/// deepest in, or nearest to.
class Guide {
 public:
  Guide(const NearestWall& wall, const Points& way);

  bool empty() const { return balls_.empty(); }
  double arc_of(const Vec3& p) const;  // of the part that a place belongs to             [mm]

  /// Whether the straight way from a place of the lumen to the part that it belongs to leads
  /// through a neck or a wall, as from a vessel that runs along the guide's and may touch it.
  bool is_beside(const Vec3& p) const;

  /// The first place at which a path takes a shortcut of the guide, or where it has run in another
  /// vessel beside it for long.
  std::optional<Vec3> departure_of(const Points& path) const;

  /// Whether a step between places of these arcs leads to a part much further along, as where
  /// vessels touch; `radius` is the larger distance from the wall. A branch that leaves a wide
  /// vessel at a sharp angle is none.
  static bool is_shortcut(double a, double b, double radius) {
    return std::abs(a - b) > long_for(radius);
  }

  /// A length along a vessel of this radius that is long for it [mm]; chosen.
  static double long_for(double radius) { return 2.5 * radius + 5.0; }

 private:
  /// In the middle of the vessel: the way itself may run along the wall.
  struct Ball {
    Vec3 center;
    double radius, arc;  //                                                                [mm]
  };
  const Ball& nearest(const Vec3& p) const;  // expects one

  const NearestWall& wall_;
  std::vector<Ball> balls_;
};

/// A ball round nodes of a grid, by default an empty one.
struct GridBall {
  Vec3 center = Vec3::Zero();
  double radius = -1.0;  //                                                                [mm]
};

/// Cheapest paths on a grid whose points are made, and their wall distance computed, when first
/// touched. Two points are joined when their inscribed balls overlap: then no wall is between them,
/// and so all that is reached lies in the same lumen as the start, without any inside test.
class GridSearch {
 public:
  GridSearch(const NearestWall& wall, const Surface& surface, double spacing, const Vec3& start,
             const Vec3& goal)
      : wall_(wall), spacing_(spacing) {
    origin_ = surface.vertices.rowwise().minCoeff();
    const Vec3 extent = surface.vertices.rowwise().maxCoeff() - origin_;
    size_ = (extent / spacing).array().ceil().cast<int>() + 1;
    bricks_ = (size_.array() + kBrick - 1) / kBrick;
    slots_.resize(static_cast<std::size_t>(bricks_.x()) * static_cast<std::size_t>(bricks_.y()) *
                  static_cast<std::size_t>(bricks_.z()));
    nodes_.push_back({.point = start, .wall = wall_.find(start)});
    nodes_.push_back({.point = goal, .wall = wall_.find(goal)});
  }

  /// True when the goal was reached. For kRoute this is A*: no route costs less than the straight
  /// way to the goal. For kMiddle there is no such bound, and the search goes by cost alone.
  bool run(Cost kind) {
    kind_ = kind;
    for (Node& n : nodes_) {
      n.cost = kInfinite;
      n.parent = -1;
      n.settled = false;
    }
    queue_ = {};
    nodes_[kStart].cost = 0.0;
    queue_.emplace(0.0, kStart);
    while (!queue_.empty() && nodes_.size() < kMostNodes) {
      const int here = queue_.top().second;
      queue_.pop();
      if (here == kGoal) return true;
      if (node(here).settled) continue;
      nodes_[static_cast<std::size_t>(here)].settled = true;
      relax(here, kGoal);
      if (here == kStart) {
        visit_block(here, (node(here).point - origin_) / spacing_);
      } else {
        visit_neighbours(here);
      }
    }
    return false;
  }

  /// Cheapest ways from the start to all that is connected to it.
  void run_everywhere(Cost kind) {
    nodes_[kGoal].allowed = false;
    run(kind);
  }

  // The nodes by number, for a look at all of them; 0 is the start, 1 the goal.
  std::size_t count() const { return nodes_.size(); }
  const Node& at(std::size_t i) const { return nodes_[i]; }
  double spacing() const { return spacing_; }

  /// Calls `visit` with the numbers of the nodes that are made in a ball, but for those that lie
  /// well inside another one, `before`. Along a line of balls that is a shell of each: the time is
  /// that of their surfaces, where the balls themselves hold up to hundreds of thousands of nodes.
  template <class Visit>
  void visit_ball(const GridBall& ball, const GridBall& before, const Visit& visit) const {
    const Vec3 place = (ball.center - origin_) / spacing_;
    const double reach = ball.radius / spacing_;
    const Eigen::Vector3i low = (place.array() - reach).ceil().cast<int>().max(0);
    const Eigen::Vector3i high = (place.array() + reach).floor().cast<int>().min(size_.array() - 1);
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        const auto [first, last] = row_in(ball, j, k, /*margin=*/1);  // of rounding
        const auto [skip, skip_to] = row_in(before, j, k, /*margin=*/-1);
        for (int i = std::max(low.x(), first); i <= std::min(high.x(), last); ++i) {
          if (i >= skip && i <= skip_to) {
            i = skip_to;
            continue;
          }
          const int n = made({i, j, k});
          if (n != kUntouched && (node(n).point - ball.center).norm() <= ball.radius) visit(n);
        }
      }
    }
  }

  /// From now on paths stay in the vessel round `route`: within 1.5 radii of its middle.
  void stay_near(const Points& route);

  /// From now on no step of a path is a shortcut of the guide, which outlives the search, and
  /// places beside it cost ten times as much.
  void follow(const Guide& guide);

  /// From the goal back to the start.
  Points path() const {
    Points points;
    for (int i = kGoal; i >= 0; i = node(i).parent) points.push_back(node(i).point);
    return points;
  }

  /// The place reached nearest to `point`.
  Vec3 nearest_reached(const Vec3& point) const {
    double least = kInfinite;
    Vec3 best = nodes_.front().point;
    for (const Node& n : nodes_) {
      const double squared_distance = (n.point - point).squaredNorm();
      if (!std::isfinite(n.cost) || squared_distance >= least) continue;
      least = squared_distance;
      best = n.point;
    }
    return best;
  }

 private:
  static constexpr int kBrick = 8, kStart = 0, kGoal = 1;
  static constexpr int kUntouched = -1;
  // Two inscribed balls on either side of a flat wall just touch, up to rounding. So points are
  // joined only if their balls overlap by more than that.
  static constexpr double kOverlap = 1.0 + 1e-6;
  static constexpr double kBesideFactor = 10.0;  // chosen
  using Brick = std::array<int, kBrick * kBrick * kBrick>;

  const Node& node(int i) const { return nodes_[static_cast<std::size_t>(i)]; }

  /// First and last grid point of a row within a ball, and so many more; first > last where none.
  std::pair<int, int> row_in(const GridBall& ball, int j, int k, int margin) const {
    const Vec3 place = (ball.center - origin_) / spacing_;
    const double reach = ball.radius / spacing_, dy = place.y() - j, dz = place.z() - k;
    const double squared = reach * reach - dy * dy - dz * dz;
    if (ball.radius < 0.0 || (margin < 0 && squared < 0.0)) return {1, 0};
    const double half = std::sqrt(std::max(0.0, squared));
    return {static_cast<int>(std::ceil(place.x() - half)) - margin,
            static_cast<int>(std::floor(place.x() + half)) + margin};
  }

  void place_along_guide(Node& n) const {
    n.arc = guide_->arc_of(n.point);
    n.beside = guide_->is_beside(n.point);
  }

  void visit_neighbours(int here) {
    const Eigen::Vector3i center = node(here).ijk;
    for (int k = -1; k <= 1; ++k) {
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          if (i != 0 || j != 0 || k != 0) visit(here, center + Eigen::Vector3i(i, j, k));
        }
      }
    }
  }

  /// The 4 x 4 x 4 grid points round a place that is itself not on the grid.
  void visit_block(int here, const Vec3& place) {
    const Eigen::Vector3i corner = place.array().floor().cast<int>() - 1;
    for (int k = 0; k < 4; ++k) {
      for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) visit(here, corner + Eigen::Vector3i(i, j, k));
      }
    }
  }

  void visit(int here, const Eigen::Vector3i& ijk) {
    if ((ijk.array() < 0).any() || (ijk.array() >= size_.array()).any()) return;
    int& there = slot(ijk);
    if (there == kUntouched) {
      there = static_cast<int>(nodes_.size());
      const Vec3 point = origin_ + spacing_ * ijk.cast<double>();
      nodes_.push_back({.point = point, .ijk = ijk, .wall = wall_.find(point, node(here).wall)});
      if (guide_ != nullptr) place_along_guide(nodes_.back());
    }
    relax(here, there);
  }

  void relax(int here, int there) {
    const Node& a = node(here);
    Node& b = nodes_[static_cast<std::size_t>(there)];
    if (a.cost >= b.cost) return;  // half of all, without a root
    const double length = (a.point - b.point).norm();
    const double r_a = a.wall.distance, r_b = b.wall.distance;
    if (!b.allowed || r_a + r_b < kOverlap * length) return;  // the wall may be between them
    if (Guide::is_shortcut(a.arc, b.arc, std::max(r_a, r_b))) return;
    const double price_a = cost_per_mm(kind_, r_a) * (a.beside ? kBesideFactor : 1.0);
    const double price_b = cost_per_mm(kind_, r_b) * (b.beside ? kBesideFactor : 1.0);
    const double cost = a.cost + 0.5 * length * (price_a + price_b);
    if (cost >= b.cost) return;
    b.cost = cost;
    b.parent = here;
    const double bound = kind_ == Cost::kRoute ? (b.point - node(kGoal).point).norm() : 0.0;
    queue_.emplace(cost + bound, there);
  }

  /// Index into nodes_ of a grid point, or kUntouched.
  int made(const Eigen::Vector3i& ijk) const {
    const Eigen::Vector3i brick = ijk / kBrick, in = ijk - kBrick * brick;
    const std::unique_ptr<Brick>& entries = slots_[brick_number(brick)];
    return entries
               ? (*entries)[static_cast<std::size_t>(in.x() + kBrick * (in.y() + kBrick * in.z()))]
               : kUntouched;
  }

  std::size_t brick_number(const Eigen::Vector3i& brick) const {
    return static_cast<std::size_t>(brick.x()) +
           static_cast<std::size_t>(bricks_.x()) *
               (static_cast<std::size_t>(brick.y()) +
                static_cast<std::size_t>(bricks_.y()) * static_cast<std::size_t>(brick.z()));
  }

  /// Index into nodes_ of a grid point, in bricks that exist where the search has been.
  int& slot(const Eigen::Vector3i& ijk) {
    const Eigen::Vector3i brick = ijk / kBrick, in = ijk - kBrick * brick;
    const std::size_t b = brick_number(brick);
    if (!slots_[b]) {
      slots_[b] = std::make_unique<Brick>();
      slots_[b]->fill(kUntouched);
    }
    return (*slots_[b])[static_cast<std::size_t>(in.x() + kBrick * (in.y() + kBrick * in.z()))];
  }

  // Cheapest first; among equals the node that was made first, so that the order is always the
  // same.
  using Entry = std::pair<double, int>;

  const NearestWall& wall_;
  double spacing_;
  Cost kind_ = Cost::kRoute;
  Vec3 origin_;
  Eigen::Vector3i size_, bricks_;
  std::vector<std::unique_ptr<Brick>> slots_;
  std::vector<Node> nodes_;
  const Guide* guide_ = nullptr;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

}  // namespace wireplan::preprocess
