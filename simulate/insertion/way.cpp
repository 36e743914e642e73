#include "simulate/insertion/way.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "preprocess/centerline/path_place.h"

namespace wireplan::simulate {
namespace {

using preprocess::Branch;
using preprocess::find_place;
using preprocess::is_on_path;
using preprocess::PathPlace;

constexpr double kSectionReach = 2.5;   // of a cross-section from its middle, in inscribed radii
constexpr double kThinWall = 0.75;      // less is no wall between two places              [mm]
constexpr double kWalk = 0.5;           // between looks for a wall                        [mm]
constexpr double kLookedAt = 20.0;      // of a wire, from the tip, for an arrival         [mm]
constexpr double kOffLumen = 5.0;       // of a wire beside the way, at least              [mm]
constexpr double kRunsBack = 20.0;      // of a wire along the way, at least ...           [mm]
constexpr double kRunsBackRadii = 4.0;  // ... or so many radii
constexpr double kTangentRadii = 1.0;   // of the way before the section ...
constexpr double kTangentSpan = 2.0;    // ... or so much give its direction              [mm]
constexpr double kEndRadii = 0.5;       // from the end of a branch is at its end
constexpr double kEndWidth = 2.0;       // radii beside its axis at most
constexpr double kForkSpan = 3.0;       // behind a fork, where its vessels are compared  [mm]
constexpr double kStumpRadii = 4.0;     // a shorter branch is a sac or a stump

std::string whole_millimetres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f mm", value);
  return text;
}

Vec3 end_of(const Centerline& line) { return line.points.rightCols<1>(); }

/// Direction of a line at its end, over the last `span` [mm].
Vec3 end_tangent(const Centerline& line, double span) {
  Eigen::Index from = line.points.cols() - 2;
  const double all = line.arc_length(line.points.cols() - 1);
  while (from > 0 && all - line.arc_length(from) < span) --from;
  return (end_of(line) - line.points.col(from)).normalized();
}

/// Whether no wall of some thickness is between two places in the lumen.
bool sees(const Lumen& lumen, const Vec3& a, const Vec3& b) {
  const int steps = static_cast<int>(std::ceil((b - a).norm() / kWalk));
  for (int i = 0; i <= steps; ++i) {
    const double t = steps == 0 ? 0.0 : static_cast<double>(i) / steps;
    if (lumen.distance(a + t * (b - a)) < -kThinWall) return false;
  }
  return true;
}

/// At the point of a line that is so far along it, or at its end.
double radius_at(const Centerline& line, double arc) {
  Eigen::Index i = 0;
  while (i + 1 < line.arc_length.size() && line.arc_length(i) < arc) ++i;
  return line.radius(i);
}

/// Where a branch's own vessel begins: beyond the ball in its parent that its line starts in.
double own_start(const Branch& branch) { return branch.parent < 0 ? 0.0 : branch.line.radius(0); }

}  // namespace

Way::Way(Centerline path, std::vector<Branch> tree)
    : path_(std::move(path)), tree_(std::move(tree)), leaves_(tree_.size(), -1.0) {
  const Eigen::Index last = path_.points.cols() - 1;
  expects(last >= 1 && path_.radius.size() == last + 1 && path_.arc_length.size() == last + 1);
  const double radius = path_.radius(last);
  section_ = {.center = path_.points.col(last),
              .normal = end_tangent(path_, std::max(kTangentSpan, kTangentRadii * radius)),
              .radius = radius};
  if (tree_.empty()) return;

  // From the target's branch up to the root.
  Place place = find_branch(section_.center);
  target_branch_ = place.branch;
  while (place.branch >= 0) {
    leaves_[static_cast<std::size_t>(place.branch)] = place.arc;
    const Branch& branch = tree_[static_cast<std::size_t>(place.branch)];
    place = {.branch = branch.parent, .arc = branch.parent_arc};
  }
}

std::vector<int> Way::branches() const {
  std::vector<int> along;
  for (int k = target_branch_; k >= 0; k = tree_[static_cast<std::size_t>(k)].parent) {
    along.insert(along.begin(), k);
  }
  return along;
}

bool Way::may_have_arrived(const Vec3& tip) const {
  constexpr double kLongestEdge = 20.0;  // of a wire; where the last look begins           [mm]
  const double reach = kSectionReach * section_.radius + kLookedAt + kLongestEdge;
  return (tip - section_.center).norm() <= reach;
}

std::optional<Vec3> Way::find_arrival(const Eigen::Ref<const Eigen::Matrix3Xd>& wire,
                                      const Lumen& lumen) const {
  const auto height = [&](Eigen::Index i) {
    return section_.normal.dot(wire.col(i) - section_.center);
  };
  double walked = 0.0;
  for (Eigen::Index i = wire.cols() - 1; i > 0 && walked < kLookedAt; --i) {
    const Vec3 edge = wire.col(i) - wire.col(i - 1);
    const double from = height(i - 1), to = height(i);
    if (from < 0.0 && to >= 0.0) {
      const Vec3 pierced = wire.col(i) - to / (to - from) * edge;
      if ((pierced - section_.center).norm() <= kSectionReach * section_.radius &&
          sees(lumen, section_.center, pierced)) {
        return pierced;
      }
    }
    walked += edge.norm();
  }
  return std::nullopt;
}

