#pragma once
/// What the way, the arm and the devices are held against before a wire is pushed.
#include <array>

#include "plan/anatomy/projection.h"

namespace wireplan::plan {

/// A size, and whether it is a default of ours that nobody gave.
struct Size {
  double value = 0.0;  //                                                                  [mm]
  bool assumed = true;
};

struct AccessLimits {
  Size device_diameter = {1.667};  // of the widest that goes along the whole way; a 5 F catheter,
                                   // 1 F being a third of a millimetre
  Size sheath_diameter = {2.7};    // outer; a 6 F introducer: 2 F more than it takes
  Size sheath_length = {110.0};    // of the way that it lies in: a short introducer
  double max_sheath_ratio = 1.05;  // sheath over lumen; references-2 N                     [-]
  /// Where mild, moderate and severe begin: centerline over chord, and the angle between the arms
  /// of the sharpest bend. Reporting standards for iliac access; references-2 N.
  std::array<double, 3> tortuosity = {1.25, 1.5, 1.6};                                  // [-]
  std::array<double, 3> angle = {160 * kRadPerDeg, 120 * kRadPerDeg, 90 * kRadPerDeg};  // [rad]
  double calcium_hu = 800.0;        // above the contrast of the lumen, assumed              [HU]
  double calcium_within = 2.0;      // of the lumen, assumed                                 [mm]
  Size catheter_length = {1000.0};  // that is to come off the wire while its tip stays, where the
                                    // first plan has none of its own
  Size working_length = {100.0};    // of wire to hold behind it
  ArmLimits arm;
};

/// 0 none, 1 mild, 2 moderate, 3 severe: how many of the thresholds, each further from harmless
/// than the one before, a value has reached.
int grade_of(double value, const std::array<double, 3>& thresholds);

}  // namespace wireplan::plan
