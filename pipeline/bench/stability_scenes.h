#pragma once
/// Wires that `bench stability` bends without a wall, and tools in one another. For use in this
/// folder.
#include <cmath>
#include <string>
#include <vector>

#include "preprocess/base.h"
#include "simulate/insertion/tool_bench.h"

namespace wireplan::pipeline {

inline constexpr double kNPerMmFromNPerM = 1e-3, kNPerMm3FromNPerM3 = 1e-9;
inline constexpr double kGravity = 9810.0;  // [mm/s^2]
// The grid of the paper's coefficients.
inline const std::vector<double> kBend = {1e-2, 1e-1, 1e0, 1e1, 1e2,
                                          1e3,  1e4,  1e5, 1e6, 1e7};  // [N/m]
inline const std::vector<double> kStretch = {1e6,  1e7,  1e8,  1e9, 1e10,
                                             1e11, 1e12, 1e13, 1e14};  // [N/m^3]

/// A wire clamped level at its proximal end, from its straight shape.
struct StaticScene {
  std::string name{}, group{};
  double bend = 1e2;            // k_b of the stiffest part                            [N/m]
  double stretch = 1e10;        // k_s of the stiffest part                            [N/m^3]
  double ratio = 1.0;           // stiffest to softest part, bending and stretching alike
  int soft_part = 0;            // third of the wire that is soft: 0 tip, 1 middle, 2 base
  double element_length = 2.0;  //                                                     [mm]
  int nodes = 21;
  double gravity = kGravity;  // along -y                                            [mm/s^2]
  double load_across = 0.0;   // at the tip, along -y, in EI/L^2 of the stiffest part
  double load_along = 0.0;    // at the tip, along -x, in EI/L^2
  double squeeze = 0.0;       // distal end clamped too, nearer by this part of the length

  double length() const { return element_length * (nodes - 1); }
  double EI() const { return bend * kNPerMmFromNPerM * std::pow(element_length, 3); }
  double EA() const { return 2.0 * stretch * kNPerMm3FromNPerM3 * std::pow(element_length, 3); }
  Vec3 tip_force() const {
    return EI() / (length() * length()) * Vec3(-load_along, -load_across, 0.0);
  }
};

std::vector<StaticScene> static_scenes();

/// A curved catheter over a curved wire out of an introducer: pushed on in turns, then each turned
/// all round.
struct CoaxialScene {
  std::string name{};
  double ratio = 1.0;    // EI of the catheter to that of the wire, whose product is given
  double overlap = 0.1;  // of the two at the start                                      [mm]
  double step = 2.0;     // of a push                                                    [mm]
  bool in_tube = false;  // the S-tube of `bench throughput`, with friction 0.2; else no wall

  int nodes() const;  // where the tools are furthest in
};

std::vector<CoaxialScene> coaxial_scenes();
simulate::ToolScene tool_scene_of(const CoaxialScene& scene);

}  // namespace wireplan::pipeline
