#include "simulate/contact/wall_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace wireplan::simulate {

namespace {

/// Potential of friction per force over the displacement u along the wall: its slope grows smoothly
/// from 0 to 1 at `slip`, and stays there.
struct Rub {
  double energy, slope, curvature;
};

Rub rub(double u, double slip) {
  if (u >= slip) return {u - slip / 3.0, 1.0, 0.0};
  const double part = u / slip;
  return {u * part * (1.0 - part / 3.0), part * (2.0 - part), 2.0 * (1.0 - part) / slip};
}

/// A smaller gradient than this has no direction: the point is beyond the field, or on the axis of
/// a lumen.
constexpr double kSmallestSlope = 1e-6;

/// A point that is expected to touch stays in sight so much further from the wall than contact
/// reaches [mm].
constexpr double kInSight = 0.3;

/// A held foot is left where it is while its point is this near to where the foot was found [mm].
constexpr double kHeldFoot = 0.25;

/// Points are half as far apart in so much wire behind the tip: it alone slides across ridges,
/// round the mouths of branches [mm].
constexpr double kFineTip = 20.0;

/// A point that touched and moved by no more than this has the field of there to second order: its
/// third derivatives, up to some 4/mm^2 where it turns by 60 degrees within a cell, leave 1e-10 mm
/// and 5e-7 of the force [mm].
constexpr double kSamePlace = 5e-4;

/// Of a point that is looked at in every sampling, see WallContact::asleep_until_.
constexpr double kAwake = -1.0;

/// How deep into the wall a step may lead a point, or one of its parts [mm].
constexpr double kInto = 0.25;

/// How much further from the wall than before a point may be than its motion says: the gradient of
/// the smooth field is not quite 1.
constexpr double kLipschitz = 1.2;

}  // namespace

WallContact::WallContact(const Rod& rod, const VesselModel& vessel, const ContactOptions& options)
    : vessel_(vessel),
      options_(options),
      yielding_(vessel.compliance != nullptr),
      radius_(rod.radius) {
  expects(options.spacing > 0.0 && options.friction >= 0.0 && options.slip > 0.0);
  expects(vessel.lumen.band() > reach());
  const int edges = rod.nodes() - 1;
  double before = 0.0;  // length of wire that the next point gets from behind it
  for (int e = 0; e < edges; ++e) {
    const double l = rod.rest_length[e];
    const double spacing = (rod.tip_distance[e] <= kFineTip + 1e-9 ? 0.5 : 1.0) * options.spacing;
    const int parts = std::max(1, static_cast<int>(std::ceil(l / spacing - 1e-9)));
    const double half = 0.5 * l / parts;
    for (int k = 0; k < parts; ++k) {
      const double part = static_cast<double>(k) / parts;
      points_.push_back({e, part, (k == 0 ? before : half) + half, rod.tip_distance[e] - part * l});
    }
    before = half;
  }
  points_.push_back({edges - 1, 1.0, before, 0.0});

  const Eigen::Index m = static_cast<Eigen::Index>(points_.size());
  memory_.x.setZero(3, rod.nodes());
  memory_.anchor.setZero(3, m);
  memory_.normal_force.setZero(m);
  lag_.force.setZero(m);
  lag_.normal.setZero(3, m);
  x_.setZero(3, rod.nodes());
  asleep_until_.setConstant(m, kAwake);
  known_position_.setConstant(3, m, std::numeric_limits<double>::infinity());
  known_distance_.setZero(m);
  known_.resize(points_.size());
  touched_.assign(points_.size(), 0);
  rubbing_.resize(points_.size());
  predicted_.setZero(m);
  expected_.setConstant(m, kNoExpectation);
  lag_.points.reserve(points_.size());
  kept_points_.reserve(points_.size());
  active_.reserve(points_.size());
  touches_.reserve(points_.size());
  if (yielding_) {
    lag_.feet.resize(points_.size());
    lag_.foot_from.setZero(3, m);
    memory_.triangle.assign(points_.size(), -1);
    press_.setZero(m);
  }
}

Vec3 WallContact::position_of(const Point& point, const Eigen::Matrix3Xd& x) {
  if (point.part == 0.0) return x.col(point.edge);
  return (1.0 - point.part) * x.col(point.edge) + point.part * x.col(point.edge + 1);
}

