#include "plan/catheters.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "plan/anatomy/passage.h"
#include "plan/tool_neighbours.h"

namespace wireplan::plan {
namespace {

using simulate::ToolStep;
using simulate::Until;

constexpr double kWireStart = 4.0;  // of a wire in the vessel before the first step          [mm]

std::string millimetres_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g mm", std::round(100.0 * value) / 100.0);
  return text;
}

/// Across the curve that is nearest to the tip, 0 where there is none [mm].
double width_of_curve(const simulate::Wire& tube) {
  for (const simulate::Section& section : tube.sections) {
    if (section.rest_curvature == 0.0) continue;
    const double radius = 1.0 / std::abs(section.rest_curvature);
    const double turn = section.length / radius;
    return turn >= kPi ? 2.0 * radius : radius * (1.0 - std::cos(turn));
  }
  return 0.0;
}

std::string why_unfit(const Catheter& catheter, const simulate::Wire& wire, const Ostium& ostium,
                      const ToolRules& rules) {
  const simulate::Wire& tube = catheter.tool.wire;
  const double inner = 2.0 * catheter.tool.inner_radius;
  if (2.0 * wire.radius >= inner) {
    return "wire too thick: " + millimetres_of(2.0 * wire.radius) + " in a lumen of " +
           millimetres_of(inner);
  }
  if (!wire.round() || !tube.round()) {
    return "a strip: tools that bend more easily to one side are not simulated in one another";
  }
  if (2.0 * tube.radius >= ostium.narrowest) {
    return "catheter too thick: " + millimetres_of(2.0 * tube.radius) +
           ", and the way to the ostium is " + millimetres_of(ostium.narrowest) +
           " wide at its narrowest";
  }
  if (tube.length() < ostium.arc + rules.outside) {
    return "catheter too short: " + millimetres_of(tube.length()) +
           ", and the way to the ostium takes " + millimetres_of(ostium.arc) + " with " +
           millimetres_of(rules.outside) + " to stay outside";
  }
  // With the catheter at the ostium and the wire at the target.
  const double needed = tube.length() - ostium.arc + ostium.end + rules.hold;
  if (wire.length() < needed) {
    return "wire too short: " + millimetres_of(wire.length()) + ", and " + millimetres_of(needed) +
           " are needed to hold it behind a catheter of " + millimetres_of(tube.length());
  }
  const double width = width_of_curve(tube);
  if (width > ostium.trunk_diameter) {
    return "curve wider than the vessel: " + millimetres_of(width) + " at the tip, in a lumen of " +
           millimetres_of(ostium.trunk_diameter) + " before the ostium";
  }
  return {};
}

/// Largest radius of the line within `length` mm before its point k: the spheres shrink toward an
/// ostium already [mm].
double widest_before(const Centerline& line, Eigen::Index k, double length) {
  double radius = line.radius[k];
  for (Eigen::Index i = k; i >= 0 && line.arc_length[k] - line.arc_length[i] < length; --i) {
    radius = std::max(radius, line.radius[i]);
  }
  return radius;
}

/// Mean radius of the line from an arc length on, over so many mm or to its end [mm].
double mean_radius(const Centerline& line, double from, double length) {
  double sum = 0.0, count = 0.0;
  for (Eigen::Index i = 0; i < line.arc_length.size(); ++i) {
    const double beyond = line.arc_length[i] - from;
    if (beyond < 0.0 || (beyond > length && count > 0.0)) continue;
    sum += line.radius[i];
    ++count;
  }
  return sum / std::max(1.0, count);
}

}  // namespace

