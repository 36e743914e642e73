#include "simulate/contact/contact_points.h"

#include <limits>

namespace wireplan::simulate {

namespace {

/// A point that is expected to touch stays in sight so much further from the wall than contact
/// reaches [mm].
constexpr double kInSight = 0.3;

/// Points are half as far apart in so much wire behind the tip: it alone slides across ridges,
/// round the mouths of branches [mm].
constexpr double kFineTip = 20.0;

/// A point that touched and moved by no more than this has the field of there to second order: its
/// third derivatives, up to some 4/mm^2 where it turns by 60 degrees within a cell, leave 1e-10 mm
/// and 5e-7 of the force [mm].
constexpr double kSamePlace = 5e-4;

/// Of a point that is looked at in every state, see ContactPoints::asleep_until_.
constexpr double kAwake = -1.0;

/// What a point knows is of use to one that comes this near to where it was, along the wire [mm].
constexpr double kCarried = 0.1;

/// How deep into the wall a step may lead a point, or one of its parts [mm].
constexpr double kInto = 0.25;

/// How much further from the wall than before a point may be than its motion says: the gradient of
/// the smooth field is not quite 1.
constexpr double kLipschitz = 1.2;

/// How much further its place at rest may move than the point and the sections together: G^-1 of
/// sections that slide past each other by 1 mm per mm has a norm of 1.6.
constexpr double kSheared = 2.0;

void build_points(const Rod& rod, double most_apart, std::vector<ContactPoint>& points) {
  points.clear();
  const int edges = rod.nodes() - 1;
  double before = 0.0;  // length of wire that the next point gets from behind it
  for (int e = 0; e < edges; ++e) {
    const double l = rod.rest_length[e];
    const double spacing = (rod.tip_distance[e] <= kFineTip + 1e-9 ? 0.5 : 1.0) * most_apart;
    const int parts = std::max(1, static_cast<int>(std::ceil(l / spacing - 1e-9)));
    const double half = 0.5 * l / parts;
    for (int k = 0; k < parts; ++k) {
      const double part = static_cast<double>(k) / parts;
      points.push_back({e, part, (k == 0 ? before : half) + half, rod.tip_distance[e] - part * l});
    }
    before = half;
  }
  points.push_back({edges - 1, 1.0, before, 0.0});
}

}  // namespace

bool in_band(const ContactPoint& p, const ContactPoint& q) {
  const auto last_node = [](const ContactPoint& point) {
    return point.edge + (point.part > 0.0 ? 1 : 0);
  };
  return std::max(last_node(p), last_node(q)) - std::min(p.edge, q.edge) <= 2;
}

double WireMotion::longest() const {
  double longest = 0.0;
  for (int i = first; i < last; ++i) longest = std::max(longest, of_node(i).squaredNorm());
  if (!has_sections()) return std::sqrt(longest);
  double furthest = 0.0;
  for (Eigen::Index k = sections_from(); k < values.size(); k += 3) {
    furthest = std::max(furthest, values.segment<3>(k).squaredNorm());
  }
  return std::sqrt(longest) + std::sqrt(furthest);
}

void WireMotion::scatter(const ContactPoint& point, const Vec3& force,
                         Eigen::VectorXd& target) const {
  const auto add_to = [&](int i, double weight) {
    if (weight == 0.0 || i < first || i >= last) return;
    target.segment<3>(stride * (i - first)) += weight * force;
  };
  add_to(point.edge, 1.0 - point.part);
  add_to(point.edge + 1, point.part);
}

ContactPoints::ContactPoints(const Rod& rod, const VesselModel& vessel, double spacing,
                             double reach)
    : lumen_(vessel.lumen), chain_(vessel.sections.get()), spacing_(spacing), reach_(reach) {
  expects(spacing > 0.0 && lumen_.band() > reach);
  build_points(rod, spacing, points_);
  if (rod.thinner.size() > 0) {
    thinner_.resize(size());
    for (int k = 0; k < size(); ++k) thinner_[k] = at_point(rod.thinner, (*this)[k]);
  }
  x_.setZero(3, rod.nodes());
  asleep_until_.resize(size());
  known_position_.resize(3, size());
  known_distance_.resize(size());
  known_.resize(points_.size());
  forget();
  if (chain_ == nullptr) return;
  u_.setZero(3, chain_->nodes());
  frames_.resize(points_.size());
  framed_in_.assign(points_.size(), -1);
  position_before_.resize(3, size());
  before_in_.assign(points_.size(), -1);
  gathered_.resize(points_.size());
}

ContactPoints::Gathered& ContactPoints::gathered(int k) const {
  Gathered& point = gathered_[static_cast<std::size_t>(k)];
  if (!point.any) {
    gathered_points_.push_back(k);
    point.any = true;
    point.has_hessian = false;
    point.force.setZero();
    point.coupled.clear();
  }
  return point;
}

void ContactPoints::gather_hessian(int k, const Vec3& g, const Mat3& H) const {
  Gathered& point = gathered(k);
  if (!point.has_hessian) {
    point.has_hessian = true;
    point.bending = g;
    point.H = H;
    return;
  }
  point.bending += g;
  point.H += H;
}

void ContactPoints::gather_between(int k, const Vec3& n, int j, const Vec3& m,
                                   double stiffness) const {
  // How the force on one changes with each section that moves the other.
  const auto add = [&](int to, const Vec3& normal, int from, const Vec3& other) {
    Gathered& point = gathered(to);
    point.normal = normal;
    for (const SectionChain::Weight& weight : frame(from).weights()) {
      const Vec3 change = (stiffness * weight.value) * other;
      const auto same = std::find_if(point.coupled.begin(), point.coupled.end(),
                                     [&](const Coupled& c) { return c.section == weight.node; });
      if (same != point.coupled.end()) {
        same->change += change;
      } else {
        point.coupled.push_back({weight.node, change});
      }
    }
  };
  add(k, n, j, m);
  add(j, m, k, n);
}

void ContactPoints::forget() {
  travelled_ = 0.0;
  asleep_until_.setConstant(kAwake);
  known_position_.setConstant(std::numeric_limits<double>::infinity());
  known_distance_.setZero();
  touched_.assign(points_.size(), 0);
  std::fill(frames_.begin(), frames_.end(), MovingFrame());
  std::fill(framed_in_.begin(), framed_in_.end(), -1);
}

void ContactPoints::take(const Rod& rod) {
  const int before = size();
  build_points(rod, spacing_, points_);
  expects(size() == before && rod.nodes() == x_.cols() && rod.thinner.size() > 0);
  forget_before();
  for (int k = 0; k < size(); ++k) {
    const double thinner = at_point(rod.thinner, (*this)[k]), more = thinner - thinner_[k];
    if (more == 0.0) continue;
    thinner_[k] = thinner;
    known_distance_[k] += more;
    known_[static_cast<std::size_t>(k)].distance += more;
    if (asleep_until_[k] > kAwake) asleep_until_[k] += more / kLipschitz;
  }
}

/// In the present state, found when first asked for.
const MovingFrame& ContactPoints::frame(int k) const {
  const auto at = static_cast<std::size_t>(k);
  if (framed_in_[at] != state_) {
    framed_in_[at] = state_;
    frames_[at].find(*chain_, u_, place(k));
  }
  return frames_[at];
}

Vec3 ContactPoints::position_before(int k, const ContactMemory& memory) const {
  if (chain_ == nullptr) return (*this)[k].at(memory.x);
  const auto at = static_cast<std::size_t>(k);
  if (before_in_[at] != before_) {
    before_in_[at] = before_;
    MovingFrame then = frames_[at];  // near there
    then.find(*chain_, memory.sections, (*this)[k].at(memory.x));
    position_before_.col(k) = then.rest();
  }
  return position_before_.col(k);
}

Vec3 ContactPoints::motion_of(int k, const WireMotion& motion) const {
  Vec3 moved = motion.of((*this)[k]);
  if (chain_ == nullptr) return moved;
  const MovingFrame& here = frame(k);
  Vec3 apart = moved;
  for (const SectionChain::Weight& weight : here.weights()) {
    apart -= weight.value * motion.of_section(weight.node);
  }
  return here.inverse() * apart;
}

void ContactPoints::scatter(int k, const WireMotion& motion, const Vec3& force,
                            Eigen::VectorXd& target) const {
  const Vec3 on_point = on_wire(k, force);
  motion.scatter((*this)[k], on_point, target);
  if (chain_ == nullptr) return;
  for (const SectionChain::Weight& weight : frame(k).weights()) {
    target.segment<3>(motion.sections_from() + 3 * weight.node) -= weight.value * on_point;
  }
}

void ContactPoints::free_from(double tip_distance) {
  const auto first = std::partition_point(
      points_.begin(), points_.end() - 1,
      [&](const ContactPoint& point) { return point.tip_distance > tip_distance + 1e-9; });
  first_free_ = static_cast<int>(first - points_.begin());
  asleep_until_.head(first_free_).setConstant(kAwake);
}

void ContactPoints::carry_back(const Eigen::VectorXd& from, double distance, Eigen::VectorXd& to) {
  // Tip distances fall along the points: walk through them and through where their forces go, from
  // the tip on. The tip's own goes with it.
  to.setZero();
  int target = size() - 1;
  const auto tip_distance = [&](int k) { return (*this)[k].tip_distance; };
  for (int k = size() - 1; k >= 0; --k) {
    if (from[k] == 0.0) continue;
    const double wanted = tip_distance(k) > 0.0 ? tip_distance(k) + distance : 0.0;
    while (target > 0 && tip_distance(target - 1) <= wanted) --target;
    const double past = wanted - tip_distance(target);  // it, toward the point before it
    const double part =
        target > 0 && past > 0.0 ? past / (tip_distance(target - 1) - tip_distance(target)) : 0.0;
    to[target] += (1.0 - part) * from[k];
    if (part > 0.0) to[target - 1] += part * from[k];
    asleep_until_.segment(std::max(0, target - 1), target > 0 ? 2 : 1).setConstant(kAwake);
  }
  if (chain_ != nullptr) carry_knowledge(distance);
}

/// Each point takes over what the point knew that was where it will be.
void ContactPoints::carry_knowledge(double distance) {
  const int step = distance > 0.0 ? 1 : -1, end = step > 0 ? size() : -1;
  const auto off = [&](int from, int k) {
    return std::abs((*this)[k].tip_distance - distance - (*this)[from].tip_distance);
  };
  int from = step > 0 ? 0 : size() - 1;
  for (int k = from; k != end; k += step) {
    while (from + step != end && off(from + step, k) <= off(from, k)) from += step;
    if (from == k || off(from, k) > kCarried) continue;
    const auto to = static_cast<std::size_t>(k), of = static_cast<std::size_t>(from);
    const double more = thinner(k) - thinner(from);
    std::swap(frames_[to], frames_[of]);
    known_position_.col(k) = known_position_.col(from);
    known_distance_[k] = known_distance_[from] + more;
    touched_[to] = touched_[of];
    if (touched_[of] == 0) continue;
    known_[to] = known_[of];
    known_[to].distance += more;
  }
  std::fill(framed_in_.begin(), framed_in_.end(), -1);
}

/// Whether a point is further from the wall than `near`, by what was known of it before: where it
/// is at rest to first order, and as much again for what that leaves. If so, it sleeps.
bool ContactPoints::is_away(int k, double near) {
  const auto at = static_cast<std::size_t>(k);
  if (touched_[at] != 0 || framed_in_[at] == state_ || !frames_[at].is_known()) return false;
  const Vec3 step = frames_[at].step_to(u_, place(k));
  const Vec3 moved = frames_[at].rest() + step - known_position_.col(k);
  const double least = known_distance_[k] - kLipschitz * (moved.norm() + step.norm());
  if (!(least >= near)) return false;
  asleep_until_[k] = travelled_ + (least - near) / kLipschitz;
  return true;
}

void ContactPoints::find_active(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& sections,
                                const Eigen::VectorXd& expected, ContactSample& sample) {
  const Eigen::Index moving = x.cols() - (*this)[first_free_].edge;
  double travelled = std::sqrt((x - x_).rightCols(moving).colwise().squaredNorm().maxCoeff());
  x_ = x;
  if (chain_ != nullptr) {
    travelled += std::sqrt((sections - u_).colwise().squaredNorm().maxCoeff());
    travelled *= kSheared;
    u_ = sections;
    ++state_;
  }
  travelled_ += travelled;
  sample.lost = false;
  sample.active.clear();
  // One that was far enough for its motion since is not looked at.
  for (int k = first_free_; k < size(); ++k) {
    if (asleep_until_[k] >= travelled_) continue;
    const double near = reach_ + (expected[k] > 0.0 ? kInSight : 0.0);
    if (chain_ != nullptr && is_away(k, near)) continue;
    const Vec3 p = position(k);
    const double least = least_distance(k, p);
    if (least >= near) {
      asleep_until_[k] = travelled_ + (least - near) / kLipschitz;
      continue;
    }
    const WallSample wall = look_at(k, p, near);
    asleep_until_[k] = travelled_ + (wall.distance - near) / kLipschitz;
    const bool touches = wall.distance < near;
    touched_[static_cast<std::size_t>(k)] = touches ? 1 : 0;
    if (!touches) continue;
    if (wall.gradient.squaredNorm() < kSmallestSlope * kSmallestSlope) {
      sample.lost = sample.lost || wall.distance < 0.0;
      continue;
    }
    sample.active.push_back({.point = k, .position = p, .wall = wall});
  }
}

/// How far from the wall a point is at least, now that it is at `position`.
double ContactPoints::least_distance(int k, const Vec3& position) const {
  return known_distance_[k] - kLipschitz * (position - known_position_.col(k)).norm();
}

/// The wall at point k, without derivatives where it is further than `near`.
WallSample ContactPoints::look_at(int k, const Vec3& position, double near) {
  const bool touched = touched_[static_cast<std::size_t>(k)] != 0;
  WallSample wall;
  if (!touched) wall.distance = lumen_.distance(position) + thinner(k);
  if (touched || wall.distance < near) {
    WallSample& known = known_[static_cast<std::size_t>(k)];
    const Vec3 moved = position - known_position_.col(k);
    if (touched && moved.squaredNorm() <= kSamePlace * kSamePlace) {
      const Vec3 turned = known.hessian * moved;
      wall.distance = known.distance + moved.dot(known.gradient + 0.5 * turned);
      wall.gradient = known.gradient + turned;
      wall.hessian = known.hessian;
      return wall;
    }
    known = lumen_.sample(position);
    known.distance += thinner(k);
    wall = known;
  }
  known_position_.col(k) = position;
  known_distance_[k] = wall.distance;
  return wall;
}

double ContactPoints::largest_safe_part(const WireMotion& motion, int looks) const {
  const double longest = (chain_ != nullptr ? kSheared : 1.0) * motion.longest();
  double cap = std::numeric_limits<double>::infinity();
  if (longest <= kInto) return cap;
  for (int k = first_free_; k < size(); ++k) {
    if (asleep_until_[k] >= travelled_ && longest <= kInto + reach_) continue;
    const Vec3 move = motion_of(k, motion), from = position(k);
    const double distance = least_distance(k, from);
    const double room = kInto + std::max(0.0, distance), length = move.norm();
    if (length > room && room < cap * length) {
      cap = std::min(cap, way_inside(k, from, move / length, length, distance, looks) / length);
    }
  }
  return cap;
}

/// How far a point may go from a place that is `distance` inside the wall, of `length`; infinite:
/// as far as it likes. Looks ahead in strides that are safe by the distance where they start.
double ContactPoints::way_inside(int k, const Vec3& from, const Vec3& toward, double length,
                                 double distance, int looks) const {
  const double deepest = std::min(0.0, distance);
  double way = 0.0;
  for (int look = 0; look < looks; ++look) {
    const double next = way + kInto + std::max(0.0, distance);
    if (next >= length) return std::numeric_limits<double>::infinity();
    distance = lumen_.distance(from + next * toward) + thinner(k);
    if (distance < deepest - kInto) return look == 0 ? next : way;
    way = next;
  }
  return way;
}

}  // namespace wireplan::simulate
