#include "simulate/insertion/tool_trial.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "preprocess/centerline/path_place.h"
#include "simulate/contact/contact_force.h"

namespace wireplan::simulate {
namespace {

constexpr double kToolStart = 4.0;                   // of the innermost in the vessel         [mm]
constexpr double kToolTip = 2.0;                     // that counts as a tip for its force     [mm]
constexpr double kToolOutside = 1.0;                 // penetration that contact does not explain
constexpr double kToolPatience = 25.0;               // of the last push, without progress     [mm]
constexpr double kToolTurnStep = 15.0 * kRadPerDeg;  // of a hub between two records
constexpr double kStepsPerRecord = 2.0;              // of the options; ...
constexpr double kPartOfStep = 0.5;                  // each made in parts of this ...
constexpr double kDivideLonger = 1.25;               // edges than asked for, ...
constexpr double kFiner[] = {1.06, 1.13};  // elements, where a move finds no equilibrium; chosen
constexpr double kLongestEdge = 1.45;      // ... of it: ToolBench::divide()
constexpr double kDivideShorter = 0.67;    // ... or shorter: the centreline is divided anew
constexpr double kAtEnd = 0.02;            // of a part: so near, a step is at what ends it; chosen
constexpr double kShortestToEnd = 0.1;     // of a part, near what ends it; chosen
constexpr double kTryAside = 10.0 * kRadPerDeg;  // of a tip: it is turned to the branch first
constexpr double kSteerAstray = 10.0;  // pushed on in another vessel: less may pass its mouth [mm]
constexpr int kSteerPlaces = 4;        // each so much further back; near the access ...
constexpr int kSteersOfRound = 8, kSteerShift = 2;          // the next time round from other places
constexpr double kSteerShare = 0.6, kSteerShareLess = 0.1;  // ... so much of the insertion
constexpr double kBackPush = 10.0;   // that turns a tip back by a radian, near the end      [mm]
constexpr double kLooksAside = 0.1;  // sine, of a tip against the trunk: less looks nowhere

std::string in_mm(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", value);
  return text;
}

bool moves(const ToolStep& step, std::size_t tool) {
  return step.tool == kBothTools || step.tool == static_cast<int>(tool);
}

ToolScene scene_of(const std::vector<Tool>& tools, const Introducer& introducer,
                   const VesselModel& vessel, const ToolTrialOptions& options) {
  ToolScene scene;
  scene.tools = tools;
  for (Tool& tool : scene.tools) tool.wire.friction = friction_of(tool.wire, options.insertion);
  scene.places.assign(tools.size(), {.insertion = 0.0, .roll = introducer.roll});
  scene.places.back().insertion = kToolStart;
  scene.point = introducer.point;
  scene.direction = introducer.direction;
  scene.vessel = &vessel;
  scene.contact.law = options.insertion.contact_law;
  scene.contact.friction = options.insertion.friction;
  scene.contact.support_factor = options.insertion.support_factor;
  scene.friction = options.friction_between;
  scene.element_length = options.insertion.element_length;
  scene.loads.gravity = options.insertion.gravity;
  scene.longest_part = std::min(kLongestToolPart, kPartOfStep * options.insertion.step);
  scene.cut_jumps = false;
  scene.residual_tolerance = options.insertion.residual_tolerance;
  scene.max_iterations = options.insertion.max_iterations;
  return scene;
}

}  // namespace

ToolTrial::ToolTrial(const std::vector<Tool>& tools, const Introducer& introducer, const Goal& goal,
                     const VesselModel& vessel, const ToolTrialOptions& options)
    : goal_(goal),
      vessel_(vessel),
      options_(options),
      bench_(scene_of(tools, introducer, vessel, options)),
      start_roll_(introducer.roll) {
  expects(!goal.at_section || goal.way);
  start_energy_ = bench_.record().energy.total();
  record_.roll = introducer.roll;
  record_.terms = name_terms(bench_.composite().rod, {"tools"}, &vessel,
                             friction_of(tools.back().wire, options.insertion));
  for (const Tool& tool : tools) record_.tools.emplace_back().name = tool.wire.name;
  best_distance_ = (tip(static_cast<int>(tools.size()) - 1) - goal.point).norm();
  if (!bench_.settled()) {
    end(Outcome::kNotConverged, "no equilibrium of the tools at the introducer");
  }
}

double ToolTrial::insertion(int tool) const {
  return bench_.places()[static_cast<std::size_t>(tool)].insertion;
}

double ToolTrial::foremost() const {
  double most = 0.0;
  for (const ToolPlace& place : bench_.places()) most = std::max(most, place.insertion);
  return most;
}

double ToolTrial::foremost_of(int tool) const {
  return tool == kBothTools ? foremost() : insertion(tool);
}

Vec3 ToolTrial::tip(int tool) const { return bench_.at_rest(bench_.nodes_of(tool).rightCols<1>()); }

Vec3 ToolTrial::foremost_tip() const { return bench_.at_rest(bench_.state().x.rightCols<1>()); }

Vec3 ToolTrial::tip_direction(int tool) const {
  const Eigen::Matrix3Xd all = bench_.nodes_of(tool);
  if (all.cols() < 2) return bench_.state().x.col(1) - bench_.state().x.col(0);
  const Eigen::Matrix3Xd nodes =
      bench_.at_rest(all.rightCols(std::min<Eigen::Index>(3, all.cols())));
  return (nodes.rightCols<1>() - nodes.leftCols<1>()).normalized();
}

/// How far a tip is in that vessel or what leaves it.
double ToolTrial::depth_in(const SideVessel& side, const Vec3& tip) const {
  const std::optional<double> arc = find_arc_on(goal_.way->tree(), side.branch, tip);
  const double depth = arc ? *arc - side.from : -1.0;
  return depth > 0.0 ? depth : -(tip - side.take_off.point).norm();
}

double ToolTrial::measure(Until until, int tool, int side) const {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  if (!options_.take_off || !goal_.way) return unknown;
  const auto& sides = options_.sides;
  const auto own = std::find_if(sides.begin(), sides.end(),
                                [&](const SideVessel& one) { return one.branch == side; });
  if (side >= 0 && own == sides.end()) return unknown;
  const TakeOff& branch = side >= 0 ? own->take_off : *options_.take_off;
  const int watched = tool == kBothTools ? 0 : tool;
  if (until == Until::kInBranch) {
    if (side >= 0) return depth_in(*own, tip(watched));
    return goal_.way->find_progress(tip(watched)) - branch.arc;
  }
  if (until == Until::kLevel) return (tip(watched) - branch.point).dot(branch.trunk);
  const Vec3 looks = tip_direction(watched);
  if (until == Until::kBack) {
    const double onward = looks.dot(goal_.way->direction_at(tip(watched)));
    return std::acos(std::clamp(onward, -1.0, 1.0));
  }
  const Vec3 aside = looks - looks.dot(branch.trunk) * branch.trunk;
  const Vec3 to = branch.branch - branch.branch.dot(branch.trunk) * branch.trunk;
  if (until == Until::kMade || aside.norm() < kLooksAside || to.norm() < kLooksAside)
    return unknown;
  return std::atan2(branch.trunk.dot(to.cross(aside)), to.dot(aside));
}

/// How much of the step is left until what ends it [mm of push, rad of turn]; at most 0 where that
/// has come. Empty where nothing ends it.
std::optional<double> ToolTrial::missing(const ToolStep& step) const {
  const double now = step.until == Until::kMade ? NAN : measure(step.until, step.tool, step.side);
  if (!std::isfinite(now)) return {};
  if (step.until == Until::kInBranch) return step.at - now;
  if (step.until == Until::kLevel) return step.push > 0.0 ? step.at - now : now - step.at;
  if (step.until == Until::kBack) return (step.at - now) * (step.turn == 0.0 ? kBackPush : 1.0);
  // The tip has passed what ends it by a quarter turn at most; beyond that it has yet to come.
  double left = std::remainder(step.at - now, 2.0 * kPi);
  if (step.turn < 0.0) left = -left;
  return left < -0.5 * kPi ? left + 2.0 * kPi : left;
}

bool ToolTrial::make(const ToolStep& step, bool last) {
  expects(!step.seats && step.tool >= kBothTools &&
          step.tool < static_cast<int>(record_.tools.size()));
  expects(std::min(step.tries, step.steers) == 0);
  expects(std::max(step.tries, step.steers) == 0 || (step.tool > 0 && step.push > 0.0));
  ++step_;
  const bool reshapes = step.side >= 0 || step.until == Until::kBack;
  record_.reshaped = record_.reshaped || (reshapes && step.tool <= 0);
  const TryPlace from = step.tries > 0 ? place_of_try(step.tool) : TryPlace{};
  if (step.spare >= 0) {
    exchange(step);
  } else if (step.steers > 0) {
    make_steered(step, last);
  } else {
    ToolStep again = step;
    const double looks = step.tries > 0 ? measure(Until::kFacing, step.tool - 1) : 0.0;
    if (std::abs(looks) > kTryAside) again.try_turn = -std::copysign(step.try_turn, looks);
    for (int tried = 0; advance(step, last, tried < step.tries); ++tried) {
      try_again(again, from, tried + 1);
    }
  }
  keep_end_of_step();
  return !ended();
}

/// The end of each step is looked at.
void ToolTrial::keep_end_of_step() {
  if (ended() || !options_.insertion.map_forces || since_shape_ == 0.0) return;
  since_shape_ = 0.0;
  record_.shapes.push_back(shape_here());
}

/// Part by part. True where it stops since the tool passes the branch by or comes no further, if
/// that is looked for, or loses the way, if it is to be steered.
bool ToolTrial::advance(const ToolStep& step, bool last, bool looks) {
  const double whole = std::abs(step.push) + std::abs(step.turn) / kToolTurnStep;
  const double most = step.turn == 0.0 ? kStepsPerRecord * options_.insertion.step : 1.0;
  const double unit = step.turn == 0.0 ? 1.0 : kToolTurnStep;
  furthest_ = since_furthest_ = 0.0;
  for (double done = 0.0; whole - done > 1e-9 && !ended();) {
    double by = std::min(most, whole - done);
    if (const std::optional<double> left = missing(step)) {
      if (*left / unit < kAtEnd * most) break;
      by = std::min(by, std::max(kShortestToEnd * most, *left / unit));
    }
    if (last && step.push > 0.0) {
      by = std::min(by, longest() - foremost_of(step.tool));
      if (by < 1e-9) break;
    }
    if (!part({.tool = step.tool, .push = by / whole * step.push, .turn = by / whole * step.turn}))
      break;
    done += by;
    if (looks && passes_by(step)) return true;
    // Within another tool it brings no tip on.
    const bool leads = foremost_of(step.tool) > foremost() - 1e-9;
    if (!leads || step.push <= 0.0) continue;
    const bool at_end = step.steers > 0 && is_near_end(step.tool, kSteerBeforeEnd);
    if (step.steers > 0 && may_lose_way()) {
      if (loses_way(by)) return true;
    } else if (looks && goal_.way && !at_end) {
      if (!comes_further(by) && since_furthest_ > kToolPatience) return true;
    } else if (at_end || (last && !check_advance(by))) {
      break;
    }
  }
  return false;
}

/// So far the last step may bring the foremost tip: more by the way up to a reshaped catheter's
/// knee and back.
double ToolTrial::longest() const {
  if (!record_.reshaped || !options_.take_off) return options_.insertion.length;
  const TakeOff& branch = *options_.take_off;
  const Eigen::Matrix3Xd nodes = bench_.at_rest(bench_.nodes_of(0));
  const double knee = (branch.trunk.transpose() * (nodes.colwise() - branch.point)).maxCoeff();
  return options_.insertion.length + 2.0 * std::max(0.0, knee);
}

/// Up to the take-off, past the vessels that the tip goes into.
void ToolTrial::make_steered(const ToolStep& step, bool last) {
  const int outer = step.tool - 1;
  const double to = insertion(step.tool) + step.push, outer_was = insertion(outer);
  double lost_at = 0.0, came = 0.0, turned = 0.0;
  ToolStep rest = step;
  for (int tried = 0; advance(rest, last, false); ++tried, rest.push = to - insertion(step.tool)) {
    lost_at = std::max(lost_at, insertion(step.tool) - since_furthest_);
    came = std::max(came, furthest_);
    if (tried == step.steers) {
      if (goal_.way->find_astray(foremost_tip())) {
        return end_where_it_is(Outcome::kStuck,
                               "the tip came no further than " + in_mm(came) + " along the way");
      }
      rest.steers = 0;  // it is in the way's vessel, as far as that is known
      continue;
    }
    ++tries_;
    const int place = (tried + kSteerShift * (tried / kSteersOfRound)) % kSteerPlaces;
    const double start = std::max(lost_at - kSteerBack - place * kSteerFurther,
                                  lost_at * (kSteerShare - place * kSteerShareLess));
    const double behind = std::min(kSteerBehind, 0.5 * start);
    move_by({.tool = step.tool, .push = start - insertion(step.tool)});
    move_by({.tool = outer, .push = std::max(outer_was, start - behind) - insertion(outer)});
    if (tried > 0) {
      move_by({.tool = outer, .turn = kSteerTurn});
      turned += kSteerTurn;
    }
  }
  move_by({.tool = outer, .push = outer_was - insertion(outer)});
  move_by({.tool = outer, .turn = -turned});
}

/// Whether the tip is still on its way up to the take-off, where it may be steered.
bool ToolTrial::may_lose_way() const {
  return goal_.way && options_.take_off && furthest_ < options_.take_off->arc - kSteerNear;
}

/// Whether the tip goes into another vessel or comes no further.
bool ToolTrial::loses_way(double pushed) {
  if (comes_further(pushed)) return false;
  return since_furthest_ > kToolPatience ||
         (since_furthest_ > kSteerAstray && goal_.way->find_astray(foremost_tip()).has_value());
}

/// A part of a step, which is recorded; false where it ends the trial or the tool has no length
/// left for it.
bool ToolTrial::part(const ToolStep& step) {
  const std::size_t count = record_.tools.size();
  ToolMove move{std::vector<double>(count, 0.0), std::vector<double>(count, 0.0)};
  // Some of the tools stays in the body, and the hubs outside.
  double pushed = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    if (!moves(step, k)) continue;
    double others = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!moves(step, i)) others = std::max(others, bench_.places()[i].insertion);
    }
    const double here = bench_.places()[k].insertion;
    const double least = others >= kToolStart ? 0.0 : kToolStart;
    const double to =
        std::clamp(here + step.push, std::min(least, here), bench_.tools()[k].wire.length());
    move.push[k] = to - here;
    move.turn[k] = step.turn;
    pushed = std::max(pushed, std::abs(move.push[k]));
  }
  if (step.turn == 0.0 && pushed < 1e-9) return false;
  if (!divide_for(move)) {
    end(Outcome::kNotConverged, "no equilibrium of the tools with shorter elements after " +
                                    in_mm(foremost()) + " of insertion");
    return false;
  }
  if (!move_or_divide(move)) {
    if (bench_.through_wall()) {
      end(Outcome::kLeftLumen, "a tool goes through the wall after " + in_mm(foremost()) +
                                   " of insertion, near " +
                                   place_text(bench_.state().x.rightCols<1>()) + " mm");
    } else {
      end(Outcome::kNotConverged, "no equilibrium after " + in_mm(foremost()) +
                                      " of insertion, tip at " +
                                      place_text(bench_.state().x.rightCols<1>()) + " mm");
    }
    return false;
  }
  note(step);
  check_place();
  return !ended();
}

