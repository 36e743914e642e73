#include "plan/anatomy/branch_names.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "plan/anatomy/passage.h"
#include "preprocess/centerline/path_place.h"
#include "simulate/insertion/vessel_tree.h"

namespace wireplan::plan {
namespace {

using preprocess::Branch;

constexpr double kWiderVessel = 1.5;   // than the one that leaves it: assumed
constexpr double kMouth = 8.0;         // of a vessel, where both are one ...            [mm]
constexpr double kBeyondMouth = 20.0;  // ... and beyond it, where it has its own width  [mm]
constexpr double kLeastTrunk = 100.0;  // of an aorta, for a direction                     [mm]

/// Where the vessel begins that a line is in at an arc length: behind the last place before that is
/// half as wide again as the line beyond its mouth, and as at that place [mm]. A taper is no step.
double own_vessel_from(const Centerline& line, double arc) {
  const Eigen::Index count = line.arc_length.size();
  Eigen::Index k = count - 1;
  while (k > 0 && line.arc_length(k) > arc) --k;
  const double here = line.radius(k);
  const auto leaves_wider = [&](Eigen::Index at) {
    double beyond = 0.0;
    for (Eigen::Index i = at; i < count; ++i) {
      const double ahead = line.arc_length(i) - line.arc_length(at);
      if (ahead > kBeyondMouth) break;
      if (ahead >= kMouth) beyond = std::max(beyond, line.radius(i));
    }
    return beyond > 0.0 && line.radius(at) >= kWiderVessel * std::max(beyond, here);
  };
  while (k > 0 && !leaves_wider(k - 1)) --k;
  return line.arc_length(k);
}

/// Where the last vessel before an arc length leaves that goes on from what came before, as a
/// brachiocephalic trunk beside the carotid that its line ends in; 0 without one [mm].
double last_stem_before(const std::vector<Branch>& tree, int branch, double arc) {
  double end = 0.0;
  for (std::size_t k = 0; k < tree.size(); ++k) {
    if (tree[k].parent != branch || tree[k].parent_arc >= arc) continue;
    if (simulate::goes_on(tree, static_cast<int>(k))) end = std::max(end, tree[k].parent_arc);
  }
  return end;
}

/// Whether a place of a branch's line is in its parent's lumen still.
bool is_in_parent(const std::vector<Branch>& tree, const Branch& branch, double arc) {
  if (branch.parent < 0) return false;
  const Centerline& parent = tree[static_cast<std::size_t>(branch.parent)].line;
  return preprocess::is_on_path(preprocess::find_place(point_at(branch.line, arc), parent));
}

/// Where the vessel begins that a place is in, along its branch [mm]: not before another part of
/// the line, as labels name it, nor in a stem that it shares.
double vessel_from(const std::vector<Branch>& tree, const simulate::BranchPlace& place) {
  const Branch& branch = tree[static_cast<std::size_t>(place.branch)];
  double from = own_vessel_from(branch.line, place.arc);
  if (is_in_parent(tree, branch, from)) from = 0.0;
  for (const preprocess::NamedPart& part : branch.parts) {
    if (part.from <= place.arc) from = std::max(from, part.from);
  }
  return std::max(from, last_stem_before(tree, place.branch, place.arc));
}

/// Calls branches by places in them, each by the first; keeps what it has called.
class BranchNames {
 public:
  explicit BranchNames(std::vector<Branch>& tree) : tree_(tree), named_(tree.size(), false) {}

  void name(const NamedPlace& place, bool root_too) {
    if (tree_.empty() || place.name.empty()) return;
    const simulate::BranchPlace found = simulate::find_branch(tree_, place.point);
    const auto index = static_cast<std::size_t>(found.branch);
    Branch& branch = tree_[index];
    if (named_[index] || (!root_too && branch.parent < 0)) return;
    named_[index] = true;
    const double from = vessel_from(tree_, found);
    // In the place of what labels call that part, if they do.
    std::vector<preprocess::NamedPart>& parts = branch.parts;
    std::erase_if(parts, [&](const auto& part) { return part.from == from; });
    const auto next = std::find_if(parts.begin(), parts.end(),
                                   [&](const auto& part) { return part.from > from; });
    parts.insert(next, {from, place.name});
  }

 private:
  std::vector<Branch>& tree_;
  std::vector<bool> named_;
};

/// Whether labels tell what vessel a place is in.
bool is_named(const std::vector<Branch>& tree, const Vec3& point) {
  if (tree.empty()) return false;
  const simulate::BranchPlace place = simulate::find_branch(tree, point);
  const std::vector<preprocess::NamedPart>& parts =
      tree[static_cast<std::size_t>(place.branch)].parts;
  return !parts.empty() && parts.front().from <= place.arc;
}

}  // namespace

void name_branches(std::vector<Branch>& tree, const NamedPlace& target,
                   const std::vector<NamedPlace>& other_targets,
                   const std::vector<NamedPlace>& other_accesses) {
  BranchNames names(tree);
  NamedPlace own = target;
  if (own.name.empty() && !is_named(tree, target.point)) own.name = "the target's branch";
  names.name(own, true);
  for (const NamedPlace& place : other_targets) names.name(place, true);
  for (const NamedPlace& place : other_accesses) names.name(place, false);
}

std::optional<Vec3> find_trunk_axis(const std::vector<Branch>& tree) {
  std::vector<Vec3> wide;
  for (const Branch& branch : tree) {
    for (Eigen::Index i = 0; i < branch.line.points.cols(); ++i) {
      if (branch.line.radius(i) >= simulate::kAortaRadius)
        wide.emplace_back(branch.line.points.col(i));
    }
  }
  if (wide.size() < 2) return {};
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : wide) middle += p / static_cast<double>(wide.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : wide) spread += (p - middle) * (p - middle).transpose();
  const Vec3 axis =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().rightCols<1>();
  const auto [least, most] =
      std::minmax_element(wide.begin(), wide.end(),
                          [&](const Vec3& a, const Vec3& b) { return a.dot(axis) < b.dot(axis); });
  if ((*most - *least).dot(axis) < kLeastTrunk) return {};
  return axis;
}

}  // namespace wireplan::plan
