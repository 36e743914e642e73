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

}  // namespace

double own_start(const Branch& branch) { return branch.parent < 0 ? 0.0 : branch.line.radius(0); }

double begins_behind(const std::vector<Branch>& tree, int child) {
  const Branch& branch = branch_of(tree, child);
  const double out = branch.parent_arc + own_start(branch);
  return out + std::max(6.0, 3.0 * radius_at(branch_of(tree, branch.parent).line, out));
}

BranchPlace find_branch(const std::vector<Branch>& tree, const Vec3& point) {
  constexpr double kClearlyNearer = 0.98;  // at a fork the branch that was found first counts
  BranchPlace best{.part = std::numeric_limits<double>::infinity()};
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const Centerline& line = tree[k].line;
    const double start = own_start(tree[k]);
    BranchPlace own{.branch = static_cast<int>(k), .part = std::numeric_limits<double>::infinity()};
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      if (line.arc_length(i) < start) continue;
      const double part = (point - line.points.col(i)).norm() / std::max(line.radius(i), 1e-3);
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
  const double start = own_start(branch), width = width_beyond(branch);
  const Eigen::Index last = branch.line.points.cols() - 1;
  const Centerline& line = branch_of(tree, branch.parent).line;
  const double span = start + kForkSpan, length = line.arc_length(line.arc_length.size() - 1);
  if (branch.parent_arc < span || branch.parent_arc + span > length) return false;
  const double before = radius_at(line, branch.parent_arc - span);
  return width >= kAortaRadius && width_over_parent(tree, k) > kLike && kLike * width > before &&
         kLike * branch.line.radius(last) > width && branch.line.arc_length(last) - start > width;
}

bool goes_on(const std::vector<Branch>& tree, int k) {
  const Branch& branch = branch_of(tree, k);
  if (branch.parent < 0 || is_stump(tree, k) || width_over_parent(tree, k) <= 1.0) return false;
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

std::optional<double> bifurcation_width(const std::vector<Branch>& tree, const Bifurcation& fork) {
  if (is_stump(tree, fork.child)) return {};
  const Branch& child = branch_of(tree, fork.child);
  const Centerline& line = branch_of(tree, fork.parent).line;
  const double at = child.parent_arc, start = own_start(child);
  const double length = line.arc_length(line.arc_length.size() - 1);
  if (at - start < kForkSpan || at + start + kForkSpan > length) return {};
  const double before = radius_at(line, at - start - kForkSpan);
  double beside = width_beyond(child), width = radius_at(line, at + start + kForkSpan);
  Vec3 outward = direction(child.line, start, start + kArm);
  if (fork.takes_child) {
    std::swap(beside, width);
    outward = direction(line, at + start, at + start + kArm);
  }
  const Vec3 onward = direction(line, at - start - kArm, at - start);
  const double ratio = beside / std::max(before, 1e-3);
  const bool found = ratio < kLike && ratio > 1.0 / kLike &&
                     width > kWider * std::max(before, beside) && width >= kAortaRadius &&
                     outward.dot(onward) < 0.0;
  return found ? std::optional(width) : std::nullopt;
}

}  // namespace wireplan::simulate
