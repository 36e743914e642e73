#include "simulate/contact/normal_forces.h"

#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

NormalForces::NormalForces(const ContactLaw& law, const VesselModel& vessel, double radius,
                           int points)
    : law_(law),
      vessel_(vessel),
      yielding_(vessel.compliance != nullptr),
      radius_(radius),
      feet_(vessel.locator, yielding_ ? points : 0) {
  expected_.setConstant(points, kNoExpectation);
  if (yielding_) press_.setZero(points);
}

void NormalForces::begin() {
  feet_.forget();
  feet_changed_ = true;
}

void NormalForces::find(const ContactPoints& points, const std::vector<std::int32_t>& triangle,
                        ContactSample& sample) {
  sample.energy = {};
  stiffness_known_ = slopes_known_ = false;
  if (yielding_) {
    find_together(points, triangle, sample);
    return;
  }
  for (ActivePoint& active : sample.active) {
    const double share = points[active.point].share;
    const ContactLaw::Value law = law_.at(active.wall.distance - radius_);
    sample.energy.contact += share * law.energy;
    active.force = -share * law.slope;
  }
}

/// All together through the wall that yields.
void NormalForces::find_together(const ContactPoints& points,
                                 const std::vector<std::int32_t>& triangle, ContactSample& sample) {
  couple(triangle, sample);
  const Eigen::Index m = static_cast<Eigen::Index>(sample.active.size());
  gap_.resize(m);
  share_.resize(m);
  forces_.resize(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const ActivePoint& active = sample.active[static_cast<std::size_t>(k)];
    const double expected = expected_[active.point];
    gap_[k] = active.wall.distance - radius_;
    share_[k] = points[active.point].share;
    forces_[k] = expected >= 0.0 ? expected : press_[active.point];
  }
  sample.energy.contact = coupling_.solve(law_, gap_, share_, forces_, displacement_);
  sample.energy.wall = 0.5 * forces_.dot(displacement_);
  press_.setZero();
  for (Eigen::Index k = 0; k < m; ++k) {
    ActivePoint& active = sample.active[static_cast<std::size_t>(k)];
    active.force = press_[active.point] = forces_[k];
    active.yield = displacement_[k];
  }
}

/// Has the wall know the feet of the active points. They stay where they are until refreshed.
void NormalForces::couple(const std::vector<std::int32_t>& triangle, const ContactSample& sample) {
  bool same = !feet_changed_ && sample.active.size() == coupled_points_.size();
  for (std::size_t k = 0; k < sample.active.size(); ++k) {
    const ActivePoint& active = sample.active[k];
    if (!feet_.has(active.point)) feet_.find(active, triangle);
    same = same && coupled_points_[k] == active.point;
  }
  if (same) return;
  coupled_points_.clear();
  coupled_feet_.clear();
  for (const ActivePoint& active : sample.active) {
    coupled_points_.push_back(active.point);
    coupled_feet_.push_back(feet_.of(active.point));
  }
  coupling_.set_feet(*vessel_.compliance, coupled_feet_);
  feet_changed_ = false;
}

// ---------------------------------------------------------------- the lag of the feet

void NormalForces::refresh_feet(const ContactSample& sample,
                                const std::vector<std::int32_t>& triangle) {
  if (feet_.refresh(sample, triangle)) feet_changed_ = true;
}

void NormalForces::restore_feet() {
  feet_.restore();
  feet_changed_ = true;
}

void NormalForces::remember_feet(std::vector<std::int32_t>& triangle) const {
  for (std::size_t k = 0; k < triangle.size(); ++k) {
    triangle[k] = feet_.of(static_cast<int>(k)).triangle;
  }
}

// ---------------------------------------------------------------- derivatives

const Eigen::VectorXd& NormalForces::law_stiffness(const ContactPoints& points,
                                                   const ContactSample& sample) {
  find_stiffness(points, sample);
  return law_stiffness_;
}

void NormalForces::find_stiffness(const ContactPoints& points, const ContactSample& sample) {
  if (stiffness_known_) return;
  stiffness_known_ = true;
  const Eigen::Index m = static_cast<Eigen::Index>(sample.active.size());
  law_stiffness_.resize(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const ActivePoint& active = sample.active[static_cast<std::size_t>(k)];
    const double share = points[active.point].share;
    const double gap = active.wall.distance - radius_ + active.yield;
    const double expected = expected_[active.point];
    law_stiffness_[k] =
        share * (expected >= 0.0 ? law_.chord(gap, expected / share) : law_.at(gap).curvature);
  }
  if (!yielding_) return;
  coupling_.find_stiffness(law_stiffness_);
  find_folded(points, sample);
}

