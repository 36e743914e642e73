#include "simulate/insertion/vessel_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wireplan::simulate {
namespace {

using preprocess::Branch;

constexpr double kForkSpan = 3.0;    // behind a fork, where its vessels are compared       [mm]
constexpr double kStumpRadii = 4.0;  // a shorter branch is a sac or a stump
constexpr double kArm = 10.0;        // of a vessel, for its direction                      [mm]
constexpr double kLike = 4.0 / 3.0;  // ratio of widths that are alike
constexpr double kWider = 1.1;       // of what two branches meet in, at least
constexpr double kOneSide = 0.17;    // sine of 10 deg: what leaves a vessel sideways is no leg
constexpr double kFromAbove = 0.5;   // sine of 30 deg: a leg may come in from above
constexpr double kTurnsIn = 15.0 * kRadPerDeg;  // at a fork is no sway of a line          [rad]

/// The point of a line that is so far along it, or its end.
Eigen::Index index_at(const Centerline& line, double arc) {
  Eigen::Index i = 0;
  while (i + 1 < line.arc_length.size() && line.arc_length(i) < arc) ++i;
  return i;
}

double radius_at(const Centerline& line, double arc) { return line.radius(index_at(line, arc)); }

Vec3 direction(const Centerline& line, double from, double to) {
  return (line.points.col(index_at(line, to)) - line.points.col(index_at(line, from))).normalized();
}

const Branch& branch_of(const std::vector<Branch>& tree, int k) {
  return tree.at(static_cast<std::size_t>(k));
}

double width_beyond(const Branch& branch) {
  return radius_at(branch.line, own_start(branch) + kForkSpan);
}

/// Radius of what a branch leaves, before the fork's ball; empty where the parent has less than
/// that before it or beyond [mm].
std::optional<double> width_before(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  if (branch.parent < 0) return {};
  const Centerline& line = branch_of(tree, branch.parent).line;
  const double span = own_start(branch) + kForkSpan,
               length = line.arc_length(line.arc_length.size() - 1);
  if (branch.parent_arc < span || branch.parent_arc + span > length) return {};
  return radius_at(line, branch.parent_arc - span);
}

/// By how much the two ways on turn at a fork from the line before it [rad].
struct ForkTurns {
  double parent = 0.0, branch = 0.0;
};

/// Empty where the parent has less than the fork's ball before it or beyond.
std::optional<ForkTurns> turns_at(const std::vector<Branch>& tree, int k) {
  if (!width_before(tree, k)) return {};
  const Branch& branch = branch_of(tree, k);
  const Centerline& line = branch_of(tree, branch.parent).line;
  const double at = branch.parent_arc, start = own_start(branch);
  const Vec3 from = direction(line, at - start - kArm, at - start);
  const auto turn = [&](const Vec3& onward) {
    return std::acos(std::clamp(from.dot(onward), -1.0, 1.0));
  };
  return ForkTurns{turn(direction(line, at + start, at + start + kArm)),
                   turn(direction(branch.line, start, start + kArm))};
}

/// Whether a branch is longer beyond its start than it is wide, and no narrower than three quarters
/// at its end, as a sac is.
bool keeps_its_width(const Branch& branch) {
  const Eigen::Index last = branch.line.points.cols() - 1;
  const double width = width_beyond(branch);
  return kLike * branch.line.radius(last) > width &&
         branch.line.arc_length(last) - own_start(branch) > width;
}

}  // namespace

std::optional<double> find_arc_on(const std::vector<Branch>& tree, int branch, const Vec3& point) {
  BranchPlace place = find_branch(tree, point);
  while (place.branch >= 0 && place.branch != branch) {
    const Branch& own = branch_of(tree, place.branch);
    place = {.branch = own.parent, .arc = own.parent_arc};
  }
  if (place.branch < 0) return {};
  return place.arc;
}

double own_start(const Branch& branch) { return branch.parent < 0 ? 0.0 : branch.line.radius(0); }

double begins_behind(const std::vector<Branch>& tree, int child) {
  const Branch& branch = branch_of(tree, child);
  const double out = branch.parent_arc + own_start(branch);
  return out + std::max(6.0, 3.0 * radius_at(branch_of(tree, branch.parent).line, out));
}

BranchPlace find_branch(const std::vector<Branch>& tree, const Vec3& point) {
  constexpr double kClearlyNearer = 0.98;  // at a fork the branch that was found first counts
  constexpr double kSurely = 1.0 + 1e-9;   // of a squared part, for rounding
  BranchPlace best{.part = std::numeric_limits<double>::infinity()};
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const Centerline& line = tree[k].line;
    const double start = own_start(tree[k]);
    BranchPlace own{.branch = static_cast<int>(k), .part = std::numeric_limits<double>::infinity()};
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      if (line.arc_length(i) < start) continue;
      const double squared = (point - line.points.col(i)).squaredNorm();
      const double radius = std::max(line.radius(i), 1e-3);
      const double most = std::min(own.part, best.part) * radius;
      if (squared > kSurely * most * most) continue;
      const double part = std::sqrt(squared) / radius;
      if (part < own.part) {
        own.part = part;
        own.arc = line.arc_length(i);
      }
    }
    if (own.part < kClearlyNearer * best.part) best = own;
  }
  return best;
}

bool ends_soon(const Centerline& line, double beyond) {
  const Eigen::Index last = line.points.cols() - 1;
  return line.arc_length(last) - beyond < kStumpRadii * line.radius(last);
}

