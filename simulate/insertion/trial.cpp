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
    case Outcome::kAnotherWay:
      return "another_way";
    case Outcome::kCrossesItself:
      return "crosses_itself";
    case Outcome::kLeftLumen:
      return "left_lumen";
    case Outcome::kNotConverged:
      return "not_converged";
    case Outcome::kFailed:
      return "failed";
  }
  return "failed";
}

Outcome outcome_of(const Astray& astray) {
  return astray.beyond_target ? Outcome::kMissed
         : astray.passed_by   ? Outcome::kPassedBy
                              : Outcome::kWrongBranch;
}

std::string describe(const Astray& astray) {
  return (astray.beyond_target ? "the tip went by the target: " : "the tip is not on the way: ") +
         astray.text;
}

std::string describe_balance(const std::vector<Push>& pushes) {
  if (pushes.empty()) return "";
  const Push& last = pushes.back();
  constexpr double kNoForce = 1e-5;   // a hand feels a thousand times as much, and residuals are
                                      // a tenth of it                                     [N]
  constexpr double kRounding = 1e-6;  // of what forces do on short pushes              [N mm]
  const double unbalanced =
      std::abs(last.unbalanced) - kNoForce * std::abs(last.insertion) - kRounding;
  const std::string text =
      describe_balance(std::max(0.0, unbalanced),
                       std::max(std::abs(last.push_work), last.stored_energy + last.friction_work));
  return text.empty() ? text : "; " + text;
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

Trial::Trial(const Wire& wire, const Introducer& introducer, const std::vector<Goal>& goals,
             const VesselModel& vessel, const InsertionOptions& options)
    : goals_(goals),
      vessel_(vessel),
      options_(options),
      insertion_(wire, introducer, vessel, options),
      pursuits_(goals.size()) {
  expects(!goals.empty());
  for (std::size_t k = 0; k < goals_.size(); ++k) {
    expects(!goals_[k].at_section || goals_[k].way);
    expects(goals_[k].at_section || goals_.size() == 1);
    pursuits_[k].best_distance = (insertion_.tip() - goals_[k].point).norm();
  }
  std::vector<std::string> own;
  if (!options.gravity.isZero(0.0)) own.push_back("gravity");
  record_.terms = name_terms(insertion_.rod(), own, &vessel, friction_of(wire, options));
}

bool Trial::ended() const {
  return std::all_of(pursuits_.begin(), pursuits_.end(),
                     [](const Pursuit& pursuit) { return pursuit.outcome.has_value(); });
}

bool Trial::start(const StartLine& line) {
  expects(record_.pushes.empty() && !ended());
  const std::optional<Push> push = insertion_.start(line);
  if (!push) {
    return end_all(Outcome::kNotConverged,
                   "no equilibrium near the line that the wire is to start from");
  }
  record(*push);
  record_.start = shape_here();
  record_.shapes.push_back(*record_.start);
  pushing_since_ = 1;
  for (std::size_t k = 0; k < goals_.size(); ++k) {
    pursuits_[k].best_distance = (tip_at_rest() - goals_[k].point).norm();
    check_place(k);
  }
  return !ended();
}

void Trial::make(const Move& move) {
  const double pushes = std::abs(move.push) / options_.step,
               turns = std::abs(move.turn) / kTurnStep;
  if (pushes > 0.0 && turns > 0.0) {  // one after the other, in steps as short as either asks for
    constexpr double kMostParts = 1e9;
    const double parts = std::ceil(std::max(pushes, turns) - 1e-9);
    const int count = static_cast<int>(std::clamp(parts, 1.0, kMostParts));
    for (int k = 0; k < count; ++k) {
      if (!step({.push = move.push / count}) || !step({.turn = move.turn / count})) return;
    }
    return;
  }
  const double whole = std::abs(move.push) + std::abs(move.turn);
  const double most = move.turn == 0.0 ? options_.step : kTurnStep;
  for (double done = 0.0; whole - done > 1e-9; done += most) {
    const double part = std::min(most, whole - done) / whole;
    if (!step({part * move.push, part * move.turn})) return;
  }
}

bool Trial::step(const Move& move) {
  expects(move.push == 0.0 || move.turn == 0.0);
  if (ended()) return false;
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
      return end_all(Outcome::kLeftImage, "the wire springs out of the vessel through the opening" +
                                              named_end(0, *opening) + " at " + place_of(*opening) +
                                              " after " + millimetres(depth) +
                                              " of insertion, from " +
                                              place_text(insertion_.tip()) + " mm");
    }
    return end_all(Outcome::kNotConverged, "no equilibrium after " + millimetres(depth) +
                                               " of insertion, tip at " +
                                               place_text(insertion_.tip()) + " mm");
  }
  if (end_in_sphere()) return false;
  record(*push);
  if (distance <= 0.0) pushing_since_ = record_.pushes.size();
  if (ends_by_crossing()) return false;
  since_shape_ += std::abs(distance) + std::abs(move.turn) / kTurnPerShape * options_.record_every;
  for (std::size_t k = 0; k < goals_.size(); ++k) {
    if (!pursuits_[k].outcome) check_place(k);
    if (!pursuits_[k].outcome) check_advance(k, distance);
    if (!pursuits_[k].outcome) check_motion(k);
  }
  if (ended()) return false;
  if (since_shape_ >= options_.record_every - 1e-9) {
    since_shape_ = 0.0;
    record_.shapes.push_back(shape_here());
  }
  return true;
}