/// Makes the move. Where it finds no equilibrium, the rest of it is tried with the centreline
/// divided a little finer: nodes then lie elsewhere at ridges of the wall, and friction is spread
/// anew.
bool ToolTrial::move_or_divide(const ToolMove& move) {
  const std::vector<ToolPlace> start = bench_.places();
  if (bench_.move(move)) return true;
  for (const double finer : kFiner) {
    ToolMove rest = move;
    double next = foremost();
    for (std::size_t i = 0; i < start.size(); ++i) {
      rest.push[i] += start[i].insertion - bench_.places()[i].insertion;
      rest.turn[i] += start[i].roll - bench_.places()[i].roll;
      next = std::max(next, bench_.places()[i].insertion + rest.push[i]);
    }
    if (bench_.through_wall()) return false;
    if (bench_.divide(finer * next) && bench_.move(rest)) return true;
  }
  return false;
}

/// Divides the centreline where the move would make its edges too long, or they are much shorter
/// than asked for. False where edges would be so long that contact has no place.
bool ToolTrial::divide_for(const ToolMove& move) {
  double next = foremost();
  for (std::size_t i = 0; i < move.push.size(); ++i) {
    next = std::max(next, bench_.places()[i].insertion + move.push[i]);
  }
  const double asked = options_.insertion.element_length;
  const double elements = static_cast<double>(bench_.composite().rod.rest_length.size());
  const bool longer = next > kDivideLonger * asked * elements;
  const bool shorter = foremost() < kDivideShorter * asked * elements && foremost() > 4.0 * asked;
  if (!longer && !shorter) return true;
  return bench_.divide(next) || next < kLongestEdge * asked * elements;
}

