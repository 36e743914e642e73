#pragma once
/// Questions to the tree of the vessel's branches: in which of them a point is, where a branch's
/// own vessel begins, and which one goes on where a vessel forks.
#include <optional>
#include <vector>

#include "preprocess/centerline/centerline.h"

namespace wireplan::simulate {

struct BranchPlace {
  int branch = 0;
  double arc = 0.0;   // along its line                                                    [mm]
  double part = 0.0;  // distance from its middle there, in radii: 1 and less is inside    [-]
};

/// The branch in whose own vessel a point is deepest. Expects a tree.
BranchPlace find_branch(const std::vector<preprocess::Branch>& tree, const Vec3& point);

/// Along a branch's line the place that a point is at, or that the branch is left at by what leads
/// to the point's vessel; empty where it is in no branch of these [mm]. Expects a tree.
std::optional<double> find_arc_on(const std::vector<preprocess::Branch>& tree, int branch,
                                  const Vec3& point);

/// Where a branch's own vessel begins: beyond the ball in its parent that its line starts in [mm].
double own_start(const preprocess::Branch& branch);

/// Where the vessel that a line goes on in has begun behind a child that leaves it there and is the
/// wider of the two, along the line [mm]: three radii beyond the ball in which they part, 6 mm at
/// least, since labels do not end at an ostium to the millimetre.
double begins_behind(const std::vector<preprocess::Branch>& tree, int child);

inline constexpr double kAortaRadius = 6.0;  // of what is taken for an aorta, at least    [mm]

/// Whether a vessel ends within two of its diameters beyond that place of its line [mm]: the sac of
/// an aneurysm or a stump, no artery.
bool ends_soon(const Centerline& line, double beyond);

/// Whether a branch does so beyond its start, and is no vessel that was cut off. The root does not.
bool is_stump(const std::vector<preprocess::Branch>& tree, int k);

/// Whether a branch is a great vessel that the image cuts off, as a CT of the neck does the
/// ascending aorta: of 6 mm radius beyond its start and three quarters of that at its end, by its
/// radius long, three quarters as wide as its parent before the fork or wider, and by a third wider
/// than that beyond. All assumed.
bool is_cut_off(const std::vector<preprocess::Branch>& tree, int k);

/// How wide a branch is beyond its start over how wide its parent is as far beyond the fork: what
/// is beyond the fork is compared, since the ball in it belongs to both. Expects a branch with a
/// parent.
double width_over_parent(const std::vector<preprocess::Branch>& tree, int k);

/// Whether the line that a branch leaves comes there out of a side branch into a wider vessel, as
/// from an arm or a renal artery into the aorta: the branch is one way of that vessel and what the
/// line goes on in the other, both wider by a third than the line before, of which there is more
/// than the fork's ball. They are in line, by 15 deg or more straighter than the line turns there,
/// so two iliac arteries of unlike width are none; and the branch is longer than it is wide.
bool is_entered(const std::vector<preprocess::Branch>& tree, int k);

/// Whether a branch is the vessel that goes on where it leaves its parent, though the tree's line
/// turns into a smaller one there: wider than the parent beyond the fork and than all others that
/// leave it within the same ball, no stump, and not one way of a vessel that is entered there.
bool goes_on(const std::vector<preprocess::Branch>& tree, int k);

/// Whether a branch goes straight on where the line that it leaves turns off, by 15 deg or more
/// than that, and is no narrower than by a quarter, as an internal carotid artery beside the
/// external.
bool goes_straight_on(const std::vector<preprocess::Branch>& tree, int k);

/// Whether a branch is the other way of the vessel that the root begins in: it leaves the root's
/// first ball straight back, within 30 deg, and is of like width.
bool runs_back(const std::vector<preprocess::Branch>& tree, int k);

/// Whether the vessel that a branch leaves parts there into two of like width, within a third,
/// which both turn from it by 15 deg or more, as an aorta into two iliac arteries; two legs that
/// meet (below) do not part.
bool parts(const std::vector<preprocess::Branch>& tree, int k);

/// A fork of two branches of like width, within a third, that come from one side and meet in a
/// wider vessel of 6 mm radius or more: to a way from a femoral artery that of the aorta.
struct Bifurcation {
  int parent = -1, child = -1;  // of the tree, that part there ...
  bool takes_child = false;     // ... and which of them a way goes on in
};

/// Where `child` leaves its parent at such a fork, and a way along the parent goes on in the one or
/// the other: the radius of what they meet in [mm]. Empty where it is none.
std::optional<double> bifurcation_width(const std::vector<preprocess::Branch>& tree,
                                        const Bifurcation& fork);

}  // namespace wireplan::simulate