void WallContact::free_from(double tip_distance) {
  const auto first = std::partition_point(
      points_.begin(), points_.end() - 1,
      [&](const Point& point) { return point.tip_distance > tip_distance + 1e-9; });
  first_free_ = static_cast<std::size_t>(first - points_.begin());
  asleep_until_.head(static_cast<Eigen::Index>(first_free_)).setConstant(kAwake);
}

void WallContact::start_at(const Eigen::Matrix3Xd& x) {
  memory_.x = x;
  memory_.normal_force.setZero();
  lag_.force.setZero();
  expect_nothing();
}

void WallContact::predict(double distance) {
  // Tip distances fall along the points: walk through them and through where their forces go, from
  // the tip on. The tip's own goes with it.
  predicted_.setZero();
  Eigen::Index to = predicted_.size() - 1;
  const auto tip_distance = [&](Eigen::Index k) {
    return points_[static_cast<std::size_t>(k)].tip_distance;
  };
  for (Eigen::Index k = predicted_.size() - 1; k >= 0; --k) {
    const double force = memory_.normal_force[k];
    if (force == 0.0) continue;
    const double wanted = tip_distance(k) > 0.0 ? tip_distance(k) + distance : 0.0;
    while (to > 0 && tip_distance(to - 1) <= wanted) --to;
    const double past = wanted - tip_distance(to);  // `to`, toward the point before it
    const double part =
        to > 0 && past > 0.0 ? past / (tip_distance(to - 1) - tip_distance(to)) : 0.0;
    predicted_[to] += (1.0 - part) * force;
    if (part > 0.0) predicted_[to - 1] += part * force;
    asleep_until_.segment(std::max<Eigen::Index>(0, to - 1), to > 0 ? 2 : 1).setConstant(kAwake);
  }
  lag_.force = expected_ = predicted_;
}

// ---------------------------------------------------------------- normal forces

void WallContact::begin(const Eigen::Matrix3Xd& x) {
  std::fill(lag_.feet.begin(), lag_.feet.end(), SurfacePoint{});
  feet_changed_ = true;
  feet_held_ = false;
  find_active(x);

  // Points that friction is predicted for rub along the wall where they are now.
  lag_.points.clear();
  const double near = radius_ + options_.law.smoothing;
  if (options_.friction > 0.0) {
    auto active = active_.begin();
    for (std::size_t k = first_free_; k < points_.size(); ++k) {
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      if (lag_.force[i] <= 0.0) continue;
      while (active != active_.end() && active->point < static_cast<int>(k)) ++active;
      const bool known = active != active_.end() && active->point == static_cast<int>(k);
      const WallSample wall = known ? active->wall : vessel_.lumen.sample(position_of(i));
      if (wall.distance > near + 1.0 || wall.gradient.norm() < kSmallestSlope) continue;
      lag_.normal.col(i) = wall.gradient.normalized();
      lag_.points.push_back(static_cast<int>(k));
    }
  }
  find_forces();
  energy_ = lagged_energy();
}

double WallContact::reach() const {
  // A wall that is pressed out bulges in a little beside it.
  constexpr double kBulge = 0.1;  // [mm]
  return radius_ + options_.law.smoothing + (yielding_ ? kBulge : 0.0);
}

ContactEnergy WallContact::sample(const Eigen::Matrix3Xd& x) {
  find_active(x);
  find_forces();
  return energy_ = lagged_energy();
}

/// How far from the wall a point is at least, now that it is at `position`.
double WallContact::least_distance(Eigen::Index k, const Vec3& position) const {
  return known_distance_[k] - kLipschitz * (position - known_position_.col(k)).norm();
}