double width_over_parent(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  const double beyond = own_start(branch) + kForkSpan;
  const double parent = radius_at(branch_of(tree, branch.parent).line, branch.parent_arc + beyond);
  return radius_at(branch.line, beyond) / std::max(parent, 1e-3);
}

bool is_stump(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  return branch.parent >= 0 && ends_soon(branch.line, own_start(branch)) && !is_cut_off(tree, k);
}

bool is_cut_off(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  if (branch.parent < 0) return false;
  const double width = width_beyond(branch);
  const std::optional<double> before = width_before(tree, k);
  return before && width >= kAortaRadius && width_over_parent(tree, k) > kLike &&
         kLike * width > *before && keeps_its_width(branch);
}

bool is_entered(const std::vector<Branch>& tree, int k) {
  const std::optional<double> before = width_before(tree, k);
  if (!before) return false;
  const Branch& branch = branch_of(tree, k);
  const Centerline& line = branch_of(tree, branch.parent).line;
  const double start = own_start(branch), at = branch.parent_arc;
  const double widths = std::min(width_beyond(branch), radius_at(line, at + start + kForkSpan));
  if (widths <= kLike * *before || !keeps_its_width(branch)) return false;
  const Vec3 onward = direction(line, at + start, at + start + kArm);
  const auto turn = [&](const Vec3& from) {
    return std::acos(std::clamp(from.dot(onward), -1.0, 1.0));
  };
  const double in = turn(direction(line, at - start - kArm, at - start));
  return in - turn(-direction(branch.line, start, start + kArm)) > kTurnsIn;
}

bool goes_on(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  if (branch.parent < 0 || is_stump(tree, k) || width_over_parent(tree, k) <= 1.0) return false;
  if (is_entered(tree, k)) return false;
  for (std::size_t other = 0; other < tree.size(); ++other) {
    const Branch& beside = tree[other];
    if (static_cast<int>(other) == k || beside.parent != branch.parent) continue;
    if (std::abs(beside.parent_arc - branch.parent_arc) > own_start(branch)) continue;
    if (!is_stump(tree, static_cast<int>(other)) && width_beyond(beside) > width_beyond(branch)) {
      return false;
    }
  }
  return true;
}

bool goes_straight_on(const std::vector<Branch>& tree, int k) {
  const std::optional<ForkTurns> turns = turns_at(tree, k);
  if (!turns || is_stump(tree, k) || width_over_parent(tree, k) < 1.0 / kLike) return false;
  return turns->branch < kTurnsIn && turns->parent > turns->branch + kTurnsIn;
}

bool runs_back(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  if (branch.parent < 0 || branch_of(tree, branch.parent).parent >= 0) return false;
  const double start = own_start(branch);
  if (branch.parent_arc > start) return false;
  const double ratio = width_over_parent(tree, k);
  if (ratio < 1.0 / kLike || ratio > kLike) return false;
  const double from = branch.parent_arc + start;
  const Vec3 onward = direction(branch_of(tree, branch.parent).line, from, from + kArm);
  return onward.dot(direction(branch.line, start, start + kArm)) < -std::cos(2.0 * kTurnsIn);
}

bool parts(const std::vector<Branch>& tree, int k) {
  const std::optional<ForkTurns> turns = turns_at(tree, k);
  const double ratio = turns ? width_over_parent(tree, k) : 0.0;
  if (ratio < 1.0 / kLike || ratio > kLike || is_stump(tree, k)) return false;
  const Branch& branch = branch_of(tree, k);
  if (bifurcation_width(tree, {.parent = branch.parent, .child = k})) return false;
  const double at = branch.parent_arc, start = own_start(branch);
  for (std::size_t b = 0; b < tree.size(); ++b) {
    const int other = static_cast<int>(b);
    if (tree[b].parent != branch.parent || std::abs(tree[b].parent_arc - at) > start) continue;
    const bool clearly_wider = goes_on(tree, other) && width_over_parent(tree, other) > kLike;
    if (clearly_wider || is_entered(tree, other)) return false;
  }
  return turns && std::min(turns->parent, turns->branch) > kTurnsIn;
}

std::optional<double> bifurcation_width(const std::vector<Branch>& tree, const Bifurcation& fork) {
  if (is_stump(tree, fork.child)) return {};
  const Branch& child = branch_of(tree, fork.child);
  const Centerline& line = branch_of(tree, fork.parent).line;
  const double at = child.parent_arc, start = own_start(child);
  const double length = line.arc_length(line.arc_length.size() - 1);
  if (at - start < kForkSpan || at + start + kForkSpan > length) return {};
  const double before = radius_at(line, at - start - kForkSpan);
  double beside = width_beyond(child), width = radius_at(line, at + start + kForkSpan);
  Vec3 leg = direction(child.line, start, start + kArm),
       wide = direction(line, at + start, at + start + kArm);
  if (fork.takes_child) {
    std::swap(beside, width);
    std::swap(leg, wide);
  }
  const Vec3 onward = direction(line, at - start - kArm, at - start);
  const double ratio = beside / std::max(before, 1e-3);
  const bool found = ratio < kLike && ratio > 1.0 / kLike &&
                     width > kWider * std::max(before, beside) && width >= kAortaRadius &&
                     leg.dot(wide) < -kOneSide && onward.dot(wide) > -kFromAbove;
  return found ? std::optional(width) : std::nullopt;
}

}  // namespace wireplan::simulate
