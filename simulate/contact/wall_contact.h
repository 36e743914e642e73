#pragma once
/// The wire against the wall of the vessel: where it touches, with which normal and friction
/// forces, and how the wall gives way. Part of the energy that solver.h minimises.
#include <Eigen/Core>
#include <vector>

#include "simulate/contact/contact_law.h"
#include "simulate/contact/contact_points.h"
#include "simulate/contact/contact_sample.h"
#include "simulate/contact/friction.h"
#include "simulate/contact/normal_forces.h"
#include "simulate/wall/vessel_model.h"
#include "simulate/wire/block_band.h"
#include "simulate/wire/rod.h"

namespace wireplan::simulate {

struct ContactOptions {
  ContactLaw law;
  double spacing = 1.0;         // most between two contact points; half of it near the tip     [mm]
  double friction = 0.0;        // Coulomb's coefficient
  double slip = 0.02;           // displacement along the wall that develops friction fully     [mm]
  double support_factor = 1.0;  // on the energy of the vessel's sections, where they move
};

/// Contact of one wire with one vessel: its points, their normal forces and their friction. Holds
/// what the points remember from the last equilibrium and the memory of the solves: one per trial.
///
/// Friction and the place where a force acts on the wall depend on the state in a way that has no
/// potential. Both are lagged: taken from a state of before, they have one. The solver refreshes
/// the lag as it goes, and ends only in a state whose own lag it is.
///
/// Order of calls. Once: start_at(). For each push of a trial: free_from(), predict(), a solve,
/// settle(). In a solve: begin() with its first state, then sample() with each other one, and
/// refresh(), which is of the state sampled last. These three return the sample, which stays the
/// latest() until the next of them; all that follows "latest" below is about it.
class WallContact {
 public:
  using Memory = ContactMemory;
  using Motion = WireMotion;

  /// Keeps a reference to the vessel.
  WallContact(const Rod& rod, const VesselModel& vessel, const ContactOptions& options);

  // ---- the trial's part

  /// The wire is this rod from now on: of several tools in other places, with as many nodes and as
  /// thick at most. What points remember stays.
  void take(const Rod& rod);
  /// What was looked up and found in samples: solves go then as with a new one.
  void forget();
  /// Only points nearer to the tip than this touch; those behind it are still in the introducer
  /// [mm]. At the start: all.
  void free_from(double tip_distance) { points_.free_from(tip_distance); }
  /// The vessel's sections, null where they do not move.
  const SectionChain* chain() const { return points_.chain(); }
  /// Takes the state as one in which nothing has slipped yet.
  void start_at(const RodState& state);
  /// Before a push by `distance`: each point will feel what the wire ahead of it felt.
  void predict(double distance);
  /// After an equilibrium: where friction was overcome, points have slipped. Returns the work that
  /// turned into heat since the last call [N mm].
  double settle();
  /// Before settle(): what friction did since the last one, see Friction.
  void find_rubbed(std::vector<RubbedPoint>& rubbed) const {
    friction_.find_rubbed(points_, memory_, rubbed);
  }
  const ContactPoint& point(int k) const { return points_[k]; }
  /// Points that touch in the latest sample, proximal to distal.
  const std::vector<Touch>& touches();

  /// Points that touch in the latest sample, and what the energy of contact gains there, all nodes
  /// held, per length of wire that a point stands for [N] and per length that it is thinner [N].
  struct Slope {
    int point;
    double by_share, by_thinner;
  };
  void find_slopes(std::vector<Slope>& slopes) const;

  const Memory& memory() const { return memory_; }
  void restore(const Memory& memory) {
    memory_ = memory;
    points_.forget_before();
  }

  // ---- the solver's part: samples

  const ContactSample& latest() const { return latest_; }
  ContactEnergy energy() const { return latest_.energy; }

