#include "simulate/insertion/way.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace wireplan::simulate {
namespace {

using preprocess::Branch;
using preprocess::find_place;
using preprocess::is_on_path;
using preprocess::PathPlace;

constexpr double kSectionReach = 4.0;   // of a flat cross-section from its middle, in radii
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
  BranchPlace place = find_branch(tree_, section_.center);
  target_branch_ = place.branch;
  while (place.branch >= 0) {
    leaves_[static_cast<std::size_t>(place.branch)] = place.arc;
    const Branch& branch = tree_[static_cast<std::size_t>(place.branch)];
    place = {.branch = branch.parent, .arc = branch.parent_arc};
  }
  double widest = 0.0;
  for (std::size_t k = 0; k < tree_.size(); ++k) {
    const int parent = tree_[k].parent;
    if (parent < 0 || tree_[k].parent_arc > leaves_[static_cast<std::size_t>(parent)]) continue;
    const Bifurcation fork{parent, static_cast<int>(k), leaves_[k] >= 0.0};
    const std::optional<double> width = bifurcation_width(tree_, fork);
    if (!width || *width <= widest) continue;
    widest = *width;
    bifurcation_ = fork;
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

std::optional<Eigen::Index> Way::find_arrival(const Eigen::Ref<const Eigen::Matrix3Xd>& wire,
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
        return i - 1;
      }
    }
    walked += edge.norm();
  }
  return std::nullopt;
}

bool Way::passes_by(const Vec3& point) const {
  const std::optional<Astray> astray = find_astray(point);
  return astray && astray->passed_by;
}