/// Forces and shape of the present equilibrium.
void ToolTrial::note(const ToolStep& step) {
  const ToolRecord& now = bench_.record();
  const std::vector<Touch> touches = bench_.touches();
  Push push;
  push.insertion = foremost();
  push.tip = bench_.state().x.rightCols<1>();
  push.hub_angle = now.tools.front().place.roll - start_roll_;
  for (std::size_t i = 0; i < now.tools.size(); ++i) {
    if (moves(step, i)) push.push_force += now.tools[i].push_force;
  }
  push.hub_torque = now.tools.front().hub_torque;
  std::vector<Vec3> sums;
  push.peak_contact_force = peak_force_on_length(touches, kContactLength, sums);
  for (const Touch& touch : touches) {
    push.total_contact_force += touch.normal_force;
    push.friction_force += touch.friction.norm();
    push.max_penetration = std::max(push.max_penetration, touch.penetration);
    if (touch.wall_displacement > push.wall_displacement) {
      push.wall_displacement = touch.wall_displacement;
      const double radius = bench_.composite().rod.radius - touch.thinner;
      push.wall_displacement_point = touch.position - radius * touch.normal;
    }
  }
  for (std::size_t i = 0; i < record_.tools.size(); ++i) {
    // Of the wall on its last 2 mm, as far as it is the outermost there.
    const double behind = push.insertion - now.tools[i].place.insertion;
    Vec3 at_tip = Vec3::Zero();
    bool inside = false;
    for (std::size_t k = 0; k < i; ++k) {
      inside = inside || now.tools[k].place.insertion >= now.tools[i].place.insertion;
    }
    for (const Touch& touch : touches) {
      const double share = part_within(touch, behind + kToolTip) - part_within(touch, behind);
      if (!inside) at_tip += share * force_on_wire(touch);
    }
    ToolTrack& track = record_.tools[i];
    track.insertion.push_back(now.tools[i].place.insertion);
    track.roll.push_back(now.tools[i].place.roll - start_roll_);
    track.push_force.push_back(now.tools[i].push_force);
    track.hub_torque.push_back(now.tools[i].hub_torque);
    track.tip_force.push_back(at_tip.norm());
    track.wall_force.push_back(now.tools[i].wall_force);
    push.tip_force = std::max(push.tip_force, at_tip.norm());
  }
  const RodState& state = bench_.state();
  const double h = bench_.composite().rod.rest_length[0];
  for (Eigen::Index i = 1; i + 1 < state.x.cols(); ++i) {
    const Vec3 before = (state.x.col(i) - state.x.col(i - 1)).normalized(),
               after = (state.x.col(i + 1) - state.x.col(i)).normalized();
    push.peak_curvature = std::max(push.peak_curvature, (after - before).norm() / h);
  }
  push.push_work = now.work;
  push.stored_energy = now.energy.total() - start_energy_;
  push.friction_work = now.heat;
  push.unbalanced = now.unbalanced;
  push.residual = now.residual;
  push.iterations = now.iterations;
  record_.pushes.push_back(push);
  if (vessel_.sections) record_.tips_at_rest.push_back(foremost_tip());
  record_.steps.push_back(step_);
  if (options_.insertion.map_forces) {
    std::map<int, double> forces;
    for (const Touch& touch : touches) {
      const WireContact contact =
          contact_of(touch, bench_.composite().rod.radius - touch.thinner, vessel_.locator);
      if (contact.triangle >= 0) forces[contact.triangle] += touch.normal_force;
    }
    for (const auto& [triangle, force] : forces) {
      const auto slot = static_cast<std::size_t>(triangle);
      if (peak_.size() <= slot) peak_.resize(slot + 1, 0.0);
      peak_[slot] = std::max(peak_[slot], force);
    }
  }
  since_shape_ += std::abs(step.push) +
                  std::abs(step.turn) / (2.0 * kToolTurnStep) * options_.insertion.record_every;
  if (since_shape_ >= options_.insertion.record_every - 1e-9) {
    since_shape_ = 0.0;
    record_.shapes.push_back(shape_here());
  }
}

