#pragma once
/// Shapes of real wires that were measured in a phantom, and one set of parameters for all of them.
/// For use in this folder.
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/vessel.h"
#include "simulate/insertion/trial.h"

namespace wireplan::pipeline {

/// A wire as it was reconstructed from two X-ray pictures.
struct MeasuredFrame {
  std::string recording;
  int frame = 0;          // of the recording
  bool angled = false;    // the wire with a bent tip; else the straight one
  Eigen::Matrix3Xd line;  // (3, k) proximal to distal, from the introducer's point on   [mm]
  Eigen::VectorXd sigma;  // (k) one standard deviation                                  [mm]
  simulate::Introducer entry;
  double length = 0.0;  // of the line                                                 [mm]

  std::string name() const;  // "0-bca-angle-1_030"
};

struct MeasuredWires {
  Surface phantom;
  std::vector<MeasuredFrame> frames;  // by recording, then by frame
};

/// What the simulated wires are, stated before any frame is looked at.
struct MeasuredParameters {
  double skin = 0.49;       // from phantom.stl, the outer skin of its wall, to the lumen      [mm]
  double radius = 0.445;    //                                                        [mm]
  double tip_EI = 5.0;      // up to `soft` from the tip                              [N mm^2]
  double shaft_EI = 150.0;  // from the taper's end on                                [N mm^2]
  double soft = 30.0;       //                                                        [mm]
  double taper = 80.0;      // EI grows evenly in its logarithm, in `taper_steps`     [mm]
  int taper_steps = 6;
  double bend = 66.0 * kRadPerDeg;  // of the angled wire's tip, over its last `bent`       [rad]
  double bent = 11.0;               //                                                      [mm]
  double friction = 0.05;
  double entry_at = 10.0;    // along the measured line, where the wire is taken to come in  [mm]
  double entry_span = 30.0;  // ... in the direction of the chord so far to both sides      [mm]
  double turn = 36.0 * kRadPerDeg;  // of the hub, after each `turn_after` of a push        [rad]
  double turn_after = 10.0;         //                                                      [mm]
};

simulate::Wire make_wire(const MeasuredParameters& parameters, bool angled);
Json to_json(const MeasuredParameters& parameters);

/// Reads frames.json and phantom.stl. Throws Error where one is not as it should be, with file,
/// key and expectation.
MeasuredWires read_measured_wires(const std::filesystem::path& folder,
                                  const MeasuredParameters& parameters);

/// How a computed wire lies to a measured one.
struct MeasuredError {
  double mean = 0.0;     // of the distances from the measured points to the computed wire  [mm]
  double largest = 0.0;  // both ways                                                       [mm]
  double tip = 0.0;      // between the ends                                                [mm]
  bool branch_right = false;
};

/// Both wires from the entry on. The branch is right where both ends are nearest to the same branch
/// of the tree, in its radii, or within 5 mm of each other: so much a reconstruction is unsure of
/// in soft branches, and at a fork it decides between them.
MeasuredError find_error(const Eigen::Matrix3Xd& computed, const Eigen::Matrix3Xd& measured,
                         const std::vector<preprocess::Branch>& tree);

}  // namespace wireplan::pipeline
