#pragma once
/// Where a closed vessel surface is open: the flat caps at which arteries were cut, by the border
/// of the volume or by whoever made the surface. A wire may leave through them.
#include <optional>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

struct Opening {
  Vec3 center = Vec3::Zero();   // of the cap's area                                      [mm]
  Vec3 normal = Vec3::UnitZ();  // unit, out of the vessel
  double radius = 0.0;          // of the disc of equal area                              [mm]
  std::vector<int> triangles;   // of the cap, ascending
};

/// Finds caps by their shape alone. A cap is a flat patch of at least four triangles
///   - that is roughly a disc: an ellipse up to 2.2 : 1, so that oblique cuts count;
///   - with a tube behind it: the vessel's section keeps its size for a radius and goes on for a
///     diameter, and its side runs along the cap's normal.
/// So these are no openings: an end rounded to a dome, a flat place on a vessel's side, a face of a
/// body no deeper than it is wide. The rim may be rounded as smoothing leaves it; its lip, steeper
/// than 30 degrees, stays wall. Caps are ordered by their first triangle. Expects a closed,
/// manifold surface with outward triangles.
std::vector<Opening> find_openings(const Surface& surface);

/// Length of wire, from its tip, that left_through() looks at [mm].
inline constexpr double kLookedAt = 40.0;

/// The opening through which a wire has left, if any. It has left if it crosses the cap's plane
/// outward within 1.5 radii of the cap's centre (which covers oval caps), and 1 mm or more of wire
/// lies beyond that crossing. The wire's nodes (3, n) end with the tip [mm]; the last `kLookedAt`
/// of it are looked at.
std::optional<int> left_through(const std::vector<Opening>& openings,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& wire);

/// Whether the tip is near enough to an opening for that; else the wire has left through none.
bool may_have_left(const std::vector<Opening>& openings, const Vec3& tip);

}  // namespace wireplan::preprocess
