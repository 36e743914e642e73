#include "simulate/insertion/trial.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "preprocess/centerline/path_place.h"

namespace wireplan::simulate {

const char* outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kReached:
      return "reached";
    case Outcome::kMissed:
      return "missed";
    case Outcome::kPassedBy:
      return "passed_by";
    case Outcome::kWrongBranch:
      return "wrong_branch";
    case Outcome::kLeftImage:
      return "left_image";
    case Outcome::kStuck:
      return "stuck";
    case Outcome::kProlapsed:
      return "prolapsed";
    case Outcome::kLeftLumen:
      return "left_lumen";
    case Outcome::kNotConverged:
      return "not_converged";
    case Outcome::kFailed:
      return "failed";
  }
  return "failed";
}

namespace {

constexpr double kStuckPush = 20.0;    // pushing so far ...                               [mm]
constexpr double kStuckMove = 2.0;     // ... while the tip moves less than this is stuck  [mm]
constexpr double kProlapseMove = 0.5;  // ... or by less than this part of it, with a fold
constexpr double kOutside = 1.0;       // penetration that contact does not explain        [mm]
// A push without progress along the way; in the trials of five cases none of those given up would
// have reached (plan/MEASUREMENTS.md).
constexpr double kPatience = 40.0;        //                                               [mm]
constexpr double kPatienceBeyond = 10.0;  // where the tip is as far as a goal's sphere    [mm]

constexpr double kTurnStep = 15.0 * kRadPerDeg;      // of the hub between two records
constexpr double kTurnPerShape = 30.0 * kRadPerDeg;  // of the hub between two shapes

std::string millimetres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", value);
  return text;
}

}  // namespace

Trial::Trial(const Wire& wire, const Introducer& introducer, const Goal& goal,
             const VesselModel& vessel, const InsertionOptions& options)
    : goal_(goal),
      vessel_(vessel),
      options_(options),
      insertion_(wire, introducer, vessel, options),
      best_distance_((insertion_.tip() - goal.point).norm()) {
  expects(!goal.at_section || goal.way);
  result_.terms = name_terms(insertion_.rod(), {}, &vessel, options.friction);
}

void Trial::make(const Move& move) {
  expects(move.push == 0.0 || move.turn == 0.0);
  const double whole = std::abs(move.push) + std::abs(move.turn);
  const double most = move.turn == 0.0 ? options_.step : kTurnStep;
  for (double done = 0.0; whole - done > 1e-9; done += most) {
    const double part = std::min(most, whole - done) / whole;
    if (!step({part * move.push, part * move.turn})) return;
  }
}

bool Trial::step(const Move& move) {
  if (ended_) return false;
  // Some wire stays in the body, so that there is something to find an equilibrium of.
  const double depth = insertion_.depth();
  const double most_back = std::max(0.0, depth - options_.step);
  const double distance = std::clamp(move.push, -most_back, insertion_.longest() - depth);
  if (move.turn == 0.0 && std::abs(distance) < 1e-9) return false;
  const std::optional<Push> push =
      move.turn == 0.0 ? insertion_.push(distance) : insertion_.turn(move.turn);
  if (!push) {
    insertion_.take_back();
    if (const std::optional<int> opening = insertion_.slipped_out()) {
      return end_where_it_is(Outcome::kLeftImage,
                             "the wire springs out of the vessel through the opening at " +
                                 place_of(*opening) + " after " + millimetres(depth) +
                                 " of insertion, from " + place_text(insertion_.tip()) + " mm");
    }
    return end(Outcome::kNotConverged, "no equilibrium after " + millimetres(depth) +
                                           " of insertion, tip at " + place_text(insertion_.tip()) +
                                           " mm");
  }
  // Inside a sphere the wire goes on until the tip is nearest to its centre.
  const double to_goal = (push->tip - goal_.point).norm();
  if (!goal_.at_section && best_distance_ <= goal_.radius && to_goal >= best_distance_) {
    insertion_.take_back();
    return end(Outcome::kReached, reached_reason());
  }
  best_distance_ = to_goal;
  result_.pushes.push_back(*push);
  if (distance <= 0.0) pushing_since_ = result_.pushes.size();
  since_shape_ += std::abs(distance) + std::abs(move.turn) / kTurnPerShape * options_.record_every;
  if (!check_place() || !check_advance(distance) || !check_motion()) return false;
  if (since_shape_ >= options_.record_every - 1e-9) record_shape();
  return true;
}