Shape ToolTrial::shape_here() const {
  const RodState& state = bench_.state();
  Shape shape{.insertion = foremost(),
              .hub_angle = bench_.places().front().roll - start_roll_,
              .nodes = state.x,
              .sections = state.sections,
              .contact_force = Eigen::VectorXd::Zero(state.x.cols())};
  for (const Touch& touch : bench_.touches()) {
    const double force = force_on_wire(touch).norm();
    shape.contact_force[touch.edge] += (1.0 - touch.part) * force;
    if (touch.part > 0.0) shape.contact_force[touch.edge + 1] += touch.part * force;
  }
  for (const ToolPlace& place : bench_.places()) shape.tools.push_back(place.insertion);
  return shape;
}

/// Ends the trial where the last step brought the tip to the goal, or out of the vessel.
void ToolTrial::check_place() {
  const Push& push = record_.pushes.back();
  const std::string after = " after " + in_mm(push.insertion) + " of insertion";
  if (push.max_penetration > kToolOutside) {
    return end(Outcome::kLeftLumen, in_mm(push.max_penetration) + " through the wall" + after +
                                        ", tip at " + place_text(push.tip) + " mm");
  }
  const Vec3 here = foremost_tip();
  const double to_goal = (here - goal_.point).norm();
  const bool counts = !seating_ && !awaits_spare();
  if (counts && !goal_.at_section && best_distance_ <= goal_.radius && to_goal >= best_distance_) {
    return end(Outcome::kReached, "tip " + in_mm(best_distance_) + " from the target" + after);
  }
  best_distance_ = to_goal;
  const bool near = counts && goal_.at_section && goal_.way->may_have_arrived(here);
  const std::vector<preprocess::Opening>& openings = vessel_.lumen.openings();
  if (!near && !preprocess::may_have_left(openings, here)) return;
  const Eigen::Matrix3Xd nodes = bench_.at_rest(bench_.state().x);
  if (const auto before = near ? goal_.way->find_arrival(nodes, vessel_.lumen) : std::nullopt) {
    const std::optional<std::string> detour =
        goal_.way->find_detour(nodes.leftCols(*before + 1), record_.reshaped);
    if (detour) {
      return end(Outcome::kAnotherWay,
                 "the tip passes the target" + after +
                     ", but the tools did not come along the way: " + *detour);
    }
    const double from_axis = preprocess::find_place(here, goal_.way->path()).from_axis;
    return end(Outcome::kReached, "tip past the target's cross-section, " + in_mm(from_axis) +
                                      " from the vessel's axis," + after);
  }
  if (const std::optional<int> opening = preprocess::left_through(openings, nodes)) {
    const Vec3& center = openings[static_cast<std::size_t>(*opening)].center;
    const std::string name = goal_.way ? goal_.way->name_at(center) : std::string();
    return end_where_it_is(Outcome::kLeftImage, "a tool left the imaged vessel through its end" +
                                                    (name.empty() ? "" : " in " + name) + " at " +
                                                    place_text(center) + " mm" + after);
  }
}