std::optional<Ostium> find_ostium(const simulate::Goal& goal) {
  constexpr double kBefore = 15.0, kInto = 10.0;  // that diameters are taken over           [mm]
  constexpr double kWayIn = 6.0, kStub = 1.0;     // at least; shorter has no direction      [mm]
  if (!goal.way) return {};
  const Centerline& path = goal.way->path();
  std::optional<Ostium> last;
  for (const Junction& junction : find_junctions(*goal.way)) {
    const double end = path.arc_length[path.arc_length.size() - 1];
    if (!junction.taken || junction.entered || junction.arc >= end) continue;
    Ostium& here = last.emplace();
    here.arc = junction.arc;
    here.point = junction.point;
    here.trunk = junction.trunk_direction;
    // Where a wire is led to: from the ostium on, with what the line still sways there.
    const double into = std::min(junction.arc + std::max(kWayIn, 3.0 * junction.radius), end);
    here.branch = into - junction.arc < kStub
                      ? junction.branch_direction
                      : (point_at(path, into) - junction.point).normalized();
    const Eigen::Index before = find_part(path, junction.arc).before;
    here.trunk_diameter = 2.0 * widest_before(path, before, kBefore);
    here.narrowest = 2.0 * path.radius.head(before + 1).minCoeff();
    here.branch_diameter = 2.0 * mean_radius(path, junction.arc + 2.0, kInto);
    here.end = end;
    const auto& tree = goal.way->tree();
    if (junction.trunk >= 0) {
      const Eigen::Matrix3Xd& trunk = tree[static_cast<std::size_t>(junction.trunk)].line.points;
      here.trunk_beyond =
          std::max(0.0, (here.trunk.transpose() * (trunk.colwise() - here.point)).maxCoeff());
    }
  }
  return last;
}

std::vector<ToolPair> list_pairs(const std::vector<Catheter>& catheters,
                                 const std::vector<simulate::Wire>& wires, const Ostium& ostium,
                                 const ToolRules& rules) {
  std::vector<ToolPair> pairs;
  for (int w = 0; w < std::ssize(wires); ++w) {
    for (int c = 0; c < std::ssize(catheters); ++c) {
      pairs.push_back({c, w,
                       why_unfit(catheters[static_cast<std::size_t>(c)],
                                 wires[static_cast<std::size_t>(w)], ostium, rules)});
    }
  }
  return pairs;
}

namespace {

/// The wire that is brought in by a step has to fit as any other.
std::string find_broken_exchange(const ToolStep& step, const Catheter& catheter, double tube_in,
                                 const simulate::Wire* spare) {
  expects(spare != nullptr);
  const double inner = 2.0 * catheter.tool.inner_radius;
  if (2.0 * spare->radius >= inner) {
    return "wire too thick: " + millimetres_of(2.0 * spare->radius) + " in a lumen of " +
           millimetres_of(inner);
  }
  if (step.at < 0.0) return "the wire is brought in past the catheter's tip";
  if (tube_in - step.at < kWireStart) {
    return "the catheter is only " + millimetres_of(tube_in) + " in, too little to exchange the " +
           "wire through it";
  }
  return {};
}

/// Of steps that are all made whole.
std::string find_broken_when_whole(const std::vector<ToolStep>& steps, const Catheter& catheter,
                                   const simulate::Wire& wire, const ToolRules& rules,
                                   const simulate::Wire* spare) {
  const simulate::Wire &tube = catheter.tool.wire, *in_use = &wire;
  const bool soft =
      !tube.sections.empty() && tube.sections.front().bending_stiffness <= rules.soft_tip;
  double tube_in = 0.0, wire_in = kWireStart, turned = 0.0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const ToolStep& step = steps[k];
    const std::string where = "step " + std::to_string(k + 1) + ": ";
    if (step.spare >= 0) {
      const std::string broken = find_broken_exchange(step, catheter, tube_in, spare);
      if (!broken.empty()) return where + broken;
      in_use = spare;
      wire_in = tube_in - step.at;
    }
    const bool of_catheter = step.tool != 1, of_wire = step.tool != 0;
    const double length = std::abs(step.push);
    if (of_catheter && length > 0.0 && std::abs(turned) > rules.turn_per_length * length + 1e-9) {
      return where + "the catheter was turned by " +
             std::to_string(std::lround(std::abs(turned) / kRadPerDeg)) +
             " degrees, and is moved by " + millimetres_of(length) + " alone; " +
             std::to_string(std::lround(rules.turn_per_length / kRadPerDeg)) +
             " degrees per mm are the most";
    }
    if (of_catheter && (step.turn != 0.0 || length > 0.0)) {
      turned = step.turn == 0.0 ? 0.0 : turned + step.turn;
    }
    if (std::abs(turned) > rules.most_turn + 1e-9) {
      return where + "the catheter is turned by more than " +
             std::to_string(std::lround(rules.most_turn / kRadPerDeg)) + " degrees in one place";
    }
    if (of_catheter) tube_in += step.push;
    if (of_wire) wire_in += step.push;
    if (of_catheter && step.push > 0.0 && wire_in < tube_in - 1e-9 && !soft) {
      return where + "the catheter's tip is pushed ahead of the wire, and is no soft one";
    }
    if (tube_in > tube.length() - rules.outside + 1e-9) {
      return where + "less than " + millimetres_of(rules.outside) + " of catheter stay outside";
    }
    // The wire's hub end behind the catheter's.
    if (in_use->length() - wire_in < tube.length() - tube_in + rules.hold - 1e-9) {
      return where + "less than " + millimetres_of(rules.hold) +
             " of wire are left behind the catheter's hub";
    }
  }
  return {};
}

}  // namespace

