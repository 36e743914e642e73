#pragma once
/// Where a wire runs through itself: its elements do not feel each other.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::simulate {

/// Parts of a wire that are nearer to each other than it is thick.
struct SelfCrossing {
  double distance = 0.0;        // between their axes                                  [mm]
  double from_tip = 0.0;        // along the wire, of the part that is nearer to it ...  [mm]
  double other_from_tip = 0.0;  // ... and of the other                                [mm]
  Vec3 point = Vec3::Zero();    // in the middle between them                          [mm]
  double insertion = 0.0;       // of a wire that is pushed in, when it was found      [mm]
};

/// "the wire crosses itself at (1.0, 2.0, 3.0) mm: what is 12.0 and 80.1 mm behind its tip comes
/// within 0.21 mm, and the wire is 0.36 mm thick"
std::string describe_crossing(const SelfCrossing& crossing, double radius);

/// Looks for it again and again without new memory.
///
/// Most wires are told apart by how much they turn. A curve that turns by no more than
/// theta < 180 degrees between two of its points has them at least its length times cos(theta/2)
/// apart (of all such curves an arc folded once is the nearest; Schur's theorem). Only stretches
/// for which that leaves it open, and whose boxes are near each other, are measured.
class CrossingFinder {
 public:
  /// The nearest two parts at least kCrossingApart, and four radii, apart along the wire, if their
  /// axes are nearer than two radii. Nodes are (3, n), proximal to distal.
  std::optional<SelfCrossing> find(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, double radius);

 private:
  struct Stretch {  // of edges
    Eigen::Index first = 0, last = 0;
    Vec3 low, high;  // of its box                                                          [mm]
  };
  bool may_meet(Eigen::Index first, Eigen::Index last, double apart, double distance) const;
  void compare(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const Stretch& behind,
               const Stretch& ahead, double apart, std::optional<SelfCrossing>& nearest,
               double& distance) const;

  std::vector<double> arc_;     // of each node from the first                              [mm]
  std::vector<double> turned_;  // before each edge since the first, or a little more       [rad]
  std::vector<Stretch> stretches_;
};

/// Parts of a wire nearer to each other along it are one bend [mm]. Chosen: that of the packing
/// tests of others.
inline constexpr double kCrossingApart = 2.0;

}  // namespace wireplan::simulate