/// How the compliance changes as the active points move along the wall.
void NormalForces::find_slopes(const ContactSample& sample) {
  if (slopes_known_) return;
  slopes_known_ = true;
  foot_slopes_.resize(sample.active.size());
  for (std::size_t k = 0; k < sample.active.size(); ++k) {
    foot_slopes_[k] = feet_.weight_slopes(sample.active[k], coupled_feet_[k]);
  }
  coupling_.find_slopes(coupled_feet_, foot_slopes_, forces_);
}

/// The first active point that couples with the k-th, or it itself, for which a block-banded
/// Hessian has a place.
int NormalForces::first_in_band(const ContactPoints& points, const ContactSample& sample,
                                int k) const {
  const auto point = [&](int i) {
    return points[sample.active[static_cast<std::size_t>(i)].point];
  };
  const int first_coupled = coupling_.first_coupled(k);
  int first = k;
  while (first > first_coupled && in_band(point(k), point(first - 1))) --first;
  return first;
}

/// Visits the entries of the wall's stiffness between two points, `in_band` telling which of them
/// have a place in the band: visit(i, j, value, in_band), j <= i.
template <class Visit>
void NormalForces::for_each_coupling(const ContactPoints& points, const ContactSample& sample,
                                     Visit&& visit) const {
  const std::vector<int>& pressed = coupling_.pressed();
  const auto point = [&](int i) {
    return points[sample.active[static_cast<std::size_t>(i)].point];
  };
  for (int p = 0; p < static_cast<int>(pressed.size()); ++p) {
    const int i = pressed[static_cast<std::size_t>(p)];
    bool near = true;  // all after the first that is not are further along the wire
    for (int q = p; q >= coupling_.first_pressed(p); --q) {
      const int j = pressed[static_cast<std::size_t>(q)];
      near = near && (q == p || in_band(point(i), point(j)));
      visit(i, j, coupling_.pressed_stiffness(p, q), near);
    }
  }
}

/// The sizes of the entries that have no place in the band.
void NormalForces::find_folded(const ContactPoints& points, const ContactSample& sample) {
  folded_.setZero(static_cast<Eigen::Index>(sample.active.size()));
  for_each_coupling(points, sample, [&](int i, int j, double stiffness, bool in_band) {
    if (in_band) return;
    folded_[i] += std::abs(stiffness);
    folded_[j] += std::abs(stiffness);
  });
}

/// What the forces fall by in a motion.
void NormalForces::find_fall(const ContactPoints& points, const ContactSample& sample,
                             const WireMotion& motion) {
  find_stiffness(points, sample);
  const Eigen::Index m = static_cast<Eigen::Index>(sample.active.size());
  approach_.resize(m);
  motion_.resize(3, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const ActivePoint& active = sample.active[static_cast<std::size_t>(k)];
    motion_.col(k) = points.motion_of(active.point, motion);
    approach_[k] = active.wall.gradient.dot(motion_.col(k));
  }
  fall_ = approach_;
  if (yielding_) {
    if (sample.own_lag && !feet_.held()) {
      find_slopes(sample);
      coupling_.add_change_of_compliance(motion_, fall_);
    }
    coupling_.multiply_by_stiffness(fall_);
  } else {
    for (Eigen::Index k = 0; k < m; ++k) fall_[k] *= law_stiffness_[k];
  }
}

void NormalForces::expect_after(const ContactPoints& points, const ContactSample& sample,
                                const WireMotion& motion) {
  find_fall(points, sample, motion);
  expect_nothing();
  for (std::size_t k = 0; k < sample.active.size(); ++k) {
    const ActivePoint& active = sample.active[k];
    expected_[active.point] = std::max(0.0, active.force - fall_[static_cast<Eigen::Index>(k)]);
  }
}

NormalForces::Change NormalForces::find_change(const ContactPoints& points,
                                               const ContactSample& sample,
                                               const WireMotion& motion) {
  find_fall(points, sample, motion);
  const int m = static_cast<int>(sample.active.size());
  left_out_.setZero(m);
  if (!yielding_) return {fall_, left_out_};
  left_out_ = fall_ - folded_.cwiseProduct(approach_);
  for_each_coupling(points, sample, [&](int i, int j, double stiffness, bool in_band) {
    if (!in_band) return;
    left_out_[i] -= stiffness * approach_[j];
    if (j < i) left_out_[j] -= stiffness * approach_[i];
  });
  return {fall_, left_out_};
}

}  // namespace wireplan::simulate
