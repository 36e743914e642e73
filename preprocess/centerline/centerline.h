#pragma once
/// Closed surface -> line along the middle of the lumen from access to target, with inscribed
/// radius.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

struct CenterlineOptions {
  double grid_mm = 0.0;    // first spacing of the search grid, which is halved where the lumen
                           // is too thin for it; 0: chosen from the surface            [mm]
  double sample_mm = 0.5;  // spacing of the points handed on                           [mm]
  double beyond_mm = 0.0;  // the line goes on behind the target, along the ridge       [mm]
  /// The way from access to target if it is known, as by the levels of a volume. A route that takes
  /// a shortcut from one part of it to another, through a place where vessels touch, or leads
  /// through another vessel beside it, is then found again along it, where the surface lets it
  /// pass. Empty: the shortest route.
  std::vector<Vec3> guide = {};
};

/// Finds the line in three steps (R is the inscribed radius):
///   1. The shortest passable route (that along the guide, if there is one). A narrow place makes
///      it longer: at R = 1 mm, length counts twice.
///   2. Near this route, the path with the least sum of 1/R^2 per length (prototypes C).
///   3. Its points are moved to the ridge of the exact wall distance, and the line is smoothed.
/// Without step 1, the path of step 2 takes wide detours: in a real tree it ran through the
/// vertebral artery and the circle of Willis and not through the carotid.
/// The line starts at the point of the ridge nearest to `access` and ends at the one nearest to
/// `target`, or so much further on. Near a cap ahead or behind, which is nearer than the side, the
/// radius is that of the last point before. Expects a closed surface. Throws `Error` when access or
/// target lies outside the surface (with its distance), the two are not connected (with the place
/// nearest to the target that is reached) or the vessel ends before `beyond_mm` (with its length).
Centerline find_centerline(const Surface& surface, const Vec3& access, const Vec3& target,
                           const CenterlineOptions& options = {});

/// Where a line takes a shortcut that its guide does not, or has run in another vessel beside it
/// for long, if it does. Expects a line with points.
std::optional<Vec3> find_departure(const Surface& surface, const Centerline& line,
                                   const std::vector<Vec3>& guide);

/// A part of a branch's line, up to the next part or the end, as people call the vessel there.
struct NamedPart {
  double from = 0.0;  // where it begins                                                  [mm]
  std::string name;   // empty: nobody has named it
};

/// A line of the tree from where it leaves its parent to its end. It may run through several
/// vessels, as from a groin through the aorta into a renal artery.
struct Branch {
  Centerline line;                    // its arc length counts from the parent's middle   [mm]
  int parent = -1;                    // index of the branch it leaves; -1: from the root
  double parent_arc = 0;              // where on the parent                              [mm]
  std::vector<NamedPart> parts = {};  // in order along it; empty where nobody said
};

/// How messages, reports and viewers call a branch of a tree: "iliac artery, then aorta (branch 1)"
/// by its parts, "branch 3" without.
inline std::string branch_name(const std::vector<Branch>& tree, int k) {
  const std::string number = "branch " + std::to_string(k + 1);
  std::string names;
  for (const NamedPart& part : tree.at(static_cast<std::size_t>(k)).parts) {
    if (!part.name.empty()) names += (names.empty() ? "" : ", then ") + part.name;
  }
  return names.empty() ? number : names + " (" + number + ")";
}

/// The same of what is so far along it [mm]: "aorta (branch 1)", or "branch 1" before all parts.
inline std::string branch_name(const std::vector<Branch>& tree, int k, double arc) {
  const std::string number = "branch " + std::to_string(k + 1);
  std::string name = number;
  for (const NamedPart& part : tree.at(static_cast<std::size_t>(k)).parts) {
    if (part.from <= arc) name = part.name.empty() ? number : part.name + " (" + number + ")";
  }
  return name;
}

/// The middle of the whole lumen that is connected to `root`. Ends are found, not given:
///   1. The place that is farthest from the root, and not within 1.5 radii of a line found before,
///      is the next end.
///   2. The cheapest way (1/R^2 per length) from there to the lines found before is a branch, if it
///      is longer than the parent's radius and its own together. It begins where it last is one
///      line with one of these.
///   3. This is repeated until lines cover the lumen, so branches come farthest end first.
/// Edges of a lumen that is not round, as that of a dissected aorta, are no branches: cuts across
/// the line there, to its end, have the parent's line in them too.
/// Lines are moved to the ridge as in `find_centerline`, and end in the middle, 0.2 radii before
/// the wall ahead. A loop is cut where its two ways meet. Vessels thinner than about the search
/// grid (0.25 to 1 mm by the size of the lumen, wider from 400 ml on) are not followed. The time is
/// bounded by the grid's nodes and the number of ends. Throws `Error` when the root lies outside
/// the surface or the lumen has over 500 ends, as a body has and no vessels.
std::vector<Branch> find_tree(const Surface& surface, const Vec3& root,
                              const CenterlineOptions& options = {});

/// Unit tangent of the line at its start, pointing toward the target: the mean direction over the
/// first `span` [mm], so that the jitter of single points does not turn an introducer.
Vec3 start_tangent(const Centerline& line, double span);

}  // namespace wireplan::preprocess
