// A catheter that follows into the branch, and what it bears there: of ToolTrial.
#include <algorithm>
#include <cmath>
#include <string>

#include "preprocess/centerline/path_place.h"
#include "simulate/insertion/tool_trial.h"

namespace wireplan::simulate {
namespace {

/// All chosen.
constexpr double kMostDrawn = 3.0;    // that a hand lets the wire's tip come back           [mm]
constexpr double kNearSeat = 0.5;     // so near, a catheter is seated                       [mm]
constexpr double kFirstPress = 0.02;  //                                                     [N]
constexpr double kPressMore = 1.25;   // each press of the one before, until it backs out
constexpr double kPressPart = 0.02;   // of a press: so near, it is known ...
constexpr double kPressNear = 5e-4;   // ... or so near                                      [N]
constexpr double kBitByBit = 2.0;     // that a tip comes back from one press to the next; more
                                      // may be a jump                                       [mm]

}  // namespace

void ToolTrial::seat(const ToolStep& step) {
  expects(step.seats && step.tool == 0 && step.push != 0.0);
  const bool there = reached();
  if (ended() && !there) return;
  outcome_.reset();
  const Mark arrived = save();
  const double wire = measure(Until::kInBranch, 1);
  ++step_;
  seating_ = true;
  advance(step, false, false);
  seating_ = false;
  std::string why;
  if (ended()) {
    why = reason();
  } else if (measure(Until::kInBranch, 1) < wire - kMostDrawn) {
    why = "it draws the wire's tip back";
  } else if (measure(Until::kInBranch, 0) < step.at - kNearSeat) {
    why = "it comes no deeper";
  }
  if (!why.empty()) restore(arrived);
  keep_end_of_step();
  if (there) {
    end(Outcome::kReached,
        arrived_ + (why.empty() ? "" : "; the catheter does not follow: " + why));
  }
}

/// Presses that grow on a copy of the tools. Between the last that it bears and the first that it
/// does not, the depth of the tip says where it passes the ostium; a catheter that jumps out, or
/// has no equilibrium, is found by halving.
std::optional<CatheterSupport> ToolTrial::find_support() const {
  const bool whole =
      outcome_ == Outcome::kReached || outcome_ == Outcome::kMissed || outcome_ == Outcome::kStuck;
  if (!whole || bench_.tools().size() != 2) return {};
  ToolBench bench(bench_);
  const auto depth = [&] {
    const Vec3 tip = bench.at_rest(bench.nodes_of(0).rightCols<1>());
    return goal_.way->find_progress(tip) - options_.take_off->arc;
  };
  const double seated = measure(Until::kInBranch, 0);
  if (!(seated > 0.0)) return {};
  const Eigen::Matrix3Xd mouth = bench.nodes_of(0);
  const Vec3 back = (mouth.col(mouth.cols() - 2) - mouth.rightCols<1>()).normalized();

  double held = 0.0, held_depth = seated, press = kFirstPress;
  std::optional<double> out;  // the least press that backs it out
  while (true) {
    if (out) {
      if (*out - held <= std::max(kPressNear, kPressPart * *out)) break;
      press = 0.5 * (held + *out);
    } else if (press > kMostSupport) {
      return CatheterSupport{.push = kMostSupport, .more = true};
    }
    const ToolBench::Mark mark = bench.save();
    const bool bears = bench.press(0, press * back);
    const double now = bears ? depth() : -1.0;
    if (now > 0.0) {
      held = press;
      held_depth = now;
      press *= kPressMore;
      continue;
    }
    bench.restore(mark);
    out = press;
    // Where it comes back bit by bit, the line between the two depths tells more than their middle.
    if (bears && held > 0.0 && held_depth - now < kBitByBit) {
      return CatheterSupport{.push = held + (press - held) * held_depth / (held_depth - now)};
    }
  }
  return CatheterSupport{.push = held};
}

}  // namespace wireplan::simulate