std::optional<std::string> Way::find_detour(const Eigen::Ref<const Eigen::Matrix3Xd>& wire) const {
  double furthest = 0.0, off = 0.0;
  Vec3 off_at = Vec3::Zero();
  for (Eigen::Index i = 0; i < wire.cols(); ++i) {
    const PathPlace place = find_place(wire.col(i), path_);
    if (place.from_lumen > std::max({off, kOffLumen, place.radius})) {
      off = place.from_lumen;
      off_at = wire.col(i);
    }
    const double back = furthest - place.arc;
    if (off == 0.0 && back > std::max(kRunsBack, kRunsBackRadii * place.radius)) {
      return "it runs back along the way by " + whole_millimetres(back) + " at " +
             place_text(wire.col(i)) + " mm";
    }
    furthest = std::max(furthest, place.arc);
  }
  if (off == 0.0) return std::nullopt;
  const std::string name = name_at(off_at);
  return "it lies " + whole_millimetres(off) + " outside of the way at " + place_text(off_at) +
         " mm" + (name.empty() ? "" : ", in " + name);
}

bool Way::is_wider(int branch, const Place& fork) const {
  const Branch& off = tree_[static_cast<std::size_t>(branch)];
  const Centerline& on = tree_[static_cast<std::size_t>(fork.branch)].line;
  const double beyond = own_start(off) + kForkSpan;
  return radius_at(off.line, beyond) > radius_at(on, fork.arc + beyond);
}

std::optional<Astray> Way::find_astray(const Vec3& tip) const {
  if (tree_.empty() || is_on_path(find_place(tip, path_))) return std::nullopt;
  // Up from the tip's branch to one that the way uses.
  const Place here = find_branch(tip);
  Place on_way = here;
  int left = -1;  // the branch by which the tip left the way
  while (leaves_[static_cast<std::size_t>(on_way.branch)] < 0.0) {
    left = on_way.branch;
    const Branch& branch = tree_[static_cast<std::size_t>(on_way.branch)];
    on_way = {.branch = branch.parent, .arc = branch.parent_arc};
  }
  const double leaves = leaves_[static_cast<std::size_t>(on_way.branch)];
  const bool in_branch_of_way = on_way.branch == here.branch;
  const std::string name = name_at(tip);
  if (on_way.arc > leaves && on_way.branch == target_branch_) {
    return Astray{true, "it is in " + name + ", beyond the target"};
  }
  if (on_way.arc > leaves) {
    const std::string where =
        in_branch_of_way ? "went on in " + name + ", " : "is in " + name + ", which comes ";
    return Astray{true, "it " + where + whole_millimetres(on_way.arc - leaves) +
                            " beyond the place where the way leaves " +
                            branch_name(tree_, on_way.branch)};
  }
  if (in_branch_of_way) return std::nullopt;
  if (is_wider(left, on_way)) {
    return Astray{true, "it went on in " + name + ", the wider vessel where the way leaves it " +
                            whole_millimetres(on_way.arc) + " along " +
                            branch_name(tree_, on_way.branch)};
  }
  return Astray{false, "it is in " + name + ", which leaves the way " +
                           whole_millimetres(leaves - on_way.arc) + " before " +
                           (on_way.branch == target_branch_
                                ? "the target"
                                : "the way leaves " + branch_name(tree_, on_way.branch))};
}

std::optional<int> Way::find_image_end(const Vec3& tip, const Lumen& lumen) const {
  for (std::size_t k = 0; k < tree_.size(); ++k) {
    const Centerline& line = tree_[k].line;
    const Eigen::Index last = line.points.cols() - 1;
    const Vec3 end = line.points.col(last), off = tip - end;
    const double radius = line.radius(last);
    if (off.norm() > (kEndRadii + kEndWidth) * radius) continue;
    const bool stump = line.arc_length(last) - own_start(tree_[k]) < kStumpRadii * radius;
    if (stump && tree_[k].parent >= 0) continue;
    const Vec3 ahead = end_tangent(line, std::max(kTangentSpan, radius));
    const double along = ahead.dot(off);
    if (along < -kEndRadii * radius || (off - along * ahead).norm() > kEndWidth * radius) continue;
    const bool before_target =
        static_cast<int>(k) == target_branch_ && section_.normal.dot(tip - section_.center) < 0.0;
    if (before_target || lumen.distance(end + 1.5 * radius * ahead) > 0.0) continue;
    return static_cast<int>(k);
  }
  return std::nullopt;
}

std::string Way::name_at(const Vec3& point) const {
  return tree_.empty() ? std::string() : branch_name(tree_, find_branch(point).branch);
}

Way::Place Way::find_branch(const Vec3& point) const {
  constexpr double kClearlyNearer = 0.98;  // at a fork the branch that was found first counts
  Place best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < tree_.size(); ++k) {
    const Centerline& line = tree_[k].line;
    const double start = own_start(tree_[k]);
    double own = std::numeric_limits<double>::infinity(), arc = 0.0;
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      if (line.arc_length(i) < start) continue;
      const double part = (point - line.points.col(i)).norm() / std::max(line.radius(i), 1e-3);
      if (part < own) {
        own = part;
        arc = line.arc_length(i);
      }
    }
    if (own < kClearlyNearer * least) {
      least = own;
      best = {.branch = static_cast<int>(k), .arc = arc};
    }
  }
  return best;
}

}  // namespace wireplan::simulate