std::optional<std::string> Way::find_detour(const Eigen::Ref<const Eigen::Matrix3Xd>& wire,
                                            bool knee) const {
  double furthest = 0.0, off = 0.0;
  Vec3 off_at = Vec3::Zero();
  for (Eigen::Index i = 0; i < wire.cols(); ++i) {
    const PathPlace place = find_place(wire.col(i), path_);
    const bool beside = place.from_lumen > std::max({off, kOffLumen, place.radius});
    if (beside && !is_in_own_vessel(wire.col(i), place) && !(knee && passes_by(wire.col(i)))) {
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

bool Way::is_across(const OffWay& place) const {
  if (!bifurcation_ || place.on_way.branch != bifurcation_->parent) return false;
  if (!bifurcation_->takes_child) return place.left == bifurcation_->child;
  // The parent itself goes on across it, and what leaves it there.
  return place.on_way.arc > tree_[static_cast<std::size_t>(bifurcation_->child)].parent_arc &&
         place.tip.branch != bifurcation_->child;
}

int Way::next_branch(int branch) const {
  const std::vector<int> along = branches();
  const auto found = std::find(along.begin(), along.end(), branch);
  expects(found != along.end() && found + 1 != along.end());
  return *(found + 1);
}

std::optional<Way::OffWay> Way::find_off_way(const Vec3& tip, const PathPlace& on_path) const {
  const BranchPlace here = find_branch(tree_, tip);
  // Beside the way's balls the lumen may be oval, unless the tip is in another vessel's there.
  const double here_leaves = leaves_[static_cast<std::size_t>(here.branch)];
  const bool off_way = here_leaves < 0.0 || here.arc > here_leaves + on_path.radius;
  const bool in_other = off_way && here.part <= 1.0 && on_path.from_lumen > 0.0;
  if (is_on_path(on_path) && !in_other) return std::nullopt;
  // Up from the tip's branch to one that the way uses.
  OffWay place{.tip = here, .on_way = here};
  while (leaves_[static_cast<std::size_t>(place.on_way.branch)] < 0.0) {
    place.left = place.on_way.branch;
    const Branch& branch = tree_[static_cast<std::size_t>(place.left)];
    place.on_way = {.branch = branch.parent, .arc = branch.parent_arc};
  }
  const bool behind = place.on_way.arc > leaves_[static_cast<std::size_t>(place.on_way.branch)];
  if (place.left < 0 && !behind && !is_across(place)) return std::nullopt;
  return place;
}

std::optional<Astray> Way::find_astray(const Vec3& tip) const {
  if (tree_.empty()) return std::nullopt;
  const std::optional<OffWay> place = find_off_way(tip, find_place(tip, path_));
  if (!place) return std::nullopt;
  const auto& [here, on_way, left] = *place;
  const double leaves = leaves_[static_cast<std::size_t>(on_way.branch)];
  const bool in_branch_of_way = on_way.branch == here.branch;
  const bool in_targets = on_way.branch == target_branch_;
  const std::string name = branch_name(tree_, here.branch, here.arc);
  const auto name_of_start = [&](int k) {
    return branch_name(tree_, k, own_start(tree_[static_cast<std::size_t>(k)]));
  };
  const std::string other_way = ", beyond the place where the way turns the other way, into ";
  if (is_across(*place)) {
    return Astray{.text = "it is in " + name + ", across the bifurcation"};
  }
  if (on_way.arc > leaves && in_targets) {
    return Astray{.beyond_target = true, .text = "it is in " + name + ", beyond the target"};
  }
  if (on_way.arc > leaves) {
    const int taken = next_branch(on_way.branch);
    const std::string next = name_of_start(taken);
    if (parts(tree_, taken)) {
      return Astray{.text = "it is in " + name + ", " + whole_millimetres(on_way.arc - leaves) +
                            " beyond the fork where the way goes on in " + next};
    }
    if (is_entered(tree_, taken)) {
      return Astray{.text = "it is in " + name + other_way + next};
    }
    if (goes_on(tree_, taken)) {
      return Astray{.text = "it is in " + name + ", where the way goes on in " + next +
                            ", the wider vessel"};
    }
    const std::string where =
        in_branch_of_way ? "went on in " + name + ", " : "is in " + name + ", which comes ";
    return Astray{.passed_by = true,
                  .text = "it " + where + whole_millimetres(on_way.arc - leaves) +
                          " beyond the place where the way turns into " + next};
  }
  if (is_entered(tree_, left)) {
    return Astray{.text = "it is in " + name + other_way +
                          branch_name(tree_, on_way.branch, begins_behind(tree_, left))};
  }
  if (goes_on(tree_, left) && !parts(tree_, left)) {
    return Astray{.passed_by = true,
                  .text = "it went on in " + name + ", the wider vessel where the way turns into " +
                          branch_name(tree_, on_way.branch, begins_behind(tree_, left))};
  }
  return Astray{.text = "it is in " + name + ", which leaves the way " +
                        whole_millimetres(leaves - on_way.arc) + " before " +
                        (in_targets
                             ? "the target"
                             : "the way turns into " + name_of_start(next_branch(on_way.branch)))};
}

bool Way::is_in_own_vessel(const Vec3& point, const PathPlace& on_path) const {
  return !tree_.empty() && !find_off_way(point, on_path);
}

double Way::find_progress(const Vec3& tip) const {
  const PathPlace place = find_place(tip, path_);
  return is_on_path(place) || is_in_own_vessel(tip, place) ? place.arc : 0.0;
}

Vec3 Way::direction_at(const Vec3& point) const {
  const Centerline* line = &path_;
  double arc = 0.0;
  if (tree_.empty()) {
    arc = find_place(point, path_).arc;
  } else {
    const BranchPlace place = find_branch(tree_, point);
    line = &tree_[static_cast<std::size_t>(place.branch)].line;
    arc = place.arc;
  }
  // The points of the line next to a radius behind and before it.
  const auto* arcs = line->arc_length.data();
  const Eigen::Index last = line->arc_length.size() - 1;
  const auto at = [&](double length) {
    return std::clamp<Eigen::Index>(
        std::lower_bound(arcs, arcs + line->arc_length.size(), length) - arcs, 0, last);
  };
  const double radius = line->radius[at(arc)];
  Eigen::Index from = at(arc - radius), to = at(arc + radius);
  if (from == to) (from > 0 ? from : to) += from > 0 ? -1 : 1;
  return (line->points.col(to) - line->points.col(from)).normalized();
}

std::optional<int> Way::find_image_end(const Vec3& tip, const Lumen& lumen) const {
  for (std::size_t k = 0; k < tree_.size(); ++k) {
    const Centerline& line = tree_[k].line;
    const Eigen::Index last = line.points.cols() - 1;
    const Vec3 end = line.points.col(last), off = tip - end;
    const double radius = line.radius(last);
    if (off.norm() > (kEndRadii + kEndWidth) * radius) continue;
    if (is_stump(tree_, static_cast<int>(k))) continue;
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
  if (tree_.empty()) return {};
  const BranchPlace place = find_branch(tree_, point);
  return branch_name(tree_, place.branch, place.arc);
}

std::string Way::name_of_end(int branch) const {
  const Centerline& line = tree_.at(static_cast<std::size_t>(branch)).line;
  return branch_name(tree_, branch, line.arc_length[line.arc_length.size() - 1]);
}

}  // namespace wireplan::simulate