/// Whether a push brings the tip further along the way than this step has yet.
bool ToolTrial::comes_further(double pushed) {
  const double progress = goal_.way->find_progress(foremost_tip());
  const bool further = progress > furthest_;
  since_furthest_ = further ? 0.0 : since_furthest_ + pushed;
  if (further) furthest_ = progress;
  return further;
}

/// Whether the last step of a script goes on: its push brings the tip further along the way.
bool ToolTrial::check_advance(double pushed) {
  if (!goal_.way || ended()) return !ended();
  if (comes_further(pushed) || since_furthest_ <= kToolPatience) return true;
  const Push& push = record_.pushes.back();
  const double progress = goal_.way->find_progress(foremost_tip());
  end_where_it_is(progress > 0.0 ? Outcome::kStuck : Outcome::kMissed,
                  "the tip came no further than " + in_mm(furthest_) + " along the way while " +
                      in_mm(since_furthest_) + " more went in, and is at " + place_text(push.tip) +
                      " mm");
  return false;
}

/// As `outcome`, unless the tip is not on the way: then that is the outcome.
void ToolTrial::end_where_it_is(Outcome outcome, const std::string& reason) {
  const std::optional<Astray> astray =
      goal_.way ? goal_.way->find_astray(foremost_tip()) : std::nullopt;
  if (!astray) return end(outcome, reason);
  end(outcome_of(*astray), describe(*astray) + "; " + reason);
}

