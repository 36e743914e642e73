#pragma once
/// Closed surface -> line along the middle of the lumen from access to target, with inscribed
/// radius.
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

/// Unit tangent of the line at its start, pointing toward the target: the mean direction over the
/// first `span` [mm], so that the jitter of single points does not turn an introducer.
Vec3 start_tangent(const Centerline& line, double span);

}  // namespace wireplan::preprocess
