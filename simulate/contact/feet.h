#pragma once
/// Where contact points stand on a wall that yields.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulate/contact/contact_sample.h"
#include "simulate/wall/vessel_model.h"

namespace wireplan::simulate {

/// A point's foot is the place on the surface where its force acts: on the line from the point
/// along the field's gradient. Feet depend on the state in a way that has no potential, so they lag
/// like friction: they stay where they are until they are refreshed.
class Feet {
 public:
  /// Keeps a reference to the locator.
  Feet(const TriangleLocator& locator, int points);

  /// No point has a foot, none is held.
  void forget();
  /// From now until all are forgotten, a foot is refreshed only where its point has moved by more
  /// than a quarter of a millimetre since it was found.
  void hold() { held_ = true; }
  bool held() const { return held_; }

  const SurfacePoint& of(int point) const { return lag_.place[static_cast<std::size_t>(point)]; }
  bool has(int point) const { return of(point).triangle >= 0; }
  /// Finds the foot of a point, from the one it has, else from `triangle` [of each point].
  void find(const ActivePoint& active, const std::vector<std::int32_t>& triangle);
  /// The same of the active points, but for those held. Returns whether there was any.
  bool refresh(const ContactSample& sample, const std::vector<std::int32_t>& triangle);
  void save() { saved_ = lag_; }
  void restore() { lag_ = saved_; }

  /// How the weights of an active point's foot change as the point moves: the line to it turns
  /// along with the gradient [1/mm].
  Mat3 weight_slopes(const ActivePoint& active, const SurfacePoint& foot) const;

 private:
  const TriangleLocator& locator_;
  bool held_ = false;
  struct Lag {
    std::vector<SurfacePoint> place;
    Eigen::Matrix3Xd found_from;  // the point's position then                              [mm]
  };
  Lag lag_, saved_;
};

}  // namespace wireplan::simulate
