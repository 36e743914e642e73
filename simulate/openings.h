#pragma once
/// Where a closed vessel surface is open: the flat caps at which arteries were cut, by the border
/// of the volume or by whoever made the surface. A wire may leave through them.
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::simulate {

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

}  // namespace wireplan::simulate