void ToolTrial::end(Outcome outcome, const std::string& reason) {
  outcome_ = record_.outcome = outcome;
  record_.reason = reason;
  if (outcome == Outcome::kReached) arrived_ = reason;
  if (tries_ > 0) {
    record_.reason +=
        "; tried again " + std::to_string(tries_) + (tries_ == 1 ? " time" : " times");
  }
  record_.reason += describe_balance(record_.pushes);
}

TrialResult ToolTrial::finish() {
  if (!ended() && !awaits_spare() && !goal_.at_section && best_distance_ <= goal_.radius) {
    end(Outcome::kReached, "tip " + in_mm(best_distance_) + " from the target after " +
                               in_mm(foremost()) + " of insertion");
  }
  if (!ended()) {
    const Vec3 tip_here = foremost_tip();
    const std::string reason = "the script ends with the tip at " +
                               place_text(bench_.state().x.rightCols<1>()) + " mm, " +
                               in_mm((tip_here - goal_.point).norm()) + " from the target";
    record_.pushes.empty() ? end(Outcome::kMissed, reason)
                           : end_where_it_is(Outcome::kMissed, reason);
  }
  record_.nodes = bench_.state().x;
  record_.sections = bench_.state().sections;
  if (vessel_.sections) record_.nodes_at_rest = bench_.at_rest(record_.nodes);
  for (const Touch& touch : bench_.touches()) {
    record_.contacts.push_back(
        contact_of(touch, bench_.composite().rod.radius - touch.thinner, vessel_.locator));
  }
  for (std::size_t k = 0; k < peak_.size(); ++k) {
    if (peak_[k] > 0.0) record_.peak_forces.push_back({static_cast<int>(k), peak_[k]});
  }
  record_.shapes.push_back(shape_here());
  return record_;
}

}  // namespace wireplan::simulate
