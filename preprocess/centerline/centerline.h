#pragma once
/// Closed surface -> line along the middle of the lumen from access to target, with inscribed
/// radius.
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

struct CenterlineOptions {
  double grid_mm = 0.0;    // first spacing of the search grid, which is halved where the lumen
                           // is too thin for it; 0: chosen from the surface            [mm]
  double sample_mm = 0.5;  // spacing of the points handed on                           [mm]
};

/// The shortest passable route (length counts twice where the inscribed radius R is 1 mm), along it
/// the path that is cheapest with cost 1/R^2, moved to the ridge of the exact wall distance and
/// smoothed (prototypes C). A cost of 1/R^2 alone, as there, prefers a wide detour: in a real tree,
/// the vertebral artery and the circle of Willis to the carotid. Starts at the point of the ridge
/// nearest to `access`, ends at the one nearest to `target`; the surface must be closed. Throws
/// `Error` when access or target lies outside the surface (with its distance) or the two are not
/// connected (with the place nearest to the target that is reached).
Centerline find_centerline(const Surface& surface, const Vec3& access, const Vec3& target,
                           const CenterlineOptions& options = {});

/// A vessel of the tree: from where it leaves its parent to its end.
struct Branch {
  Centerline line;        // its arc length counts from the parent's middle               [mm]
  int parent = -1;        // index of the branch it leaves; -1: it starts at the root
  double parent_arc = 0;  // where on the parent                                          [mm]
};

/// The middle of the whole lumen that is connected to `root`, ends found by themselves: from each
/// place that is farthest from the root and not yet inside 1.5 radii of a line, the cheapest way
/// with cost 1/R^2 to the lines found before, as a branch of its own where it goes on for more than
/// the parent's radius and its own. The longest first. Lines are moved to the ridge as
/// `find_centerline` does, and end in the middle, 0.2 radii before the wall ahead. A loop is cut
/// where its two ways meet. Vessels thinner than about the search grid (0.25 to 1 mm by the size of
/// the lumen) are not followed. Throws `Error` when the root lies outside the surface.
std::vector<Branch> find_tree(const Surface& surface, const Vec3& root,
                              const CenterlineOptions& options = {});

/// Unit tangent of the line at its start, pointing toward the target: the mean direction over the
/// first `span` [mm], so that the jitter of single points does not turn an introducer.
Vec3 start_tangent(const Centerline& line, double span);

}  // namespace wireplan::preprocess
