// What the hand does where a tool that is led out passes the branch by, of ToolTrial.
#include <algorithm>
#include <cmath>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::simulate {
namespace {

// ToolStep; the last from where the image ends; chosen                                       [mm]
constexpr double kTryOut = 20.0, kTryIn = 5.0, kTryBeforeEnd = 2.0;
constexpr double kTryPart = 2.0;      // of a push that is looked at, of the options' steps
constexpr double kEndReach = 1.5;     // of such an end, in its radii
constexpr double kTryFallen = 8.0;    // below where it was: the outer one's tip has come out   [mm]
constexpr double kTryLeads = 12.0;    // of the tool that leads, ahead of the other            [mm]
constexpr double kTryFurther = 12.0;  // than where it was, of a pull back to its level         [mm]

}  // namespace

/// Whether the tool has come out of the one outside it, and not into the branch.
bool ToolTrial::passes_by(const ToolStep& step) const {
  const double out = insertion(step.tool) - insertion(step.tool - 1);
  const bool comes_out = out >= kTryOut || (out > 0.0 && is_near_end(step.tool, kTryBeforeEnd));
  return comes_out && measure(Until::kInBranch, step.tool) < kTryIn;
}

/// Whether the tool's tip is so near to where the image ends: a hand that leads it on does so
/// unseen.
bool ToolTrial::is_near_end(int tool, double within) const {
  const Vec3 here = tip(tool);
  const auto ends = [&](const preprocess::Opening& opening) {
    const Vec3 off = here - opening.center;
    const double height = opening.normal.dot(off);
    return std::abs(height) < within &&
           (off - height * opening.normal).norm() < kEndReach * opening.radius;
  };
  const auto& openings = vessel_.lumen.openings();
  return std::any_of(openings.begin(), openings.end(), ends);
}

ToolTrial::TryPlace ToolTrial::place_of_try(int tool) const {
  return {insertion(tool - 1), insertion(tool) - insertion(tool - 1),
          measure(Until::kLevel, tool - 1)};
}

/// Takes the tool of a push back to where the push began, and brings all to where the next try
/// begins. The outer one's tip is not pushed on past the ostium, where it only gets further off.
void ToolTrial::try_again(const ToolStep& step, const TryPlace& from, int tried) {
  const int outer = step.tool - 1;
  struct Place {
    double push = 0.0, turn = 0.0;
  };
  const auto place = [&](int k) -> Place {
    if (k == 0) return {};
    const int round = (k - 1) / kTriesOfRound;
    const double side = k % 2 == 1 ? 1.0 : -1.0;
    return (k - 1) % kTriesOfRound < 2 ? Place{.push = -side * std::ldexp(step.try_pull, round)}
                                       : Place{.turn = side * (1 + round) * step.try_turn};
  };
  ++tries_;
  const Place before = place(tried - 1), next = place(tried);
  const double turn = next.turn - before.turn;
  const bool fell = measure(Until::kLevel, outer) < from.level - kTryFallen;
  const bool anew = next.turn != 0.0 || fell;
  if (anew) {
    hook_anew(step, turn, from);
  } else {
    move_by({.tool = step.tool, .push = insertion(outer) + from.ahead - insertion(step.tool)});
    move_by({.tool = outer, .turn = turn});
  }
  const double push = anew ? next.push : from.outer + next.push - insertion(outer);
  move_by({.tool = kBothTools,
           .push = push,
           .until = push > 0.0 ? Until::kLevel : Until::kMade,
           .at = std::max(from.level, 0.0) + kTryBeyond});
}

/// Brings both tools up past the ostium, turns the outer one there, and pulls both back to where
/// its tip was.
void ToolTrial::hook_anew(const ToolStep& step, double turn, const TryPlace& from) {
  const int outer = step.tool - 1;
  const auto withdraw = [&](double ahead) {
    const double back = insertion(step.tool) - insertion(outer) - ahead;
    if (back > 0.0) move_by({.tool = step.tool, .push = -back});
  };
  const bool on_way = !goal_.way->find_astray(tip(step.tool));
  withdraw(on_way ? kTryLeads : from.ahead);
  const std::vector<double>& been = record_.tools[static_cast<std::size_t>(outer)].insertion;
  move_by({.tool = kBothTools,
           .push = *std::max_element(been.begin(), been.end()) - insertion(outer),
           .until = Until::kLevel,
           .at = std::max(from.level, 0.0) + kTryAbove});
  withdraw(from.ahead);
  move_by({.tool = outer, .turn = turn});
  move_by({.tool = kBothTools,
           .push = std::min(0.0, from.outer - kTryFurther - insertion(outer)),
           .until = Until::kLevel,
           .at = from.level});
}

/// Of a step that is under way. Both tools are pushed no nearer to where the image ends than a tool
/// that is led up, so that no try leaves the image.
void ToolTrial::move_by(const ToolStep& step) {
  if (ended() || (step.push == 0.0 && step.turn == 0.0)) return;
  if (step.tool != kBothTools || step.push < 0.0) {
    advance(step, false, false);
    return;
  }
  const auto near_end = [&] {
    for (int tool = 0; tool < std::ssize(record_.tools); ++tool) {
      if (is_near_end(tool, kSteerBeforeEnd)) return true;
    }
    return false;
  };
  ToolStep part = step;
  for (double left = step.push; left > 1e-9 && !ended() && !near_end(); left -= part.push) {
    part.push = std::min(left, kTryPart * options_.insertion.step);
    const double before = foremost();
    advance(part, false, false);
    if (foremost() - before < 1e-9) return;  // it is where the step ends
  }
}

}  // namespace wireplan::simulate
