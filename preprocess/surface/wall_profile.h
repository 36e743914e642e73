#pragma once
/// The wall of a vessel in grey values along the surface's normals: thinner than the blur, so that
/// it shows by no value of its own, but by how much steeper or less steep the edge is than blur
/// alone leaves it.
#include <Eigen/Core>

#include "preprocess/surface/vertex_graph.h"

namespace wireplan::preprocess {

/// Grey values along the normals of vertices, from kFirst sigma of the blur on, kStep apart.
struct WallProfiles {
  static constexpr int kSamples = 16;
  static constexpr double kFirst = -2.2, kStep = 0.4;  // outward               [sigma]

  explicit WallProfiles(Eigen::Index vertices) : values(kSamples, vertices), sigma(vertices) {}

  Eigen::Matrix<float, kSamples, Eigen::Dynamic> values;  // (kSamples, n)      [HU]
  Eigen::VectorXd sigma;  // (n) of the blur along the normal, about            [mm]
};

/// Averages the profiles over neighbours as average() does values.
void average_profiles(const Neighbours& neighbours, int passes, WallProfiles& profiles);

struct WallsSeen {
  double blur = 1.0;  // its sigma found from the profiles, of what it was taken for
  /// (n) The value outside whose middle with the lumen's is what the blurred image holds at the
  /// lumen's edge; NaN where it is no darker there than soft tissue, or the lumen is not brighter
  /// than that by far.                                                                       [HU]
  Eigen::VectorXd outside;
};

/// Along a normal lie lumen L, wall W of thickness t and surroundings F, blurred by a Gaussian:
///   p(x) = L - (L - W) Phi((x - r) / s) - (W - F) Phi((x - r - t) / s),
/// so that p(r) = (L + W) / 2 - (W - F) Phi(-t / s). W is soft tissue; s is one for the scanner and
/// found first, as what suits the profiles best on the whole; L, F and r are those of least squares
/// for each t, and the value is the mean over t by likelihood and by what walls of arteries are.
WallsSeen see_walls(const WallProfiles& profiles);

}  // namespace wireplan::preprocess