void Trial::record(const Push& push) {
  record_.pushes.push_back(push);
  if (options_.record_terms) record_.push_terms.push_back(insertion_.terms());
  if (vessel_.sections) record_.tips_at_rest.push_back(tip_at_rest());
}

/// Whether the last step brought the wire through itself; notes it where it is pushed on.
bool Trial::ends_by_crossing() {
  if (record_.crossing) return false;
  record_.crossing = crossings_.find(insertion_.free_wire(), insertion_.rod().radius);
  if (!record_.crossing) return false;
  record_.crossing->insertion = insertion_.depth();
  if (options_.push_on) return false;
  end_all(Outcome::kCrossesItself, describe_crossing(*record_.crossing, insertion_.rod().radius));
  return true;
}

/// Measures the distances; inside a sphere the wire goes on until the tip is nearest to its centre.
bool Trial::end_in_sphere() {
  for (std::size_t k = 0; k < goals_.size(); ++k) {
    double& best = pursuits_[k].best_distance;
    const double to_goal = (tip_at_rest() - goals_[k].point).norm();
    if (!goals_[k].at_section && best <= goals_[k].radius && to_goal >= best) {
      insertion_.take_back();
      end(k, Outcome::kReached, reached_reason(k));
      return true;
    }
    best = to_goal;
  }
  return false;
}

std::string Trial::place_of(int opening) const {
  return place_text(vessel_.lumen.openings()[static_cast<std::size_t>(opening)].center) + " mm";
}

/// " in branch 3"; empty without a tree.
std::string Trial::named_end(std::size_t goal, int opening) const {
  const std::string name =
      goals_[goal].way ? goals_[goal].way->name_at(
                             vessel_.lumen.openings()[static_cast<std::size_t>(opening)].center)
                       : std::string();
  return name.empty() ? "" : " in " + name;
}

/// Ends the trial where the last step did not leave the tip in the vessel and before the goal.
void Trial::check_place(std::size_t goal) {
  const Push& push = record_.pushes.back();
  const Goal& own = goals_[goal];
  const std::string after = " after " + millimetres(push.insertion) + " of insertion";
  if (push.max_penetration > kOutside) {
    return end(goal, Outcome::kLeftLumen,
               millimetres(push.max_penetration) + " through the wall" + after + ", tip at " +
                   place_text(push.tip) + " mm");
  }
  if (own.at_section && own.way->may_have_arrived(tip_at_rest())) {
    const Eigen::Matrix3Xd wire = insertion_.free_nodes_at_rest();
    if (const auto before = own.way->find_arrival(wire, vessel_.lumen)) {
      const std::optional<std::string> detour = own.way->find_detour(wire.leftCols(*before + 1));
      if (!detour) return end(goal, Outcome::kReached, reached_reason(goal));
      return end(goal, Outcome::kAnotherWay,
                 "the tip passes the target" + after +
                     ", but the wire did not come along the way: " + *detour);
    }
  }
  if (const std::optional<int> opening = insertion_.left_through()) {
    return end_where_it_is(goal, Outcome::kLeftImage,
                           "the wire left the imaged vessel through its end" +
                               named_end(goal, *opening) + " at " + place_of(*opening) + after);
  }
  const std::optional<int> image_end =
      own.way ? own.way->find_image_end(tip_at_rest(), vessel_.lumen) : std::nullopt;
  if (image_end) {
    end_where_it_is(goal, Outcome::kLeftImage,
                    "the tip came to the end of the imaged vessel, " +
                        own.way->name_of_end(*image_end) + ", at " + place_text(push.tip) + " mm" +
                        after + "; the artery goes on there, the image does not");
  }
}