std::string find_broken_rule(const std::vector<ToolStep>& steps, const Catheter& catheter,
                             const simulate::Wire& wire, const ToolRules& rules,
                             const simulate::Wire* spare) {
  std::string broken = find_broken_when_whole(steps, catheter, wire, rules, spare);
  if (!broken.empty()) return broken;
  std::vector<ToolStep> ended = steps;
  for (ToolStep& step : ended) {
    if (step.until != Until::kMade && step.push < 0.0) step.push = 0.0;
  }
  return find_broken_when_whole(ended, catheter, wire, rules, spare);
}

std::vector<ToolStep> with_seat(std::vector<ToolStep> steps, const Ostium& ostium,
                                const ToolRules& rules) {
  constexpr double kBehindTarget = 5.0;   // at least, so that the wire leads                 [mm]
  constexpr double kMostFollowed = 60.0;  // that hooks lie before the ostium, and curves take up
  const double at = std::min(rules.seat, ostium.end - ostium.arc - kBehindTarget);
  if (at <= 0.0) return steps;
  const double push = is_reshaped(steps) ? -kMostFollowed : kMostFollowed;
  steps.push_back({.tool = 0, .push = push, .until = Until::kInBranch, .at = at, .seats = true});
  return steps;
}

std::vector<ToolStep> as_written(std::vector<ToolStep> steps) {
  for (ToolStep& step : steps) {
    step.turn = clean(step.turn / kRadPerDeg) * kRadPerDeg;
    step.push = step.turn != 0.0 ? 0.0 : clean(step.push);
    step.at = simulate::ends_by_angle(step.until) ? clean(step.at / kRadPerDeg) * kRadPerDeg
                                                  : clean(step.at);
    step.try_turn = clean(step.try_turn / kRadPerDeg) * kRadPerDeg;
  }
  return steps;
}

