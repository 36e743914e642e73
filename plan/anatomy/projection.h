#pragma once
/// Angles of a C-arm that show a vessel and what leaves it in their true length.
#include <optional>

#include "preprocess/base.h"

namespace wireplan::plan {

/// Where the detector stands, seen from the patient, who lies supine and square on the table. At
/// rotation a and tilt b it is at (sin a cos b, -cos a cos b, sin b) in LPS; 0, 0 is the
/// antero-posterior view.
struct View {
  double rotation = 0.0;  // toward the patient's left (LAO); to the right (RAO) negative   [rad]
  double tilt = 0.0;      // toward the head (cranial); toward the feet (caudal) negative   [rad]
};
Vec3 detector_direction(const View& view);
View view_from(const Vec3& detector);  // any length but 0

/// How far an arm turns, either way. Assumed: what fixed arms reach in general without hitting the
/// table or the patient; a maker's own limits are wider at some angles and narrower at others.
struct ArmLimits {
  double rotation = 100.0 * kRadPerDeg;  //                                                [rad]
  double tilt = 45.0 * kRadPerDeg;       //                                                [rad]
};

struct Projection {
  View view;
  bool reachable = false;              // within the limits
  double trunk_foreshortening = 0.0;   // part of the length that is not seen, 0 to 1; without ...
  double branch_foreshortening = 0.0;  // ... the magnification of a cone of rays
};

struct Projections {
  Projection best;
  std::optional<Projection> second;
};

/// The best looks along the normal of the plane of trunk and branch, from the side that the arm
/// reaches with less rotation, the left on a tie; it may be out of reach. The second is within
/// reach, in whole degrees: where the best is within reach, at least 30 deg away from it and from
/// its mirror image, and shows the branch as long as can be, a tenth of the weight on the trunk;
/// and else both alike as long as can be. Trunk and branch within 5 deg of one line have no plane:
/// the best is then what looks across the branch with the least rotation and tilt.
Projections find_projections(const Vec3& trunk, const Vec3& branch, const ArmLimits& limits = {});

}  // namespace wireplan::plan