/// Ends the trial where the tip comes no further along the way.
void Trial::check_advance(std::size_t goal, double distance) {
  const Goal& own = goals_[goal];
  if (!own.way) return;
  Pursuit& pursuit = pursuits_[goal];
  const Push& push = record_.pushes.back();
  const Centerline& path = own.way->path();
  const double progress = own.way->find_progress(tip_at_rest());
  if (distance <= 0.0 || progress > pursuit.furthest) {
    pursuit.furthest = progress;
    pursuit.since_furthest = 0.0;
    return;
  }
  pursuit.since_furthest += distance;
  const double whole = path.arc_length(path.arc_length.size() - 1);
  const bool beside_goal = !own.at_section && pursuit.furthest >= whole - own.radius;
  if (pursuit.since_furthest <= (beside_goal ? kPatienceBeyond : kPatience)) return;
  if (beside_goal) {
    return end(goal, Outcome::kMissed,
               "the tip went by the target, " + millimetres(pursuit.best_distance) +
                   " from its point in the end, after " + millimetres(push.insertion) +
                   " of insertion");
  }
  end_where_it_is(goal, progress > 0.0 ? Outcome::kStuck : Outcome::kMissed,
                  "the tip came no further than " + millimetres(pursuit.furthest) +
                      " along the way while " + millimetres(pursuit.since_furthest) +
                      " of wire went in, and is at " + place_text(push.tip) + " mm");
}

/// Whether a wire that does not advance is pushed on all the same; notes where.
bool Trial::pushed_on(std::size_t goal, double from, double to) {
  if (!options_.push_on) return false;
  std::vector<std::pair<double, double>>& stuck = pursuits_[goal].stuck;
  if (!stuck.empty() && from <= stuck.back().second) {
    stuck.back().second = to;
  } else {
    stuck.emplace_back(from, to);
  }
  return true;
}

/// Ends the trial where the tip does not move on as it is pushed.
void Trial::check_motion(std::size_t goal) {
  const Push& push = record_.pushes.back();
  const std::size_t back = static_cast<std::size_t>(std::ceil(kStuckPush / options_.step));
  if (record_.pushes.size() - pushing_since_ <= back) return;
  const Push& then = record_.pushes[record_.pushes.size() - 1 - back];
  const double went = push.insertion - then.insertion;
  const double moved = (push.tip - then.tip).norm();
  const std::optional<Vec3> fold =
      moved < kProlapseMove * went ? insertion_.find_fold() : std::nullopt;
  const bool halts = fold || moved < kStuckMove;
  if (halts && pushed_on(goal, then.insertion, push.insertion)) return;
  if (fold) {
    const std::shared_ptr<const Way>& way = goals_[goal].way;
    const std::optional<std::string> detour =
        way ? way->find_detour(insertion_.free_nodes_at_rest()) : std::nullopt;
    return end_where_it_is(goal, Outcome::kProlapsed,
                           "the wire folds back at " + place_text(*fold) + " mm after " +
                               millimetres(push.insertion) +
                               " of insertion; its tip is behind at " + place_text(push.tip) +
                               " mm" + (detour ? "; " + *detour : ""));
  }
  if (moved < kStuckMove) {
    end_where_it_is(goal, Outcome::kStuck,
                    "the tip stays at " + place_text(push.tip) + " mm while " + millimetres(went) +
                        " of wire went in; the wire bends most at " +
                        place_text(insertion_.most_bent()) + " mm");
  }
}

Shape Trial::shape_here() const {
  const int first = insertion_.first_free();
  return {.insertion = insertion_.depth(),
          .hub_angle = insertion_.hub_angle(),
          .nodes = insertion_.free_nodes(),
          .sections = insertion_.sections(),
          .contact_force = insertion_.forces()
                               .rightCols(insertion_.rod().nodes() - first)
                               .colwise()
                               .norm()
                               .transpose()};
}

/// As `outcome`, unless the tip is not on the way: then that is the outcome.
void Trial::end_where_it_is(std::size_t goal, Outcome outcome, const std::string& reason) {
  const std::shared_ptr<const Way>& way = goals_[goal].way;
  const std::optional<Astray> astray = way ? way->find_astray(tip_at_rest()) : std::nullopt;
  if (!astray) return end(goal, outcome, reason);
  end(goal, outcome_of(*astray), describe(*astray) + "; " + reason);
}

/// For all goals for which it has not ended. Always false.
bool Trial::end_all(Outcome outcome, const std::string& reason) {
  for (std::size_t k = 0; k < goals_.size(); ++k) {
    if (pursuits_[k].outcome) continue;
    if (outcome == Outcome::kNotConverged || outcome == Outcome::kCrossesItself) {
      end(k, outcome, reason);
    } else {
      end_where_it_is(k, outcome, reason);
    }
  }
  return false;
}