/// The wall at point k, without derivatives where it is further than `near`.
WallSample WallContact::look_at(std::size_t k, const Vec3& position, double near) {
  const Eigen::Index i = static_cast<Eigen::Index>(k);
  WallSample wall;
  if (touched_[k] == 0) wall.distance = vessel_.lumen.distance(position);
  if (touched_[k] != 0 || wall.distance < near) {
    WallSample& known = known_[k];
    const Vec3 moved = position - known_position_.col(i);
    if (touched_[k] != 0 && moved.squaredNorm() <= kSamePlace * kSamePlace) {
      const Vec3 turned = known.hessian * moved;
      wall.distance = known.distance + moved.dot(known.gradient + 0.5 * turned);
      wall.gradient = known.gradient + turned;
      wall.hessian = known.hessian;
      return wall;
    }
    wall = known = vessel_.lumen.sample(position);
  }
  known_position_.col(i) = position;
  known_distance_[i] = wall.distance;
  return wall;
}

void WallContact::find_active(const Eigen::Matrix3Xd& x) {
  // Points near the wall. One that was far enough for its motion since is not looked at.
  const Eigen::Index moving = x.cols() - points_[first_free_].edge;
  travelled_ += std::sqrt((x - x_).rightCols(moving).colwise().squaredNorm().maxCoeff());
  x_ = x;
  fresh_ = lost_ = false;
  active_.clear();
  for (std::size_t k = first_free_; k < points_.size(); ++k) {
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    if (asleep_until_[i] >= travelled_) continue;
    const Vec3 p = position_of(i);
    const double near = reach() + (expected_[i] > 0.0 ? kInSight : 0.0);
    const double least = least_distance(i, p);
    if (least >= near) {
      asleep_until_[i] = travelled_ + (least - near) / kLipschitz;
      continue;
    }
    const WallSample wall = look_at(k, p, near);
    asleep_until_[i] = travelled_ + (wall.distance - near) / kLipschitz;
    touched_[k] = wall.distance < near ? 1 : 0;
    if (touched_[k] == 0) continue;
    if (wall.gradient.squaredNorm() < kSmallestSlope * kSmallestSlope) {
      lost_ = lost_ || wall.distance < 0.0;
      continue;
    }
    active_.push_back({.point = static_cast<int>(k), .position = p, .wall = wall});
  }
}

void WallContact::find_forces() {
  energy_ = {};
  stiffness_known_ = false;
  if (!yielding_) {
    for (Active& active : active_) {
      const double share = points_[static_cast<std::size_t>(active.point)].share;
      const ContactLaw::Value law = options_.law.at(active.wall.distance - radius_);
      energy_.contact += share * law.energy;
      active.force = -share * law.slope;
    }
    return;
  }

  // All together through the wall. Feet stay where they are until the lag is refreshed.
  const Eigen::Index m = static_cast<Eigen::Index>(active_.size());
  bool same = !feet_changed_ && active_.size() == coupled_points_.size();
  for (std::size_t k = 0; k < active_.size(); ++k) {
    const std::size_t point = static_cast<std::size_t>(active_[k].point);
    if (lag_.feet[point].triangle < 0) find_foot(active_[k]);
    same = same && coupled_points_[k] == active_[k].point;
  }
  if (!same) {
    coupled_points_.clear();
    coupled_feet_.clear();
    for (const Active& active : active_) {
      coupled_points_.push_back(active.point);
      coupled_feet_.push_back(lag_.feet[static_cast<std::size_t>(active.point)]);
    }
    coupling_.set_feet(*vessel_.compliance, coupled_feet_);
    feet_changed_ = false;
  }
  gap_.resize(m);
  share_.resize(m);
  forces_.resize(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Active& active = active_[static_cast<std::size_t>(k)];
    const double expected = expected_[active.point];
    gap_[k] = active.wall.distance - radius_;
    share_[k] = points_[static_cast<std::size_t>(active.point)].share;
    forces_[k] = expected >= 0.0 ? expected : press_[active.point];
  }
  energy_.contact = coupling_.solve(options_.law, gap_, share_, forces_, displacement_);
  energy_.wall = 0.5 * forces_.dot(displacement_);
  press_.setZero();
  for (Eigen::Index k = 0; k < m; ++k) {
    Active& active = active_[static_cast<std::size_t>(k)];
    active.force = press_[active.point] = forces_[k];
    active.yield = displacement_[k];
  }
}