std::string Trial::place_of(int opening) const {
  return place_text(vessel_.lumen.openings()[static_cast<std::size_t>(opening)].center) + " mm";
}

/// Whether the last step left the tip in the vessel and before the goal. Ends the trial otherwise.
bool Trial::check_place() {
  const Push& push = result_.pushes.back();
  const std::string after = " after " + millimetres(push.insertion) + " of insertion";
  if (push.max_penetration > kOutside) {
    return end(Outcome::kLeftLumen, millimetres(push.max_penetration) + " through the wall" +
                                        after + ", tip at " + place_text(push.tip) + " mm");
  }
  if (goal_.at_section) {
    const Eigen::Matrix3Xd wire = insertion_.free_nodes();
    if (goal_.way->find_arrival(wire, vessel_.lumen)) {
      const std::optional<std::string> detour = goal_.way->find_detour(wire);
      if (!detour) return end(Outcome::kReached, reached_reason());
      return end(Outcome::kProlapsed, "the tip passes the target" + after +
                                          ", but the wire did not come along the way: " + *detour);
    }
  }
  if (const std::optional<int> opening = insertion_.left_through()) {
    return end_where_it_is(
        Outcome::kLeftImage,
        "the wire left the imaged vessel through its end at " + place_of(*opening) + after);
  }
  const std::optional<int> image_end =
      goal_.way ? goal_.way->find_image_end(push.tip, vessel_.lumen) : std::nullopt;
  if (image_end) {
    return end_where_it_is(Outcome::kLeftImage,
                           "the tip came to the end of the imaged vessel, branch " +
                               std::to_string(*image_end + 1) + ", at " + place_text(push.tip) +
                               " mm" + after + "; the artery goes on there, the image does not");
  }
  return true;
}

/// Whether the tip still comes further along the way. Ends the trial otherwise.
bool Trial::check_advance(double distance) {
  if (!goal_.way) return true;
  const Push& push = result_.pushes.back();
  const Centerline& path = goal_.way->path();
  const double progress = preprocess::find_progress(push.tip, path);
  if (distance <= 0.0 || progress > furthest_) {
    furthest_ = progress;
    since_furthest_ = 0.0;
    return true;
  }
  since_furthest_ += distance;
  const double whole = path.arc_length(path.arc_length.size() - 1);
  const bool beside_goal = !goal_.at_section && furthest_ >= whole - goal_.radius;
  if (since_furthest_ <= (beside_goal ? kPatienceBeyond : kPatience)) return true;
  if (beside_goal) {
    return end(Outcome::kMissed, "the tip went by the target, " + millimetres(best_distance_) +
                                     " from its point in the end, after " +
                                     millimetres(push.insertion) + " of insertion");
  }
  return end_where_it_is(progress > 0.0 ? Outcome::kStuck : Outcome::kMissed,
                         "the tip came no further than " + millimetres(furthest_) +
                             " along the way while " + millimetres(since_furthest_) +
                             " of wire went in, and is at " + place_text(push.tip) + " mm");
}

/// Whether the tip moves on as it is pushed. Ends the trial otherwise.
bool Trial::check_motion() {
  const Push& push = result_.pushes.back();
  const std::size_t back = static_cast<std::size_t>(std::ceil(kStuckPush / options_.step));
  if (result_.pushes.size() - pushing_since_ <= back) return true;
  const Push& then = result_.pushes[result_.pushes.size() - 1 - back];
  const double went = push.insertion - then.insertion;
  const double moved = (push.tip - then.tip).norm();
  const std::optional<Vec3> fold =
      moved < kProlapseMove * went ? insertion_.find_fold() : std::nullopt;
  if (fold) {
    const std::optional<std::string> detour =
        goal_.way ? goal_.way->find_detour(insertion_.free_nodes()) : std::nullopt;
    return end_where_it_is(Outcome::kProlapsed, "the wire folds back at " + place_text(*fold) +
                                                    " mm after " + millimetres(push.insertion) +
                                                    " of insertion; its tip is behind at " +
                                                    place_text(push.tip) + " mm" +
                                                    (detour ? "; " + *detour : ""));
  }
  if (moved < kStuckMove) {
    return end_where_it_is(Outcome::kStuck, "the tip stays at " + place_text(push.tip) +
                                                " mm while " + millimetres(went) +
                                                " of wire went in; the wire bends most at " +
                                                place_text(insertion_.most_bent()) + " mm");
  }
  return true;
}

