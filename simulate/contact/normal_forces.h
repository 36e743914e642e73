#pragma once
/// Normal forces between wire and wall: by the contact law, and on a wall that yields together with
/// how it gives way.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulate/contact/contact_law.h"
#include "simulate/contact/contact_points.h"
#include "simulate/contact/contact_sample.h"
#include "simulate/contact/feet.h"
#include "simulate/contact/yielding.h"
#include "simulate/wall/vessel_model.h"

namespace wireplan::simulate {

/// Every function that takes a sample wants the one that find() had last: what find() knows of it
/// beyond the forces, and its stiffness once asked for, is kept here.
class NormalForces {
 public:
  /// Keeps a reference to the vessel. Points of a wire of this radius.
  NormalForces(const ContactLaw& law, const VesselModel& vessel, double radius, int points);
  bool yielding() const { return yielding_; }

  /// What was found last, from which the next search for forces would start.
  void forget() { press_.setZero(); }
  /// First in a solve: all points get new feet.
  void begin();
  /// Finds force and yield of the active points, and both energies. On a wall that yields, points
  /// without feet get them, looked for first in `triangle` [of each point].
  void find(const ContactPoints& points, const std::vector<std::int32_t>& triangle,
            ContactSample& sample);

  // ---- the lag of the feet; find() is to follow a refresh

  void refresh_feet(const ContactSample& sample, const std::vector<std::int32_t>& triangle);
  void hold_feet() { feet_.hold(); }
  void save_feet() { feet_.save(); }
  void restore_feet();
  void remember_feet(std::vector<std::int32_t>& triangle) const;

  // ---- what Newton's method expects them to become, see WallContact::expect_after()

  void expect_nothing() { expected_.setConstant(kNoExpectation); }
  void expect(const Eigen::VectorXd& forces) { expected_ = forces; }
  void expect_after(const ContactPoints& points, const ContactSample& sample,
                    const WireMotion& motion);
  /// Per point; negative: nothing is expected [N].
  const Eigen::VectorXd& expected() const { return expected_; }

  // ---- derivatives

  /// Of the law at each active point, as the expectation says [N/mm].
  const Eigen::VectorXd& law_stiffness(const ContactPoints& points, const ContactSample& sample);
  /// Per active point, what the forces of the sample fall by in a motion, and what of that the
  /// Hessian of add() does not have [N].
  struct Change {
    const Eigen::VectorXd &all, &left_out;
  };
  Change find_change(const ContactPoints& points, const ContactSample& sample,
                     const WireMotion& motion);
  /// Adds gradient and Hessian to a sink of elements.h, see WallContact::add().
  template <class Sink>
  void add(const ContactPoints& points, const ContactSample& sample, Sink& sink);

 private:
  static constexpr double kNoExpectation = -1.0;
  void find_together(const ContactPoints& points, const std::vector<std::int32_t>& triangle,
                     ContactSample& sample);
  void couple(const std::vector<std::int32_t>& triangle, const ContactSample& sample);
  void find_stiffness(const ContactPoints& points, const ContactSample& sample);
  void find_slopes(const ContactSample& sample);
  int first_in_band(const ContactPoints& points, const ContactSample& sample, int k) const;
  template <class Visit>
  void for_each_coupling(const ContactPoints& points, const ContactSample& sample,
                         Visit&& visit) const;
  void find_folded(const ContactPoints& points, const ContactSample& sample);
  void find_fall(const ContactPoints& points, const ContactSample& sample,
                 const WireMotion& motion);

  const ContactLaw law_;
  const VesselModel& vessel_;
  const bool yielding_;
  const double radius_;
  Eigen::VectorXd expected_;      // per point                                              [N]
  bool stiffness_known_ = false;  // of the sample that find() had last, as ...
  bool slopes_known_ = false;     // ... how the compliance changes
  Eigen::VectorXd law_stiffness_;

  // The yielding wall: feet, and the coupling of those that were active.
  Feet feet_;
  bool feet_changed_ = true;  // since they were coupled
  Yielding coupling_;
  std::vector<SurfacePoint> coupled_feet_;
  std::vector<int> coupled_points_;
  std::vector<Mat3> foot_slopes_;  // of the weights of each foot over its point's motion   [1/mm]
  Eigen::VectorXd forces_;         // per active point                                      [N]
  Eigen::VectorXd folded_;         // on the diagonal, per active point: see add()          [N/mm]
  Eigen::VectorXd press_;          // per point, last found                                 [N]

  // Scratch, per active point. Of a motion: `approach_`, how far along the gradient [mm]; `fall_`,
  // of the force [N]; and what of that the Hessian leaves out.
  Eigen::VectorXd gap_, share_, displacement_, approach_, fall_, left_out_;
  Eigen::Matrix3Xd motion_;
};

template <class Sink>
void NormalForces::add(const ContactPoints& points, const ContactSample& sample, Sink& sink) {
  // Each by itself, and through the wall with its neighbours.
  if constexpr (Sink::kHessian) find_stiffness(points, sample);
  for (int k = 0; k < static_cast<int>(sample.active.size()); ++k) {
    const ActivePoint& active = sample.active[static_cast<std::size_t>(k)];
    const Vec3& n = active.wall.gradient;
    points.add_gradient(sink, active.point, -active.force * n);
    if constexpr (Sink::kHessian) {
      const double stiffness =
          yielding_ ? coupling_.stiffness(k, k) + folded_[k] : law_stiffness_[k];
      const double expected = expected_[active.point];
      const double force = expected >= 0.0 ? expected : active.force;
      points.add_hessian(sink, active.point, -force * n, [&](int r, int c) {
        return stiffness * n[r] * n[c] - force * active.wall.hessian(r, c);
      });
      for (int j = yielding_ ? first_in_band(points, sample, k) : k; j < k; ++j) {
        const ActivePoint& other = sample.active[static_cast<std::size_t>(j)];
        points.add_hessian_between(sink, active.point, n, other.point, other.wall.gradient,
                                   coupling_.stiffness(k, j));
      }
    }
  }
}

}  // namespace wireplan::simulate
