#include "plan/anatomy/branch_names.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

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

/// A place of a line where one vessel ends at a fork and another begins: the ball of the fork.
struct VesselEdge {
  double before = 0.0, behind = 0.0;  // along the line                                  [mm]
  bool into_wider = false;            // the ball is the second vessel's, else the first one's
};

/// Of a branch, at the children that go on from what came before, as a brachiocephalic trunk beside
/// the carotid that its line ends in, where it comes into a wider vessel, and where it goes from
/// one leg into the other of two that meet in one.
std::vector<VesselEdge> list_edges(const std::vector<Branch>& tree, int branch) {
  std::vector<VesselEdge> edges;
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const int child = static_cast<int>(k);
    if (tree[k].parent != branch) continue;
    const auto meet = [&](bool takes_child) {
      return simulate::bifurcation_width(tree, {branch, child, takes_child}).has_value();
    };
    // Where the line goes on in the other of two legs, the ball is the wider vessel's.
    const bool into_wider = simulate::is_entered(tree, child) || meet(false) || meet(true);
    if (!into_wider && !simulate::goes_on(tree, child) && !simulate::parts(tree, child)) continue;
    const double ball = simulate::own_start(tree[k]), at = tree[k].parent_arc;
    edges.push_back(
        {into_wider ? std::max(0.0, at - ball) : at, into_wider ? at : at + ball, into_wider});
  }
  return edges;
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
  for (const VesselEdge& edge : list_edges(tree, place.branch)) {
    if (edge.before < place.arc) from = std::max(from, edge.before);
  }
  return from;
}

/// What a line is called at an arc length; empty where nobody said.
std::string name_at(const std::vector<preprocess::NamedPart>& parts, double arc) {
  std::string name;
  for (const preprocess::NamedPart& part : parts) {
    if (part.from <= arc) name = part.name;
  }
  return name;
}

/// Where the stem begins, along its line, that the vessel which begins at a place shares with
/// others, as a carotid the brachiocephalic trunk [mm]; empty where it shares none, or labels have
/// a name for it, or it is the trunk of all.
std::optional<double> stem_from(const std::vector<Branch>& tree,
                                const simulate::BranchPlace& begin) {
  constexpr double kBefore = 0.1;  // of the fork                                       [mm]
  const std::vector<VesselEdge> edges = list_edges(tree, begin.branch);
  const bool shares = std::any_of(edges.begin(), edges.end(), [&](const VesselEdge& edge) {
    return !edge.into_wider && edge.before == begin.arc;
  });
  const Branch& branch = tree[static_cast<std::size_t>(begin.branch)];
  if (!shares || !name_at(branch.parts, begin.arc - kBefore).empty()) return {};
  const double from = vessel_from(tree, {begin.branch, begin.arc - kBefore});
  if (branch.parent < 0 && from == 0.0) return {};
  return from;
}

/// Where it ends along its branch; the branch's length where it goes on to its end [mm].
double vessel_to(const std::vector<Branch>& tree, const simulate::BranchPlace& place) {
  const Centerline& line = tree[static_cast<std::size_t>(place.branch)].line;
  const Eigen::Index count = line.arc_length.size();
  double to = line.arc_length(count - 1);
  for (const VesselEdge& edge : list_edges(tree, place.branch)) {
    const double ends = edge.into_wider ? edge.before : edge.behind;
    if (ends > place.arc && edge.before >= place.arc) to = std::min(to, ends);
  }
  double own = 0.0;
  for (Eigen::Index k = 0; k < count && line.arc_length(k) < to; ++k) {
    if (line.arc_length(k) <= place.arc) own = line.radius(k);
    if (line.arc_length(k) <= place.arc || kWiderVessel * line.radius(k) > own) continue;
    const double begins = own_vessel_from(line, line.arc_length(k));
    if (begins > place.arc) to = std::min(to, begins);
  }
  return to;
}

/// Calls vessels by places in them, each by the first; keeps what it has called.
class BranchNames {
 public:
  explicit BranchNames(std::vector<Branch>& tree) : tree_(tree) {
    for (const Branch& branch : tree) told_.push_back(branch.parts);
  }

  void name(const NamedPlace& place, bool first_too) {
    if (tree_.empty() || place.name.empty()) return;
    const simulate::BranchPlace found = simulate::find_branch(tree_, place.point);
    const auto index = static_cast<std::size_t>(found.branch);
    // By the labels alone, so that the order of places does not count.
    std::vector<preprocess::NamedPart> parts = std::exchange(tree_[index].parts, told_[index]);
    const double from = vessel_from(tree_, found), to = vessel_to(tree_, found);
    const std::optional<double> stem = stem_from(tree_, {found.branch, from});
    tree_[index].parts = std::move(parts);
    if (!first_too && tree_[index].parent < 0 && from == 0.0) return;
    const std::pair vessel(found.branch, from);
    if (std::find(named_.begin(), named_.end(), vessel) != named_.end()) return;
    named_.push_back(vessel);
    if (stem && name_at(tree_[index].parts, *stem).empty()) {
      begin_part(index, {*stem, "the stem of " + place.name}, true);
    }
    // In the place of what labels call that part, if they do.
    if (to < tree_[index].line.arc_length.tail<1>().value()) {
      begin_part(index, {to, name_at(tree_[index].parts, to)}, false);
    }
    begin_part(index, {from, place.name}, true);
    // Where the vessel before was named first, that one ends behind the ball in which this begins.
    std::erase_if(tree_[index].parts, [&](const preprocess::NamedPart& part) {
      return part.name.empty() && part.from > from && part.from < to;
    });
    // A part that begins in the ball of a fork, and again behind it, is one.
    std::vector<preprocess::NamedPart>& named = tree_[index].parts;
    const auto same_name = [](const auto& a, const auto& b) { return a.name == b.name; };
    named.erase(std::unique(named.begin(), named.end(), same_name), named.end());
  }

 private:
  void begin_part(std::size_t index, const preprocess::NamedPart& part, bool instead) {
    std::vector<preprocess::NamedPart>& parts = tree_[index].parts;
    const auto same = [&](const preprocess::NamedPart& other) { return other.from == part.from; };
    if (!instead && std::any_of(parts.begin(), parts.end(), same)) return;
    std::erase_if(parts, same);
    const auto next = std::find_if(parts.begin(), parts.end(),
                                   [&](const auto& other) { return other.from > part.from; });
    parts.insert(next, part);
  }

  std::vector<Branch>& tree_;
  std::vector<std::vector<preprocess::NamedPart>> told_;  // by labels
  std::vector<std::pair<int, double>> named_;             // branch, and where the vessel begins
};

/// Whether labels tell what vessel a place is in.
bool is_named(const std::vector<Branch>& tree, const Vec3& point) {
  if (tree.empty()) return false;
  const simulate::BranchPlace place = simulate::find_branch(tree, point);
  return !name_at(tree[static_cast<std::size_t>(place.branch)].parts, place.arc).empty();
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