void WallContact::find_foot(const Active& active) {
  const WallSample& wall = active.wall;
  const std::size_t point = static_cast<std::size_t>(active.point);
  SurfacePoint& foot = lag_.feet[point];
  foot = vessel_.locator.pierced(
      active.position - (wall.distance / wall.gradient.squaredNorm()) * wall.gradient,
      wall.gradient, foot.triangle >= 0 ? foot.triangle : memory_.triangle[point]);
  lag_.foot_from.col(active.point) = active.position;
}

// ---------------------------------------------------------------- friction

/// Where friction holds a point, or where it was in the last equilibrium.
Vec3 WallContact::anchor_of(Eigen::Index k) const {
  if (memory_.normal_force[k] > 0.0) return memory_.anchor.col(k);
  return position_of(points_[static_cast<std::size_t>(k)], memory_.x);
}

void WallContact::find_rubbing() {
  for (const int k : lag_.points) {
    const Vec3 normal = lag_.normal.col(k);
    const Vec3 moved = position_of(k) - anchor_of(k);
    const Vec3 along = moved - moved.dot(normal) * normal;
    const double length = along.norm();
    const Rub potential = rub(length, options_.slip);
    rubbing_[static_cast<std::size_t>(k)] = {
        .length = length,
        .toward = length > 0.0 ? Vec3(along / length) : Vec3::Zero(),
        .limit = options_.friction * lag_.force[k],
        .energy = potential.energy,
        .slope = potential.slope,
        .curvature = potential.curvature};
  }
}

ContactEnergy WallContact::lagged_energy() {
  find_rubbing();
  ContactEnergy energy = energy_;
  energy.friction = 0.0;
  for (const int k : lag_.points) {
    const Rubbing& rubbing = rubbing_[static_cast<std::size_t>(k)];
    energy.friction += rubbing.limit * rubbing.energy;
  }
  return energy;
}

ContactEnergy WallContact::refresh(bool fully) {
  fresh_ = true;
  if (yielding_) {
    for (const Active& active : active_) {
      const bool has_foot = lag_.feet[static_cast<std::size_t>(active.point)].triangle >= 0;
      const double moved = (active.position - lag_.foot_from.col(active.point)).norm();
      if (feet_held_ && has_foot && moved < kHeldFoot) continue;
      find_foot(active);
      feet_changed_ = true;
    }
    find_forces();
  }
  if (options_.friction > 0.0) {
    // Between equilibria a point that sticks must not lose its hold when it leaves the wall for an
    // iteration: the normal force of its lag falls no faster than to a fraction of itself.
    constexpr double kKept = 0.3, kNothing = 1e-9;  // [-], [N]
    kept_points_.swap(lag_.points);
    lag_.points.clear();
    for (const int k : kept_points_) {
      const bool sticks = rubbing_[static_cast<std::size_t>(k)].length < 2.0 * options_.slip;
      lag_.force[k] *= sticks && !fully ? kKept : 0.0;
    }
    for (const Active& active : active_) {
      if (active.force <= 0.0) continue;
      const double slope = active.wall.gradient.norm(), force = active.force * slope;
      double& kept = lag_.force[active.point];
      if (kept > force) {
        fresh_ = false;
      } else {
        lag_.normal.col(active.point) = active.wall.gradient / slope;
      }
      lag_.points.push_back(active.point);
      // Marked as taken by its sign until all are through.
      kept = -std::max(kept, force);
    }
    for (const int k : kept_points_) {
      if (lag_.force[k] > kNothing) {
        lag_.points.push_back(k);
        fresh_ = false;
      } else if (lag_.force[k] > 0.0) {
        lag_.force[k] = 0.0;
      }
    }
    for (const int k : lag_.points) lag_.force[k] = std::abs(lag_.force[k]);
  }
  return energy_ = lagged_energy();
}

double WallContact::settle() {
  for (std::size_t k = 0; k < lag_.feet.size(); ++k) memory_.triangle[k] = lag_.feet[k].triangle;
  if (options_.friction == 0.0) return 0.0;
  // A point that rubbed keeps its anchor `slip` behind it; one that does not touch, where it is.
  // The heat is the friction now, times the way that the anchor went.
  double work = 0.0;
  predicted_.setZero();
  for (const int k : lag_.points) {
    const Rubbing& rubbing = rubbing_[static_cast<std::size_t>(k)];
    predicted_[k] = lag_.force[k];
    const double slipped = rubbing.length - options_.slip;
    memory_.anchor.col(k) = anchor_of(k);
    if (slipped > 0.0) {
      work += rubbing.limit * slipped;
      memory_.anchor.col(k) = position_of(k) - options_.slip * rubbing.toward;
    }
  }
  memory_.normal_force = predicted_;
  memory_.x = x_;
  return work;
}

