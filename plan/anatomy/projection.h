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

/// The best looks along the normal of the plane of trunk and branch; it may be out of reach. Trunk
/// and branch within 5 deg of one line have no plane: the best then looks across the branch, from
/// the front or as near to that as the arm comes, from the left at a branch from front to back. The
/// second is within reach, at least 30 deg away from the best and from its mirror image, and shows
/// the branch as long as can be, a tenth of the weight on the trunk; where the best is out of reach
/// it is anywhere, and shows both alike as long as can be.
///
/// Of views that show as much as each other, that is told which is in reach, then has less tilt,
/// less rotation, is LAO, is cranial. Views show as much where their foreshortening differs by no
/// more than half a degree of turning changes it at most: more than the noise of a line in a mesh
/// (0.01 to 0.1 deg), less than an arm shows (whole degrees). Tilts and rotations count as equal
/// within 2 deg, since noise moves a view by some times its own size where little is lost beside
/// it. A view less than half a degree beyond the limits is told at them; one less than that off the
/// patient's long axis has no rotation. So noise does not choose, unless it is at one of these
/// edges.
Projections find_projections(const Vec3& trunk, const Vec3& branch, const ArmLimits& limits = {});

}  // namespace wireplan::plan