  /// First sampling of a solve: finds which points touch in it, with the lag of the prediction.
  const ContactSample& begin(const RodState& state);
  /// Finds which points touch in the state and their forces, with the lag as it is.
  const ContactSample& sample(const RodState& state);
  /// Takes the lag from the latest sample; `fully`: and nothing of the one before. Finds the sample
  /// with that lag.
  const ContactSample& refresh(bool fully);
  /// From now to the next begin() a point's place on the yielding wall is refreshed only where the
  /// point has moved by more than a quarter of a millimetre since. The wall's stiffness has kinks
  /// along the edges of triangles, and the place jumps where these fold: a soft tip there may else
  /// find no equilibrium.
  void hold_feet() { forces_.hold_feet(); }
  /// The lag may be taken back to what it was when saved; the next sampling is with that.
  void save_lag();
  void restore_lag();
  /// Whether the lag is that of the latest sample; always so where nothing is lagged.
  bool lag_is_fresh() const { return latest_.own_lag || !has_lag(); }

  // ---- the solver's part: derivatives in the latest sample

  /// What Newton's method expects the normal forces to become. Where there is an expectation, the
  /// Hessian of add() has the contact law's mean stiffness between the force and the expected one,
  /// and the wall's curvature times the latter: Newton's method for positions and forces together.
  /// The law is quadratic where it starts; on its tangent a force that is to vanish would fall to
  /// only a quarter of itself per iteration, and a tip that was guessed too deep in the wall would
  /// make the Hessian indefinite.
  ///
  /// After a step along the motion, full or not: as the Hessian of the latest sample says.
  void expect_after(const Motion& motion) { forces_.expect_after(points_, latest_, motion); }
  /// Makes the Hessian that of the energy.
  void expect_nothing() { forces_.expect_nothing(); }

  /// Adds gradient and Hessian to a sink of elements.h. Pairs of points further apart than two
  /// nodes are left out of the Hessian, with their size added on its diagonal, so that it is
  /// positive definite where the exact one is; and so is how friction depends on the normal force:
  /// see add_remainder().
  template <class Sink>
  void add(Sink& sink) {
    forces_.add(points_, latest_, sink);
    friction_.add(points_, sink);
    if (points_.chain() == nullptr) return;
    points_.finish(sink);
    add_support(sink);
  }
  /// Adds to `product` what the Hessian of add() leaves out, times the motion: far pairs,
  /// friction's dependence on normal forces, and how the wall yields less or more where the wire
  /// slides to.
  void add_remainder(const Motion& motion, Eigen::VectorXd& product);
  /// On a wall that does not yield that is friction's dependence on normal forces alone, and lies
  /// within the band: adds it to an unsymmetric one, of the nodes from `first` on.
  void add_remainder(int first, UnsymmetricBand& band);
  bool remainder_is_banded() const { return !forces_.yielding() && friction_.acts(); }
  bool has_remainder() const { return !latest_.active.empty() && has_lag(); }

  /// Largest part of a motion that takes no point across the wall: a point may go as far as it is
  /// from the wall and a quarter of a millimetre into it, where contact pushes it back; with more
  /// looks, so far again from where that leads if it is at most as much deeper there, and so on, so
  /// that it may slide along the wall. Infinite where there is no bound.
  double largest_safe_part(const Motion& motion, int looks) const {
    return points_.largest_safe_part(motion, looks);
  }

 private:
  template <class Sink>
  void add_support(Sink& sink) const {
    for (Eigen::Index j = 0; j < support_.cols(); ++j) {
      sink.section_gradient(static_cast<int>(j), support_.col(j));
    }
    if constexpr (Sink::kHessian) {
      for (const SectionChain::Block& block : points_.chain()->stiffness()) {
        sink.section_hessian(block.i, block.j, support_factor_, block.value);
      }
    }
  }
  bool has_lag() const { return forces_.yielding() || friction_.acts(); }
  void take_parts(const Rod& rod);
  void find(const RodState& state);
  const ContactSample& rub();

  const Lumen& lumen_;
  const ContactLaw law_;
  const double radius_;
  const double felt_from_;  // distance from the wall of a wire's axis                     [mm]
  ContactPoints points_;
  NormalForces forces_;
  Friction friction_;
  ContactMemory memory_;
  ContactSample latest_;
  const double support_factor_;
  Eigen::Matrix3Xd support_;     // derivatives of the energy of the sections' support        [N]
  double support_energy_ = 0.0;  //                                                       [N mm]
  std::vector<Touch> touches_;   // scratch, as is
  Eigen::VectorXd predicted_;    // per point                                                [N]
};

}  // namespace wireplan::simulate