const std::vector<Touch>& WallContact::touches() {
  touches_.clear();
  for (const Active& active : active_) {
    if (active.force <= 0.0) continue;
    const Point& point = points_[static_cast<std::size_t>(active.point)];
    const double slope = active.wall.gradient.norm();
    Touch touch{.point = active.point,
                .edge = point.edge,
                .part = point.part,
                .position = active.position,
                .normal = active.wall.gradient / slope,
                .normal_force = active.force * slope,
                .penetration = std::max(0.0, radius_ - active.wall.distance - active.yield),
                .wall_displacement = active.yield,
                .tip_distance = point.tip_distance};
    if (options_.friction > 0.0) {
      const Rubbing& rubbing = rubbing_[static_cast<std::size_t>(active.point)];
      touch.friction = -(rubbing.limit * rubbing.slope) * rubbing.toward;
    }
    touches_.push_back(touch);
  }
  return touches_;
}

// ---------------------------------------------------------------- derivatives

bool WallContact::in_band(const Active& a, const Active& b) const {
  const Point& p = points_[static_cast<std::size_t>(a.point)];
  const Point& q = points_[static_cast<std::size_t>(b.point)];
  const auto last_node = [](const Point& point) { return point.edge + (point.part > 0.0 ? 1 : 0); };
  return std::max(last_node(p), last_node(q)) - std::min(p.edge, q.edge) <= 2;
}

void WallContact::find_stiffness() {
  if (stiffness_known_) return;
  stiffness_known_ = true;
  const Eigen::Index m = static_cast<Eigen::Index>(active_.size());
  change_.resize(m);  // scratch: of the contact law
  for (Eigen::Index k = 0; k < m; ++k) {
    Active& active = active_[static_cast<std::size_t>(k)];
    const double share = points_[static_cast<std::size_t>(active.point)].share;
    const double gap = active.wall.distance - radius_ + active.yield;
    const double expected = expected_[active.point];
    active.stiffness = change_[k] =
        share * (expected >= 0.0 ? options_.law.chord(gap, expected / share)
                                 : options_.law.at(gap).curvature);
  }
  if (!yielding_) return;
  coupling_.find_stiffness(change_);

  foot_slopes_.resize(active_.size());
  for (std::size_t k = 0; k < active_.size(); ++k) {
    // The foot lies on the line from the point along the gradient, which turns as the point moves.
    const Active& active = active_[k];
    const SurfacePoint& foot = coupled_feet_[k];
    foot_slopes_[k].setZero();
    if (foot.triangle < 0) continue;
    const Vec3& normal = active.wall.gradient;
    const double along = (vessel_.locator.position(foot) - active.position).dot(normal);
    foot_slopes_[k] = vessel_.locator.weight_slopes(foot, normal) *
                      (Mat3::Identity() + (along / normal.squaredNorm()) * active.wall.hessian);
  }
  coupling_.find_slopes(coupled_feet_, foot_slopes_);

  folded_.setZero(m);
  for (int i = 0; i < m; ++i) {
    for (int j = coupling_.first_coupled(i); j < i; ++j) {
      if (in_band(active_[static_cast<std::size_t>(i)], active_[static_cast<std::size_t>(j)])) {
        continue;
      }
      const double size = std::abs(coupling_.stiffness(i, j));
      folded_[i] += size;
      folded_[j] += size;
    }
  }
}

void WallContact::find_change(const Motion& motion) {
  find_stiffness();
  const Eigen::Index m = static_cast<Eigen::Index>(active_.size());
  gap_.resize(m);
  motion_.resize(3, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Active& active = active_[static_cast<std::size_t>(k)];
    motion_.col(k) = motion.of(points_[static_cast<std::size_t>(active.point)]);
    gap_[k] = active.wall.gradient.dot(motion_.col(k));
  }
  change_ = gap_;
  if (yielding_) {
    if (fresh_ && !feet_held_) coupling_.add_change_of_compliance(motion_, forces_, change_);
    coupling_.multiply_by_stiffness(change_);
  } else {
    for (Eigen::Index k = 0; k < m; ++k) {
      change_[k] *= active_[static_cast<std::size_t>(k)].stiffness;
    }
  }
}

