#include "plan/tool_neighbours.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <tuple>
#include <utility>

namespace wireplan::plan {
namespace {

using simulate::ToolStep;
using simulate::ToolTrial;
using simulate::Until;

constexpr double kSamePart = 1e-9;  // of steps                                        [mm, rad]

/// A script that is under way, from its first step that is not yet made whole.
struct Rest {
  std::size_t script = 0;
  ToolScript steps;
};

double sign_of(double value) { return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0; }

/// Whether the first steps of two have a part in common, to be made for both at once.
bool begin_alike(const ToolScript& a, const ToolScript& b) {
  const ToolStep &one = a.front(), &other = b.front();
  if (one == other && (a.size() == 1) == (b.size() == 1)) return true;
  return a.size() > 1 && b.size() > 1 && std::max(one.spare, other.spare) < 0 &&
         one.tool == other.tool && one.side == other.side && one.until == other.until &&
         one.until != Until::kInBranch && sign_of(one.push) == sign_of(other.push) &&
         sign_of(one.turn) == sign_of(other.turn);
}

/// Whether what ends step `a` comes before what ends `b`.
bool ends_sooner(const ToolStep& a, const ToolStep& b) {
  if (a.until == Until::kMade) {
    return std::abs(a.push) + std::abs(a.turn) < std::abs(b.push) + std::abs(b.turn);
  }
  const double less =
      a.until == Until::kFacing ? std::remainder(a.at - b.at, 2.0 * kPi) : a.at - b.at;
  return sign_of(a.push + a.turn) * less < 0.0;
}

/// What is left of a step once `made` is; a step that ends by what is seen is left as it is, unless
/// it is that.
bool leave_rest(ToolStep& step, const ToolStep& made) {
  if (step.until != Until::kMade) return step.at != made.at;
  step.push -= made.push;
  step.turn -= made.turn;
  return std::abs(step.push) + std::abs(step.turn) > kSamePart;
}

class SharedTrials {
 public:
  SharedTrials(ToolTrial& trial, std::size_t count, const std::function<bool()>& cancelled)
      : trial_(trial), cancelled_(cancelled), reached_(count, false) {}

  void go_on(std::vector<Rest> rests) {
    while (!rests.empty() && !(cancelled_ && cancelled_())) {
      const auto alike_end = std::stable_partition(
          rests.begin() + 1, rests.end(),
          [&](const Rest& rest) { return begin_alike(rests.front().steps, rest.steps); });
      std::vector<Rest> alike(rests.begin(), alike_end);
      rests.erase(rests.begin(), alike_end);
      const ToolTrial::Mark before = trial_.save();
      make_common(std::move(alike));
      trial_.restore(before);
    }
  }

  const std::vector<bool>& reached() const { return reached_; }

 private:
  void make_common(std::vector<Rest> alike) {
    ToolStep common = alike.front().steps.front();
    for (const Rest& rest : alike) {
      if (ends_sooner(rest.steps.front(), common)) common = rest.steps.front();
    }
    const bool last = alike.front().steps.size() == 1;
    trial_.make(common, last);
    std::vector<Rest> left;
    for (Rest& rest : alike) {
      if (trial_.ended() || last) {
        reached_[rest.script] = trial_.reached();
        continue;
      }
      if (!leave_rest(rest.steps.front(), common)) rest.steps.erase(rest.steps.begin());
      left.push_back(std::move(rest));
    }
    if (!trial_.ended()) go_on(std::move(left));
  }

