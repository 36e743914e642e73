#pragma once
/// The way from access to target through the vessels: whether a wire that passes the target came
/// along it, and where a tip is that did not.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/centerline/centerline.h"
#include "preprocess/centerline/path_place.h"
#include "simulate/insertion/vessel_tree.h"
#include "simulate/wall/lumen.h"

namespace wireplan::simulate {

/// The vessel's cross-section at the end of the way: a plane across it, and the lumen round its
/// middle.
struct CrossSection {
  Vec3 center = Vec3::Zero();   // on the vessel's axis                                   [mm]
  Vec3 normal = Vec3::UnitZ();  // unit, onward along the way
  double radius = 0.0;          // inscribed                                              [mm]
};

/// A tip that is in another vessel than the way, or beyond the target in its own.
struct Astray {
  bool beyond_target = false;  // it stayed in the target's vessel
  bool passed_by = false;  // it stayed in a vessel that the way leaves, the wider one at a fork, or
                           // went on from there; else it took a branch that the way does not
  std::string text;        // which vessel, and where that leaves the way
};

/// Immutable. Branches are called as `preprocess::branch_name` says.
class Way {
 public:
  /// Expects a path of two points or more from access to target. `tree` has all branches of the
  /// lumen, with the access as root; it may be empty, then no vessel is told from another.
  explicit Way(Centerline path, std::vector<preprocess::Branch> tree = {});

  const Centerline& path() const { return path_; }
  const CrossSection& section() const { return section_; }
  const std::vector<preprocess::Branch>& tree() const { return tree_; }
  /// The branches that the way goes along, from the root; empty without a tree.
  std::vector<int> branches() const;
  /// Of the aorta, where the way comes from a leg; where it passes several such forks, that into
  /// the widest vessel.
  const std::optional<Bifurcation>& bifurcation() const { return bifurcation_; }

  /// Whether a tip is near enough to the cross-section for find_arrival() to find one.
  bool may_have_arrived(const Vec3& tip) const;

  /// The last node before the cross-section, of a wire, nodes (3, n) that end with the tip, which
  /// passes it onward, inside the lumen round its middle: in a straight line from there no wall is
  /// between. The last 20 mm are looked at.
  std::optional<Eigen::Index> find_arrival(const Eigen::Ref<const Eigen::Matrix3Xd>& wire,
                                           const Lumen& lumen) const;

  /// Why a wire, as far as it is to lie on the way, did not come along it, if so: part of it lies
  /// outside of the way's lumen, by more than the way's radius there (5 mm at least) off its balls,
  /// or runs back along it by more than four radii (20 mm at least). With a `knee` it may lie in a
  /// vessel that the way leaves, as far beyond that as it likes.
  std::optional<std::string> find_detour(const Eigen::Ref<const Eigen::Matrix3Xd>& wire,
                                         bool knee = false) const;

  /// Where a tip is that is not on the way; empty for one that is. Half a radius beside the way's
  /// balls counts as on it, unless it is inside another vessel's.
  std::optional<Astray> find_astray(const Vec3& tip) const;
  /// Whether a point is in a vessel that the way leaves, beyond that: as a tip that passed by, or
  /// a catheter's knee.
  bool passes_by(const Vec3& point) const;

  /// How far along the way a tip is; 0 where it is not on it. In a flat lumen that may be far
  /// beside the balls: a tree then tells whether the tip is in a vessel of the way [mm].
  double find_progress(const Vec3& tip) const;

  /// Where the vessel that a point is in goes on, away from the access: a chord of its diameter,
  /// unit. Without a tree of the way.
  Vec3 direction_at(const Vec3& point) const;

  /// The end of the image that a tip has come to: within half a radius of where a branch ends with
  /// nothing but wall ahead. An artery goes on there in the patient, whether the model ends flat or
  /// round. Ends within two diameters of their parent are none (sacs of aneurysms, stumps), nor is
  /// what lies before the target.
  std::optional<int> find_image_end(const Vec3& tip, const Lumen& lumen) const;

  /// Of the vessel that a point is in, "branch 3" for one; empty without a tree.
  std::string name_at(const Vec3& point) const;

  /// Of the vessel that a branch ends in.
  std::string name_of_end(int branch) const;

 private:
  /// The branch of the way that it goes on in from another.
  int next_branch(int branch) const;
  /// Where a tip is that is not on the way.
  struct OffWay {
    BranchPlace tip;
    BranchPlace on_way;  // of the branch of the way that it comes from
    int left = -1;       // the branch by which it left that; -1: it is in it
  };
  /// Empty for a tip that is on the way. Expects a tree, and the tip's place on the path.
  std::optional<OffWay> find_off_way(const Vec3& tip, const preprocess::PathPlace& on_path) const;
  /// Whether a point, however far beside the way's balls, is in a vessel of the way; never without
  /// a tree.
  bool is_in_own_vessel(const Vec3& point, const preprocess::PathPlace& on_path) const;
  /// Whether it is on the other side of the bifurcation.
  bool is_across(const OffWay& place) const;

  Centerline path_;
  CrossSection section_;
  std::vector<preprocess::Branch> tree_;
  /// Per branch: where the way leaves it, for the target's branch the target's place; negative for
  /// branches that the way does not use [mm].
  std::vector<double> leaves_;
  int target_branch_ = -1;
  std::optional<Bifurcation> bifurcation_;
};

}  // namespace wireplan::simulate