/// Keeps the final shape.
void Trial::end(std::size_t goal, Outcome outcome, const std::string& reason) {
  Pursuit& pursuit = pursuits_[goal];
  pursuit.outcome = outcome;
  pursuit.pushes = record_.pushes.size();
  pursuit.shapes = record_.shapes.size();
  TrialResult& ended = pursuit.end;
  ended.outcome = outcome;
  ended.reason = reason + describe_balance(record_.pushes);
  ended.crossing = record_.crossing;
  ended.nodes = insertion_.free_nodes();
  ended.sections = insertion_.sections();
  if (vessel_.sections) ended.nodes_at_rest = insertion_.free_nodes_at_rest();
  ended.contacts = insertion_.contacts();
  ended.peak_forces = insertion_.peak_forces();
  const bool recorded = !record_.shapes.empty() &&
                        record_.shapes.back().insertion == insertion_.depth() &&
                        record_.shapes.back().hub_angle == insertion_.hub_angle();
  if (!recorded) ended.shapes.push_back(shape_here());
}

std::string Trial::reached_reason(std::size_t goal) const {
  if (goals_[goal].at_section) {
    const double from_axis =
        preprocess::find_place(tip_at_rest(), goals_[goal].way->path()).from_axis;
    return "tip past the target's cross-section, " + millimetres(from_axis) +
           " from the vessel's axis, after " + millimetres(insertion_.depth()) + " of insertion";
  }
  return "tip " + millimetres(pursuits_[goal].best_distance) + " from the target after " +
         millimetres(insertion_.depth()) + " of insertion";
}

std::vector<TrialResult> Trial::finish_all() {
  std::vector<TrialResult> results;
  for (std::size_t k = 0; k < goals_.size(); ++k) {
    Pursuit& pursuit = pursuits_[k];
    if (!pursuit.outcome && !goals_[k].at_section && pursuit.best_distance <= goals_[k].radius) {
      end(k, Outcome::kReached, reached_reason(k));
    } else if (!pursuit.outcome) {
      const bool all = insertion_.longest() - insertion_.depth() < 1e-9;
      end_where_it_is(k, Outcome::kMissed,
                      (all ? "all " : "") + millimetres(insertion_.depth()) +
                          " of wire went in, tip ended " + millimetres(pursuit.best_distance) +
                          " from the target at " + place_text(insertion_.tip()) + " mm");
    }
    TrialResult& result = results.emplace_back(std::move(pursuit.end));
    result.stuck = pursuit.stuck;
    result.terms = record_.terms;
    result.start = record_.start;
    result.roll = insertion_.roll();
    result.pushes.assign(record_.pushes.data(), record_.pushes.data() + pursuit.pushes);
    if (options_.record_terms) {
      result.push_terms.assign(record_.push_terms.data(),
                               record_.push_terms.data() + pursuit.pushes);
    }
    if (vessel_.sections) {
      result.tips_at_rest.assign(record_.tips_at_rest.data(),
                                 record_.tips_at_rest.data() + pursuit.pushes);
    }
    result.shapes.insert(result.shapes.begin(), record_.shapes.data(),
                         record_.shapes.data() + pursuit.shapes);
  }
  return results;
}

void Trial::save(Mark& mark) const {
  expects(!ended());
  insertion_.save(mark.insertion);
  mark.pushes = record_.pushes;
  mark.push_terms = record_.push_terms;
  mark.tips_at_rest = record_.tips_at_rest;
  mark.shapes = record_.shapes;
  mark.pushing_since = pushing_since_;
  mark.since_shape = since_shape_;
  mark.crossing = record_.crossing;
  mark.pursuits = pursuits_;
}

void Trial::restore(const Mark& mark) {
  insertion_.restore(mark.insertion);
  record_.pushes = mark.pushes;
  record_.push_terms = mark.push_terms;
  record_.tips_at_rest = mark.tips_at_rest;
  record_.shapes = mark.shapes;
  pushing_since_ = mark.pushing_since;
  since_shape_ = mark.since_shape;
  record_.crossing = mark.crossing;
  pursuits_ = mark.pursuits;
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

std::vector<TrialResult> run_trials(const Wire& wire, const Introducer& introducer,
                                    const std::vector<Goal>& goals, const VesselModel& vessel,
                                    const InsertionOptions& options) {
  Trial trial(wire, introducer, goals, vessel, options);
  trial.make({.push = options.length});
  return trial.finish_all();
}

}  // namespace wireplan::simulate
