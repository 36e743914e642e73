#pragma once
/// Forces of the wall on stretches of the wire, each point's force spread over its share of wire,
/// so that they do not hang on how far contact points are apart.
#include <vector>

#include "simulate/contact/contact_sample.h"

namespace wireplan::simulate {

inline Vec3 force_on_wire(const Touch& touch) {
  return touch.normal_force * touch.normal + touch.friction;
}

/// What part of a point's share of wire is nearer to the tip than `distance` [mm].
double part_within(const Touch& touch, double distance);

/// Largest norm of the sum of the wall's forces on any stretch of wire of the given length [mm].
/// Touches from proximal to distal; `sums` is memory to reuse [N].
double peak_force_on_length(const std::vector<Touch>& touches, double length,
                            std::vector<Vec3>& sums);

}  // namespace wireplan::simulate