  ToolTrial& trial_;
  const std::function<bool()>& cancelled_;
  std::vector<bool> reached_;
};

/// The script with a step changed: by so many mm or rad, further in its own direction.
ToolScript with_change(ToolScript script, std::size_t step, double by) {
  ToolStep& own = script[step];
  if (own.until != Until::kMade) {
    own.at += sign_of(own.push + own.turn) * by;
  } else if (own.turn != 0.0) {
    own.turn += sign_of(own.turn) * by;
  } else {
    own.push += sign_of(own.push) * by;
  }
  return script;
}

bool alike(const FoundScript& a, const FoundScript& b, double turn, double depth) {
  return std::abs(a.turned - b.turned) < turn && std::abs(a.depth - b.depth) < depth;
}

}  // namespace

bool is_reshaped(const ToolScript& script) {
  return std::any_of(script.begin(), script.end(), [](const ToolStep& step) {
    return step.side >= 0 || step.until == Until::kBack;
  });
}

std::vector<ToolScript> list_neighbours(const ToolScript& script, std::size_t begun) {
  std::vector<ToolScript> all = {script};
  const std::size_t first = is_reshaped(script) ? begun : 0;
  const auto add = [&](ToolScript::const_iterator found, double by) {
    if (found == script.end() || found + 1 == script.end()) return;
    const auto step = static_cast<std::size_t>(found - script.begin());
    if (step < first) return;
    const double size = std::abs(found->push) + std::abs(found->turn);
    for (const double change : {-by, by}) {
      if (size + change > kSamePart) all.push_back(with_change(script, step, change));
    }
  };
  const auto last = [&](const auto& is_it) {
    const auto found = std::find_if(script.rbegin(), script.rend(), is_it);
    return found == script.rend() ? script.end() : found.base() - 1;
  };
  add(last([](const ToolStep& s) { return s.tool == simulate::kBothTools && s.push != 0.0; }),
      kNeighbourDepth);
  add(last([](const ToolStep& s) { return s.turn != 0.0; }), kNeighbourTurn);
  // The first advance of the catheter is over the wire, in the trunk.
  int advances = 0;
  add(std::find_if(
          script.begin(), script.end(),
          [&](const ToolStep& s) { return s.tool == 0 && s.push > 0.0 && ++advances == 2; }),
      kNeighbourDepth);
  return all;
}

std::vector<bool> try_scripts(ToolTrial& trial, const std::vector<ToolScript>& scripts,
                              const std::function<bool()>& cancelled) {
  std::vector<Rest> rests;
  for (std::size_t k = 0; k < scripts.size(); ++k) {
    if (!scripts[k].empty()) rests.push_back({k, scripts[k]});
  }
  SharedTrials shared(trial, scripts.size(), cancelled);
  shared.go_on(std::move(rests));
  return shared.reached();
}

long weigh_scripts(ToolTrial& trial, std::size_t begun,
                   const std::function<bool(const ToolScript&)>& allowed,
                   const std::function<bool()>& cancelled, std::vector<FoundScript>& scripts) {
  std::vector<ToolScript> all, rests;  // they begin alike, and are tried from there
  std::vector<std::size_t> owners;
  for (std::size_t k = 0; k < scripts.size(); ++k) {
    for (ToolScript& script : list_neighbours(scripts[k].steps, begun)) {
      rests.emplace_back(script.begin() + static_cast<std::ptrdiff_t>(begun), script.end());
      for (ToolStep& step : rests.back()) step.tries = 0;
      all.push_back(std::move(script));
      owners.push_back(k);
    }
  }
  const std::vector<bool> reached = try_scripts(trial, rests, cancelled);
  for (std::size_t k = 0; k < scripts.size(); ++k) {
    double tried = 0.0, held = 0.0;
    for (std::size_t n = 0; n < all.size(); ++n) {
      if (owners[n] != k) continue;
      const bool own = tried == 0.0;
      ++tried;
      if (own) scripts[k].holds = reached[n];
      if (!reached[n]) continue;
      ++held;
      if (!own && allowed(all[n])) scripts[k].spares.push_back(all[n]);
    }
    scripts[k].share = held / tried;
  }
  return std::ssize(all);
}

void take_for_held(FoundScript& script) {
  script.holds = true;
  script.share = 1.0;
  if (!script.by_length.empty()) script.spares = {script.by_length};
}

std::vector<FoundScript> choose_different(const std::vector<FoundScript>& from, std::size_t most) {
  constexpr double kNearTurn = 45.0 * kRadPerDeg, kNearDepth = 9.0;    // [rad], [mm]
  constexpr double kOtherTurn = 20.0 * kRadPerDeg, kOtherDepth = 3.0;  // [rad], [mm]
  std::vector<int> neighbours;
  for (const FoundScript& script : from) {
    neighbours.push_back(
        static_cast<int>(std::count_if(from.begin(), from.end(), [&](const FoundScript& other) {
          return alike(script, other, kNearTurn, kNearDepth);
        })));
  }
  std::vector<std::size_t> order(from.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(-from[a].share, -neighbours[a], from[a].steps.size(), from[a].peak_force) <
           std::tuple(-from[b].share, -neighbours[b], from[b].steps.size(), from[b].peak_force);
  });
  std::vector<FoundScript> kept;
  for (const std::size_t k : order) {
    const bool same = std::any_of(kept.begin(), kept.end(), [&](const FoundScript& other) {
      return alike(from[k], other, kOtherTurn, kOtherDepth);
    });
    if (!same && kept.size() < most) kept.push_back(from[k]);
  }
  return kept;
}

}  // namespace wireplan::plan