void WallContact::expect_after(const Motion& motion) {
  find_change(motion);
  expect_nothing();
  for (std::size_t k = 0; k < active_.size(); ++k) {
    expected_[active_[k].point] =
        std::max(0.0, active_[k].force - change_[static_cast<Eigen::Index>(k)]);
  }
}

void WallContact::add_remainder(const Motion& motion, Eigen::VectorXd& product) {
  find_change(motion);
  const Eigen::Index m = static_cast<Eigen::Index>(active_.size());
  left_out_.setZero(m);
  if (yielding_) {
    left_out_ = change_ - folded_.cwiseProduct(gap_);
    for (int i = 0; i < m; ++i) {
      for (int j = coupling_.first_coupled(i); j <= i; ++j) {
        if (!in_band(active_[static_cast<std::size_t>(i)], active_[static_cast<std::size_t>(j)])) {
          continue;
        }
        const double s = coupling_.stiffness(i, j);
        left_out_[i] -= s * gap_[j];
        if (j < i) left_out_[j] -= s * gap_[i];
      }
    }
  }

  for (Eigen::Index k = 0; k < m; ++k) {
    const Active& active = active_[static_cast<std::size_t>(k)];
    Vec3 out_of_balance = left_out_[k] * active.wall.gradient;
    if (options_.friction > 0.0 && fresh_ && active.force > 0.0) {
      const Rubbing& rubbing = rubbing_[static_cast<std::size_t>(active.point)];
      out_of_balance -=
          (options_.friction * rubbing.slope * change_[k] * active.wall.gradient.norm()) *
          rubbing.toward;
    }
    motion.scatter(points_[static_cast<std::size_t>(active.point)], out_of_balance, product);
  }
}

void WallContact::add_remainder(int first, UnsymmetricBand& band) {
  if (!fresh_) return;
  find_stiffness();
  for (const Active& active : active_) {
    if (active.force <= 0.0) continue;
    const Rubbing& rubbing = rubbing_[static_cast<std::size_t>(active.point)];
    const Point& point = points_[static_cast<std::size_t>(active.point)];
    const Vec3& n = active.wall.gradient;
    const Vec3 per_force = (options_.friction * rubbing.slope) * rubbing.toward;
    const Vec3 change = (-active.stiffness * n.norm()) * n;  // of the normal force, over the motion
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

double WallContact::largest_safe_part(const Motion& motion, int looks) const {
  const double longest = motion.longest();
  double cap = std::numeric_limits<double>::infinity();
  if (longest <= kInto) return cap;
  for (std::size_t k = first_free_; k < points_.size(); ++k) {
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    if (asleep_until_[i] >= travelled_ && longest <= kInto + reach()) continue;
    const Vec3 move = motion.of(points_[k]), from = position_of(i);
    const double distance = least_distance(i, from);
    const double room = kInto + std::max(0.0, distance), length = move.norm();
    if (length > room && room < cap * length) {
      cap = std::min(cap, way_inside(from, move / length, length, distance, looks) / length);
    }
  }
  return cap;
}

/// How far a point may go from a place that is `distance` inside the wall, of `length`; infinite:
/// as far as it likes. Looks ahead in strides that are safe by the distance where they start.
double WallContact::way_inside(const Vec3& from, const Vec3& toward, double length, double distance,
                               int looks) const {
  const double deepest = std::min(0.0, distance);
  double way = 0.0;
  for (int look = 0; look < looks; ++look) {
    const double next = way + kInto + std::max(0.0, distance);
    if (next >= length) return std::numeric_limits<double>::infinity();
    distance = vessel_.lumen.distance(from + next * toward);
    if (distance < deepest - kInto) return look == 0 ? next : way;
    way = next;
  }
  return way;
}

}  // namespace wireplan::simulate
