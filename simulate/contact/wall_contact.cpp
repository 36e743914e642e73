#include "simulate/contact/wall_contact.h"

#include <algorithm>
#include <array>
#include <utility>

namespace wireplan::simulate {

namespace {

/// How far from a wire's axis contact reaches [mm].
double reach(const Rod& rod, const VesselModel& vessel, const ContactLaw& law) {
  // A wall that is pressed out bulges in a little beside it.
  constexpr double kBulge = 0.1;  // [mm]
  return rod.radius + law.reach() + (vessel.compliance != nullptr ? kBulge : 0.0);
}

}  // namespace

WallContact::WallContact(const Rod& rod, const VesselModel& vessel, const ContactOptions& options)
    : lumen_(vessel.lumen),
      law_(options.law),
      radius_(rod.radius),
      felt_from_(rod.radius + options.law.reach()),
      points_(rod, vessel, options.spacing, reach(rod, vessel, options.law)),
      forces_(options.law, vessel, rod.radius, points_.size()),
      friction_(options.friction, options.slip, points_.size()),
      support_factor_(options.support_factor) {
  const int m = points_.size();
  memory_.x.setZero(3, rod.nodes());
  if (chain() != nullptr) memory_.sections.setZero(3, chain()->nodes());
  memory_.anchor.setZero(3, m);
  memory_.normal_force.setZero(m);
  if (forces_.yielding()) memory_.triangle.assign(static_cast<std::size_t>(m), -1);
  take_parts(rod);
  predicted_.setZero(m);
  latest_.active.reserve(static_cast<std::size_t>(m));
  touches_.reserve(static_cast<std::size_t>(m));
}

// ---------------------------------------------------------------- the trial's part

void WallContact::take(const Rod& rod) {
  expects(rod.radius == radius_);
  points_.take(rod);
  take_parts(rod);
}

void WallContact::forget() {
  points_.forget();
  forces_.forget();
}

/// Of the coefficient of friction.
void WallContact::take_parts(const Rod& rod) {
  if (rod.rubs.size() == 0) return;
  Eigen::VectorXd& parts = friction_.parts();
  parts.resize(points_.size());
  for (int k = 0; k < points_.size(); ++k) parts[k] = at_point(rod.rubs, points_[k]);
}

void WallContact::find_slopes(std::vector<Slope>& slopes) const {
  slopes.clear();
  for (const ActivePoint& active : latest_.active) {
    const double energy = law_.at(active.wall.distance - radius_ + active.yield).energy;
    if (energy == 0.0) continue;
    slopes.push_back({.point = active.point, .by_share = energy, .by_thinner = -active.force});
  }
}

void WallContact::start_at(const RodState& state) {
  memory_.x = state.x;
  memory_.sections = state.sections;
  memory_.normal_force.setZero();
  points_.forget_before();
  friction_.predict_nothing();
  forces_.expect_nothing();
}

void WallContact::predict(double distance) {
  points_.carry_back(memory_.normal_force, distance, predicted_);
  friction_.predict(predicted_);
  forces_.expect(predicted_);
}

double WallContact::settle() {
  forces_.remember_feet(memory_.triangle);
  const double heat = friction_.settle(points_, memory_);
  points_.forget_before();
  return heat;
}

const std::vector<Touch>& WallContact::touches() {
  touches_.clear();
  for (const ActivePoint& active : latest_.active) {
    if (active.force <= 0.0) continue;
    const ContactPoint& point = points_[active.point];
    const double slope = active.wall.gradient.norm();
    const Vec3 normal = points_.on_wire(active.point, active.wall.gradient);
    const double length = normal.norm();
    touches_.push_back(
        {.point = active.point,
         .edge = point.edge,
         .part = point.part,
         .position = points_.place(active.point),
         .rest = active.position,
         .rest_normal = active.wall.gradient / slope,
         .normal = normal / length,
         .normal_force = active.force * length,
         .friction = friction_.acts() ? points_.on_wire(active.point, friction_.force(active.point))
                                      : Vec3::Zero(),
         .penetration = std::max(0.0, radius_ - active.wall.distance - active.yield),
         .wall_displacement = active.yield,
         .tip_distance = point.tip_distance,
         .share = point.share,
         .thinner = points_.thinner(active.point)});
  }
  return touches_;
}

// ---------------------------------------------------------------- samples

const ContactSample& WallContact::begin(const RodState& state) {
  forces_.begin();
  find(state);
  friction_.begin(points_, latest_, lumen_, felt_from_);
  forces_.find(points_, memory_.triangle, latest_);
  return rub();
}

/// Which points touch, and what holds the sections.
void WallContact::find(const RodState& state) {
  points_.find_active(state.x, state.sections, forces_.expected(), latest_);
  latest_.own_lag = false;
  if (chain() == nullptr) return;
  support_.setZero(3, chain()->nodes());
  support_energy_ = support_factor_ * chain()->energy(state.sections, support_);
  support_ *= support_factor_;
}

const ContactSample& WallContact::sample(const RodState& state) {
  find(state);
  forces_.find(points_, memory_.triangle, latest_);
  return rub();
}

const ContactSample& WallContact::refresh(bool fully) {
  if (forces_.yielding()) {
    forces_.refresh_feet(latest_, memory_.triangle);
    forces_.find(points_, memory_.triangle, latest_);
  }
  latest_.own_lag = friction_.refresh(latest_, fully);
  return rub();
}

/// The latest sample with its friction, once its normal forces are found.
const ContactSample& WallContact::rub() {
  friction_.find_rubbing(points_, memory_);
  latest_.energy.friction = friction_.energy();
  latest_.energy.support = support_energy_;
  return latest_;
}

void WallContact::save_lag() {
  forces_.save_feet();
  friction_.save();
}

void WallContact::restore_lag() {
  forces_.restore_feet();
  friction_.restore();
  friction_.find_rubbing(points_, memory_);
  latest_.own_lag = false;
}

// ---------------------------------------------------------------- derivatives

void WallContact::add_remainder(const Motion& motion, Eigen::VectorXd& product) {
  const auto [change, left_out] = forces_.find_change(points_, latest_, motion);
  for (Eigen::Index k = 0; k < change.size(); ++k) {
    const ActivePoint& active = latest_.active[static_cast<std::size_t>(k)];
    Vec3 out_of_balance = left_out[k] * active.wall.gradient;
    if (friction_.acts() && latest_.own_lag && active.force > 0.0) {
      out_of_balance -=
          (friction_.per_normal_force(active.point) * change[k] * active.wall.gradient.norm()) *
          friction_.rubbing(active.point).toward;
    }
    points_.scatter(active.point, motion, out_of_balance, product);
  }
}

void WallContact::add_remainder(int first, UnsymmetricBand& band) {
  if (!latest_.own_lag) return;
  const Eigen::VectorXd& stiffness = forces_.law_stiffness(points_, latest_);
  for (Eigen::Index k = 0; k < stiffness.size(); ++k) {
    const ActivePoint& active = latest_.active[static_cast<std::size_t>(k)];
    if (active.force <= 0.0) continue;
    const ContactPoint& point = points_[active.point];
    const Vec3& n = active.wall.gradient;
    const Vec3 per_force =
        friction_.per_normal_force(active.point) * friction_.rubbing(active.point).toward;
    const Vec3 change = (-stiffness[k] * n.norm()) * n;  // of the normal force, over the motion
    const std::array<double, 2> weight = {1.0 - point.part, point.part};
    for (int p = 0; p < 2; ++p) {
      for (int q = 0; q < 2; ++q) {
        const int i = point.edge + p - first, j = point.edge + q - first;
        const double scale = weight[p] * weight[q];
        if (scale == 0.0 || i < 0 || j < 0) continue;
        UnsymmetricBand::Block& block = band.at(i, j);
        for (int c = 0; c < 3; ++c) block.col(c).head<3>() += (scale * change[c]) * per_force;
      }
    }
  }
}

}  // namespace wireplan::simulate
