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

/// Finds caps by their shape alone: a flat patch of at least four triangles, roughly a disc (an
/// ellipse up to 2.2 : 1, so oblique cuts count), with a tube behind it: the section of the vessel
/// keeps its size for a radius, goes on for a diameter, and its side runs along the cap's normal.
/// The rim may be rounded as smoothing leaves it; an end rounded to a dome is no opening, nor is a
/// flat place on a vessel's side, nor a face of a body no deeper than it is wide. The lip of a
/// rounded rim, steeper than 30 degrees, stays wall. Caps are ordered by their first triangle.
/// Expects a closed, manifold surface with outward triangles.
std::vector<Opening> find_openings(const Surface& surface);

/// The opening that a wire, whose nodes (3, n) end with the tip [mm], has left through: at least
/// 1 mm of it is beyond where it comes out of the cap, a disc of 1.5 radii, which covers oval ones.
/// Looks at the last 40 mm of the wire.
std::optional<int> left_through(const std::vector<Opening>& openings,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& wire);

}  // namespace wireplan::preprocess
