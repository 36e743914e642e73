#pragma once
/// Coulomb's friction between wire and wall.
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "simulate/contact/contact_points.h"
#include "simulate/contact/contact_sample.h"
#include "simulate/wall/lumen.h"

namespace wireplan::simulate {

/// Where a point is, from where friction holds it, along the wall.
struct Rubbing {
  double length;                    //                                                    [mm]
  Vec3 toward;                      // unit
  double limit;                     // friction's largest force                           [N]
  double energy, slope, curvature;  // of the potential per `limit`
};

/// What friction did to a point from one equilibrium to the next.
struct RubbedPoint {
  int point;
  Vec3 force;   // its mean on the wire                                                   [N]
  double work;  // of the point against it                                             [N mm]
};

/// Each point is held to an anchor; the force grows smoothly to the coefficient times the normal
/// force over the slip, then the anchor is to follow. That has no potential, since the normal force
/// and the normal depend on the state; with those of a lag, a state of before, it has one.
///
/// In a solve: begin() with what was predicted; find_rubbing() in each state and after each change
/// of the lag, before anything is asked of that state; settle() in the equilibrium.
class Friction {
 public:
  Friction(double coefficient, double slip, int points);
  bool acts() const { return coefficient_ > 0.0; }
  /// Of the coefficient, per point; to be set where it is not all.
  Eigen::VectorXd& parts() { return part_; }

  // ---- the lag

  /// Normal forces, per point, of the state that the next solve starts from [N].
  void predict(const Eigen::VectorXd& normal_force) { lag_.force = normal_force; }
  void predict_nothing() { lag_.force.setZero(); }
  /// Points that have a predicted force rub along the wall where they are now, unless that is
  /// further from the wire's axis than `near` by a millimetre.
  void begin(const ContactPoints& points, const ContactSample& sample, const Lumen& lumen,
             double near);
  /// Takes the lag from the sample, whose rubbing is known; `fully`: and nothing of the one before.
  /// Returns whether nothing of it is left.
  bool refresh(const ContactSample& sample, bool fully);
  void save() { saved_ = lag_; }
  void restore() { lag_ = saved_; }

  // ---- in the state that the points are in

  void find_rubbing(const ContactPoints& points, const ContactMemory& memory);
  const Rubbing& rubbing(int point) const { return rubbing_[static_cast<std::size_t>(point)]; }
  /// Of the potential [N mm].
  double energy() const;
  /// Force on the point [N].
  Vec3 force(int point) const {
    return -(rubbing(point).limit * rubbing(point).slope) * rubbing(point).toward;
  }
  /// Size of the force per normal force on the point, if the lag is the state's own.
  double per_normal_force(int point) const { return coefficient(point) * rubbing(point).slope; }

  /// Has points that slipped remember so: one that rubbed keeps its anchor the slip behind it, one
  /// that does not touch, where it is. Returns the heat, the friction now times the way that the
  /// anchors went [N mm].
  double settle(const ContactPoints& points, ContactMemory& memory) const;

  /// What friction did since the last settle(), as each point went straight from where it was and
  /// its normal force changed evenly: the mean force on it, and what the point put into friction,
  /// as heat and in its hold on the anchor [N mm]. Replaces what is in `rubbed`.
  void find_rubbed(const ContactPoints& points, const ContactMemory& memory,
                   std::vector<RubbedPoint>& rubbed) const;

  /// Adds gradient and Hessian of the potential to a sink of elements.h.
  template <class Sink>
  void add(const ContactPoints& points, Sink& sink) const;

 private:
  double coefficient(int point) const {
    return part_.size() > 0 ? coefficient_ * part_[point] : coefficient_;
  }

  double coefficient_, slip_;
  Eigen::VectorXd part_;  // per point, of the coefficient; empty: all

  struct Lag {
    Eigen::VectorXd force;    // normal, per point                                          [N]
    Eigen::Matrix3Xd normal;  // per point, unit
    std::vector<int> points;  // that rub: those that have both
  };
  Lag lag_, saved_;
  std::vector<int> kept_;         // scratch
  std::vector<Rubbing> rubbing_;  // per point, of those that rub
};

template <class Sink>
void Friction::add(const ContactPoints& points, Sink& sink) const {
  for (const int k : lag_.points) {
    const Rubbing& r = rubbing(k);
    const Vec3& t = r.toward;  // 0 at the anchor, where friction is as stiff to all sides
    const Vec3 force = (r.limit * r.slope) * t;
    points.add_gradient(sink, k, force);
    if constexpr (Sink::kHessian) {
      const Vec3 normal = lag_.normal.col(k);
      const double across = r.length > 0.0 ? r.slope / r.length : r.curvature;
      points.add_hessian(sink, k, force, [&](int row, int column) {
        const double along = t[row] * t[column], off = normal[row] * normal[column],
                     own = row == column ? 1.0 : 0.0;
        return r.limit * (r.curvature * along + across * (own - along - off));
      });
    }
  }
}

}  // namespace wireplan::simulate