namespace {

/// To the nearest whole number.
std::string whole_number(double value) { return std::to_string(std::lround(value)); }

std::string count_of_times(int count) {
  return std::to_string(count) + (count == 1 ? " time" : " times");
}

/// See below.
std::string tell_end_at_side(const ToolStep& step, const std::string& side) {
  const std::string at = whole_number(std::abs(step.at)) + " mm ";
  switch (step.until) {
    case Until::kInBranch:
      return " into " + side + " until its tip is " + at + "past the ostium there";
    case Until::kLevel:
      if (step.push > 0.0) {
        return " until its knee has opened in the trunk and its tip is " + at +
               "beyond the level of the ostium of " + side;
      }
      return " until the catheter's tip is " + at + (step.at < 0.0 ? "short of" : "beyond") +
             " the level of the ostium of " + side;
    case Until::kFacing:
    case Until::kBack:
    case Until::kMade:
      break;
  }
  expects(false);  // no step is watched so
  return {};
}

/// " until its tip is 20 mm past the ostium", of several tools "the catheter's tip"; empty of steps
/// that are made whole. Of one that is seen at a side vessel " into the left iliac artery until its
/// tip is 20 mm past the ostium there".
std::string tell_end(const ToolStep& step, const std::string& side) {
  if (step.until == Until::kMade) return {};
  if (!side.empty()) return tell_end_at_side(step, side);
  const std::string tip =
      step.tool == simulate::kBothTools ? " until the catheter's tip " : " until its tip ";
  switch (step.until) {
    case Until::kMade:
      break;
    case Until::kInBranch:
      return step.at < 0.5 ? tip + "falls into the ostium"
                           : tip + "is " + whole_number(step.at) + " mm past the ostium";
    case Until::kLevel:
      if (std::abs(step.at) < 0.5) return tip + "is level with the ostium";
      return tip + (step.at > 0.0
                        ? "is " + whole_number(step.at) + " mm beyond the level of the ostium"
                        : "is " + whole_number(-step.at) + " mm short of the level of the ostium");
    case Until::kFacing: {
      const double angle = step.at / kRadPerDeg;
      if (std::abs(angle) < 0.5) return tip + "looks toward the branch";
      return tip + "looks " + whole_number(std::abs(angle)) + " degrees " +
             (angle > 0.0 ? "clockwise" : "counterclockwise") + " of the branch";
    }
    case Until::kBack:
      return tip + "looks back, " + whole_number(step.at / kRadPerDeg) +
             " degrees from where the vessel goes on";
  }
  return {};
}

std::string turned_by(double angle) {
  return whole_number(std::abs(angle) / kRadPerDeg) + " degrees " +
         (angle > 0.0 ? "clockwise" : "counterclockwise");
}

/// Of the vessel that a step is seen at; empty of those that are at the target's ostium.
std::string name_of_side(const ToolStep& step, const StepNames& names) {
  if (step.side < 0) return {};
  const auto known = names.sides.find(step.side);
  return known != names.sides.end() ? known->second : "branch " + std::to_string(step.side + 1);
}

/// "If it passes by the branch ...": what a hand does then; empty of steps without tries.
std::string tell_tries(const ToolStep& step) {
  if (step.tries == 0) return {};
  const std::string length = whole_number(step.try_pull) + " mm ";
  const std::string more = whole_number(std::abs(step.try_turn) / kRadPerDeg) + " degrees";
  return "If it passes by the branch or comes no further, withdraw it and try again, " +
         count_of_times(step.tries) + " at most. First try with both tools " + length +
         "back from where they were, then " + length +
         "on. Then hook anew, as also where the catheter's tip has come out of the ostium: "
         "with the wire ahead, advance both until the catheter's tip is " +
         whole_number(simulate::kTryAbove) +
         " mm beyond the ostium, no further than it has been, turn it " + more +
         " toward the branch (" + (step.try_turn > 0.0 ? "clockwise" : "counterclockwise") +
         " where it looks along that) and pull both back to its level; then turned to the other "
         "side. Then do the same again, each time by twice the length and " +
         more + " more, but no further on than " + whole_number(simulate::kTryBeyond) +
         " mm beyond the ostium or where they were.";
}

/// "If it goes into another vessel ...": as above, of steps that are steered.
std::string tell_steers(const ToolStep& step) {
  if (step.steers == 0) return {};
  std::string text = "If it goes into another vessel or stops more than " +
                     whole_number(simulate::kSteerNear) + " mm before the ostium, withdraw it to " +
                     whole_number(simulate::kSteerBack) +
                     " mm before where that began. Bring the catheter up to " +
                     whole_number(simulate::kSteerBehind) +
                     " mm behind the wire's tip and advance the wire again. ";
  if (step.steers > 1) {
    text += "Do this " + count_of_times(step.steers) + " at most, each new time " +
            whole_number(simulate::kSteerFurther) +
            " mm further back and with the catheter turned on by " +
            turned_by(simulate::kSteerTurn) + ". ";
  }
  return text + "Then bring the catheter back to where it was. Stop the wire " +
         whole_number(simulate::kSteerBeforeEnd) + " mm before where the image ends.";
}

}  // namespace