void Trial::record_shape() {
  since_shape_ = 0.0;
  const int first = insertion_.first_free();
  result_.shapes.push_back({.insertion = insertion_.depth(),
                            .hub_angle = insertion_.hub_angle(),
                            .nodes = insertion_.free_nodes(),
                            .contact_force = insertion_.forces()
                                                 .rightCols(insertion_.rod().nodes() - first)
                                                 .colwise()
                                                 .norm()
                                                 .transpose()});
}

/// As `outcome`, unless the tip is in another vessel: then that is the outcome. Always false.
bool Trial::end_where_it_is(Outcome outcome, const std::string& reason) {
  const std::optional<Astray> astray =
      goal_.way ? goal_.way->find_astray(insertion_.tip()) : std::nullopt;
  if (!astray) return end(outcome, reason);
  return end(astray->passed_by ? Outcome::kPassedBy : Outcome::kWrongBranch,
             "the tip is not on the way: " + astray->text + "; " + reason);
}

/// Keeps the final shape. Always false.
bool Trial::end(Outcome outcome, const std::string& reason) {
  ended_ = true;
  result_.outcome = outcome;
  result_.reason = reason;
  result_.nodes = insertion_.free_nodes();
  result_.contacts = insertion_.contacts();
  result_.peak_forces = insertion_.peak_forces();
  const bool recorded = !result_.shapes.empty() &&
                        result_.shapes.back().insertion == insertion_.depth() &&
                        result_.shapes.back().hub_angle == insertion_.hub_angle();
  if (!recorded) record_shape();
  return false;
}

std::string Trial::reached_reason() const {
  if (goal_.at_section) {
    const double from_axis = preprocess::find_place(insertion_.tip(), goal_.way->path()).from_axis;
    return "tip past the target's cross-section, " + millimetres(from_axis) +
           " from the vessel's axis, after " + millimetres(insertion_.depth()) + " of insertion";
  }
  return "tip " + millimetres(best_distance_) + " from the target after " +
         millimetres(insertion_.depth()) + " of insertion";
}

TrialResult Trial::finish() {
  if (!ended_ && !goal_.at_section && best_distance_ <= goal_.radius) {
    end(Outcome::kReached, reached_reason());
  } else if (!ended_) {
    const bool all = insertion_.longest() - insertion_.depth() < 1e-9;
    end_where_it_is(Outcome::kMissed, (all ? "all " : "") + millimetres(insertion_.depth()) +
                                          " of wire went in, tip ended " +
                                          millimetres(best_distance_) + " from the target at " +
                                          place_text(insertion_.tip()) + " mm");
  }
  return std::move(result_);
}

void Trial::save(Mark& mark) const {
  expects(!ended_);
  insertion_.save(mark.insertion);
  mark.pushes = result_.pushes.size();
  mark.shapes = result_.shapes.size();
  mark.pushing_since = pushing_since_;
  mark.best_distance = best_distance_;
  mark.since_shape = since_shape_;
  mark.furthest = furthest_;
  mark.since_furthest = since_furthest_;
}

void Trial::restore(const Mark& mark) {
  ended_ = false;
  insertion_.restore(mark.insertion);
  result_.pushes.resize(mark.pushes);
  result_.shapes.resize(mark.shapes);
  pushing_since_ = mark.pushing_since;
  best_distance_ = mark.best_distance;
  since_shape_ = mark.since_shape;
  furthest_ = mark.furthest;
  since_furthest_ = mark.since_furthest;
}

TrialResult run_trial(const Wire& wire, const Introducer& introducer, const Goal& goal,
                      const VesselModel& vessel, const InsertionOptions& options,
                      const std::vector<Move>& moves) {
  // The moves may bring in more wire than stays there.
  InsertionOptions with_moves = options;
  double depth = 0.0;
  for (const Move& move : moves) {
    depth += move.push;
    with_moves.length = std::max(with_moves.length, depth);
  }
  Trial trial(wire, introducer, goal, vessel, with_moves);
  for (const Move& move : moves) trial.make(move);
  trial.make({.push = options.length - trial.depth()});
  return trial.finish();
}

}  // namespace wireplan::simulate
