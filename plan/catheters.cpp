#include "plan/catheters.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wireplan::plan {
namespace {

using simulate::ToolStep;

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
  if (tube.length() < ostium.arc + rules.outside) {
    return "catheter too short: " + millimetres_of(tube.length()) + ", and the ostium is " +
           millimetres_of(ostium.arc) + " from the access with " + millimetres_of(rules.outside) +
           " to stay outside";
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

}  // namespace

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

std::string find_broken_rule(const std::vector<ToolStep>& steps, const Catheter& catheter,
                             const simulate::Wire& wire, const ToolRules& rules) {
  const simulate::Wire& tube = catheter.tool.wire;
  const bool soft =
      !tube.sections.empty() && tube.sections.front().bending_stiffness <= rules.soft_tip;
  double tube_in = 0.0, wire_in = kWireStart, turned = 0.0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const ToolStep& step = steps[k];
    const std::string where = "step " + std::to_string(k + 1) + ": ";
    const bool of_catheter = step.tool != 1, of_wire = step.tool != 0;
    if (of_catheter) turned = step.turn == 0.0 ? 0.0 : turned + step.turn;
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
    if (wire.length() - wire_in < tube.length() - tube_in + rules.hold - 1e-9) {
      return where + "less than " + millimetres_of(rules.hold) +
             " of wire are left behind the catheter's hub";
    }
  }
  return {};
}

std::vector<ToolStep> as_written(std::vector<ToolStep> steps) {
  for (ToolStep& step : steps) {
    step.turn = clean(step.turn / kRadPerDeg) * kRadPerDeg;
    step.push = step.turn != 0.0 ? 0.0 : clean(step.push);
  }
  return steps;
}

std::vector<std::string> describe_steps(const std::vector<ToolStep>& steps, double insertion) {
  std::vector<std::string> told;
  double tube_in = 0.0, wire_in = kWireStart;
  char text[200];
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const ToolStep& step = steps[k];
    const bool both = step.tool == simulate::kBothTools, of_wire = step.tool == 1;
    const bool last = k + 1 == steps.size();
    const char* name = both ? "catheter and wire together" : of_wire ? "the wire" : "the catheter";
    if (of_wire || both) wire_in += step.push;
    if (!of_wire) tube_in += step.push;
    if (step.turn != 0.0) {
      std::snprintf(text, sizeof text, "turn %s %.0f degrees %s", name,
                    std::abs(step.turn) / kRadPerDeg,
                    step.turn > 0.0 ? "clockwise" : "counterclockwise");
    } else if (last && step.push > 0.0) {
      std::snprintf(text, sizeof text, "advance %s until its tip is at the target, %.0f mm in",
                    name, insertion);
    } else if (step.push > 0.0 && both) {
      std::snprintf(text, sizeof text, "advance %s by %.0f mm", name, step.push);
    } else if (step.push > 0.0) {
      const bool over = !of_wire && wire_in >= tube_in;
      std::snprintf(text, sizeof text, "advance %s%s to %.0f mm", name,
                    over ? " over the wire" : "", of_wire ? wire_in : tube_in);
    } else {
      std::snprintf(text, sizeof text, "%s %s by %.0f mm", of_wire ? "withdraw" : "pull back", name,
                    -step.push);
    }
    told.emplace_back(text);
  }
  return told;
}

}  // namespace wireplan::plan