std::vector<ToldStep> describe_steps(const std::vector<ToolStep>& steps, double insertion,
                                     const StepNames& names) {
  std::vector<ToldStep> told;
  double tube_in = 0.0, wire_in = kWireStart;
  bool tube_known = true, wire_known = true;
  const std::size_t count = steps.size() - (!steps.empty() && steps.back().seats ? 1 : 0);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const ToolStep& step = steps[k];
    const bool both = step.tool == simulate::kBothTools, of_wire = step.tool == 1;
    const std::string name = both      ? "catheter and wire together"
                             : of_wire ? "the wire"
                                       : "the catheter";
    const std::string vessel = name_of_side(step, names);
    const std::string end = tell_end(step, vessel);
    if (of_wire || both) wire_in += step.push;
    if (!of_wire) tube_in += step.push;
    if (!end.empty() && (of_wire || both)) wire_known = false;
    if (!end.empty() && !of_wire) tube_known = false;
    std::string text;
    if (step.spare >= 0) {
      wire_in = tube_in - step.at;
      wire_known = tube_known;
      text = "hold the catheter, withdraw the wire whole and bring in " + names.spare +
             " through it, to " +
             (wire_known ? whole_number(wire_in) + " mm"
                         : whole_number(step.at) + " mm behind the catheter's tip");
    } else if (step.turn != 0.0) {
      const std::string side = step.turn > 0.0 ? " clockwise" : " counterclockwise";
      const double angle = std::abs(step.turn) / kRadPerDeg;
      text = "turn " + name +
             (end.empty() ? " " + whole_number(angle) + " degrees" + side
                          : side + end + ", by " + whole_number(angle) + " degrees at most");
    } else if (k + 1 == count && step.push > 0.0 && end.empty()) {
      text = "advance " + name + " until its tip is at the target, " + whole_number(insertion) +
             " mm in";
    } else if (step.push > 0.0) {
      const bool opens = !vessel.empty() && step.until == Until::kLevel;
      const bool over = !of_wire && !both && !opens && (wire_in >= tube_in || !wire_known);
      const bool known = !both && (of_wire ? wire_known : tube_known);
      text = "advance " + name;
      text += over ? " over the wire" : "";
      text += end;
      text += !end.empty() ? ", by " + whole_number(step.push) + " mm at most"
              : known      ? " to " + whole_number(of_wire ? wire_in : tube_in) + " mm"
                           : " by " + whole_number(step.push) + " mm";
    } else {
      text = (of_wire ? "withdraw " : "pull back ") + name;
      text += end;
      text += end.empty() ? " by " + whole_number(-step.push) + " mm"
                          : ", by " + whole_number(-step.push) + " mm at most";
    }
    told.push_back({std::move(text), tell_tries(step) + tell_steers(step)});
  }
  return told;
}

std::string describe_script(const std::vector<ToolStep>& steps, double insertion,
                            const StepNames& names) {
  std::string text;
  for (const ToldStep& step : describe_steps(steps, insertion, names)) {
    text += (text.empty() ? "" : "; ") + step.text;
  }
  return text;
}

}  // namespace wireplan::plan
