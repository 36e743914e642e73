#include "simulate/contact/friction.h"

#include <algorithm>
#include <cmath>

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

/// Where friction holds a point, or where it was in the last equilibrium.
Vec3 anchor_of(int k, const ContactPoints& points, const ContactMemory& memory) {
  if (memory.normal_force[k] > 0.0) return memory.anchor.col(k);
  return points.position_before(k, memory);
}

}  // namespace

Friction::Friction(double coefficient, double slip, int points)
    : coefficient_(coefficient), slip_(slip) {
  expects(coefficient >= 0.0 && slip > 0.0);
  lag_.force.setZero(points);
  lag_.normal.setZero(3, points);
  lag_.points.reserve(static_cast<std::size_t>(points));
  kept_.reserve(static_cast<std::size_t>(points));
  rubbing_.resize(static_cast<std::size_t>(points));
}

void Friction::begin(const ContactPoints& points, const ContactSample& sample, const Lumen& lumen,
                     double near) {
  lag_.points.clear();
  if (!acts()) return;
  auto active = sample.active.begin();
  for (int k = points.first_free(); k < points.size(); ++k) {
    if (lag_.force[k] <= 0.0) continue;
    while (active != sample.active.end() && active->point < k) ++active;
    const bool known = active != sample.active.end() && active->point == k;
    const WallSample wall = known ? active->wall : lumen.sample(points.position(k));
    if (wall.distance > near + 1.0 || wall.gradient.norm() < kSmallestSlope) continue;
    lag_.normal.col(k) = wall.gradient.normalized();
    lag_.points.push_back(k);
  }
}

bool Friction::refresh(const ContactSample& sample, bool fully) {
  if (!acts()) return true;
  // Between equilibria a point that sticks must not lose its hold when it leaves the wall for an
  // iteration: the normal force of its lag falls no faster than to a fraction of itself.
  constexpr double kKept = 0.3, kNothing = 1e-9;  // [-], [N]
  bool own = true;
  kept_.swap(lag_.points);
  lag_.points.clear();
  for (const int k : kept_) {
    const bool sticks = rubbing(k).length < 2.0 * slip_;
    lag_.force[k] *= sticks && !fully ? kKept : 0.0;
  }
  for (const ActivePoint& active : sample.active) {
    if (active.force <= 0.0) continue;
    const double slope = active.wall.gradient.norm(), force = active.force * slope;
    double& kept = lag_.force[active.point];
    if (kept > force) {
      own = false;
    } else {
      lag_.normal.col(active.point) = active.wall.gradient / slope;
    }
    lag_.points.push_back(active.point);
    // Marked as taken by its sign until all are through.
    kept = -std::max(kept, force);
  }
  for (const int k : kept_) {
    if (lag_.force[k] > kNothing) {
      lag_.points.push_back(k);
      own = false;
    } else if (lag_.force[k] > 0.0) {
      lag_.force[k] = 0.0;
    }
  }
  for (const int k : lag_.points) lag_.force[k] = std::abs(lag_.force[k]);
  return own;
}

void Friction::find_rubbing(const ContactPoints& points, const ContactMemory& memory) {
  for (const int k : lag_.points) {
    const Vec3 normal = lag_.normal.col(k);
    const Vec3 moved = points.position(k) - anchor_of(k, points, memory);
    const Vec3 along = moved - moved.dot(normal) * normal;
    const double length = along.norm();
    const Rub potential = rub(length, slip_);
    rubbing_[static_cast<std::size_t>(k)] = {
        .length = length,
        .toward = length > 0.0 ? Vec3(along / length) : Vec3::Zero(),
        .limit = coefficient(k) * lag_.force[k],
        .energy = potential.energy,
        .slope = potential.slope,
        .curvature = potential.curvature};
  }
}

double Friction::energy() const {
  double energy = 0.0;
  for (const int k : lag_.points) energy += rubbing(k).limit * rubbing(k).energy;
  return energy;
}

void Friction::find_rubbed(const ContactPoints& points, const ContactMemory& memory,
                           std::vector<RubbedPoint>& rubbed) const {
  rubbed.clear();
  if (!acts()) return;
  const auto add = [&](int k, double limit_now) {
    const Vec3 normal = lag_.normal.col(k), anchor = anchor_of(k, points, memory);
    const auto along = [&](const Vec3& off) { return Vec3(off - off.dot(normal) * normal); };
    const Vec3 before = along(points.position_before(k, memory) - anchor);
    const Vec3 now = along(points.position(k) - anchor), way = now - before;
    const double limit = 0.5 * (coefficient(k) * memory.normal_force[k] + limit_now);
    const double work = limit * (rub(now.norm(), slip_).energy - rub(before.norm(), slip_).energy);
    const double length = way.norm();
    const bool went = length > 1e-3 * slip_;
    const Vec3 force = went ? Vec3((-work / (length * length)) * way) : Vec3::Zero();
    rubbed.push_back({k, points.on_wire(k, force), work});
  };
  for (const int k : lag_.points) add(k, rubbing(k).limit);
  for (int k = points.first_free(); k < points.size(); ++k) {  // those that lost the wall
    const bool rubs = std::find(lag_.points.begin(), lag_.points.end(), k) != lag_.points.end();
    if (memory.normal_force[k] > 0.0 && !rubs) add(k, 0.0);
  }
}

double Friction::settle(const ContactPoints& points, ContactMemory& memory) const {
  if (!acts()) return 0.0;
  double work = 0.0;
  for (const int k : lag_.points) {
    const double slipped = rubbing(k).length - slip_;
    memory.anchor.col(k) = anchor_of(k, points, memory);
    if (slipped > 0.0) {
      work += rubbing(k).limit * slipped;
      memory.anchor.col(k) = points.position(k) - slip_ * rubbing(k).toward;
    }
  }
  memory.normal_force.setZero();
  for (const int k : lag_.points) memory.normal_force[k] = lag_.force[k];
  memory.x = points.nodes();
  memory.sections = points.sections();
  return work;
}

}  // namespace wireplan::simulate
