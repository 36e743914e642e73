#include "plan/wire_exchange.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plan/number_text.h"
#include "plan/tool_starts.h"

namespace wireplan::plan {
namespace {

using simulate::Until;

constexpr int kSeated = 0, kBroughtIn = 1;  // tools: the catheter, the wire in it

/// All chosen.
struct ExchangeTemplate {
  double short_of = 2.0;  // of the target, what the first wire is seen to lead out to    [mm]
  double further = 10.0;  // of a push beyond that, where the vessel goes on              [mm]
  int pushes = 4;         // of these, ...
  double moves = 0.5;     // ... as long as the tip comes on by this part of one
  double depths[5] = {5.0, 10.0, 16.0, 24.0, 34.0};  // of the catheter past the ostium    [mm]
  double ahead = 2.0;       // of the catheter's tip, the target, at least                  [mm]
  double off = 1.0;         // of a depth, that the catheter has come to                    [mm]
  double behind = 10.0;     // the catheter's tip, of the wire that is brought in           [mm]
  double slack = 12.0;      // of pushes that end by what is seen                           [mm]
  double spare = 40.0;      // of the last push, for patients who differ                    [mm]
  std::size_t scripts = 3;  // of another wire, that are gone on from, ...
  std::size_t most = 4;     // ... and of all other wires
  std::size_t weighed = 1;  // of what is found after one of these
  std::size_t kept = 3;     // scripts of a pair
};
constexpr ExchangeTemplate kExchange;

/// Goes on from a script of another wire through the same catheter. Serial.
class SeatedSearch {
 public:
  /// The candidate has the other wire's steps.
  SeatedSearch(const Study& study, const Candidate& candidate, const Ostium& ostium,
               const simulate::VesselModel& vessel, const std::function<bool()>& cancelled)
      : study_(study),
        ostium_(ostium),
        cancelled_(cancelled),
        catheter_(study.catheters.at(static_cast<std::size_t>(candidate.catheter))),
        first_(study.wires.at(static_cast<std::size_t>(candidate.first_wire))),
        wire_(study.wires.at(static_cast<std::size_t>(candidate.wire))),
        steps_(candidate.steps),
        trial_(tools_of(study, candidate), make_introducer(study, candidate), study.goal, vessel,
               tool_options(study, candidate)) {}

  StartFindings search() {
    if (trial_.ended()) {
      findings_.stopped = trial_.reason();
      return std::move(findings_);
    }
    const simulate::ToolTrial::Mark begin = trial_.save();
    if (make_as_before()) {
      const simulate::ToolTrial::Mark hooked = trial_.save();
      const ToolScript script = steps_;
      exchange_here();
      trial_.restore(hooked);
      steps_ = script;
      if (!stop() && lead_out()) try_depths();
    }
    trial_.restore(begin);
    findings_.count = static_cast<int>(findings_.found.size());
    findings_.found = choose_different(findings_.found, kExchange.weighed);
    findings_.branches += weigh_scripts(
        trial_, 0, [&](const ToolScript& script) { return find_broken(script).empty(); },
        cancelled_, findings_.found);
    return std::move(findings_);
  }

 private:
  bool stop() const { return cancelled_ && cancelled_(); }
  double depth_of(int tool) const { return trial_.measure(Until::kInBranch, tool); }
  std::string find_broken(const ToolScript& script) const {
    return find_broken_rule(script, catheter_, first_, study_.tool_rules, &wire_);
  }

  /// Makes a step and adds it to the script. False where that ends the trial.
  bool go(const simulate::ToolStep& step, bool last = false) {
    ++findings_.branches;
    steps_.push_back(step);
    trial_.make(step, last);
    return !trial_.ended();
  }

  /// What stopped a script that came so far along the way. Of all the furthest is told, of several
  /// the last: the catheter is deepest in the branch then.
  void tell_stop(const std::string& reason, double progress = 0.0) {
    if (progress < findings_.furthest) return;
    findings_.stopped = reason;
    findings_.furthest = progress;
  }

  /// The other wire's script but for its last step, which leads that wire out to the target.
  bool make_as_before() {
    const ToolScript script = std::exchange(steps_, {});
    if (script.empty() || script.back().tool != kBroughtIn) {
      tell_stop("the last step of " + first_.name + " is no push of that wire");
      return false;
    }
    last_ = script.back();
    for (std::size_t k = 0; k + 1 < script.size() && !stop(); ++k) {
      if (go(script[k])) continue;
      tell_stop(trial_.reason());
      return false;
    }
    return !stop();
  }

  /// The last step, seen to the target, and beyond it as far as the vessel lets the wire go: the
  /// stiffer the part of it in the ostium, the better it leads.
  bool lead_out() {
    simulate::ToolStep out = last_;
    out.until = Until::kInBranch;
    out.at = std::floor(ostium_.end - ostium_.arc - kExchange.short_of);
    if (!go(out) || depth_of(kBroughtIn) < out.at - kExchange.off) {
      tell_stop(first_.name + " does not lead out into the branch again");
      return false;
    }
    double further = 0.0;
    for (int push = 0; push < kExchange.pushes && !stop(); ++push) {
      const simulate::ToolTrial::Mark before = trial_.save();
      const Vec3 tip = trial_.tip(kBroughtIn);
      trial_.make({.tool = kBroughtIn, .push = kExchange.further});
      const bool moved = !trial_.ended() && (trial_.tip(kBroughtIn) - tip).norm() >
                                                kExchange.moves * kExchange.further;
      if (!moved) {
        trial_.restore(before);
        break;
      }
      further += kExchange.further;
    }
    if (further > 0.0) steps_.push_back({.tool = kBroughtIn, .push = further});
    return !stop();
  }

  void try_depths() {
    const simulate::ToolTrial::Mark led = trial_.save();
    const ToolScript script = steps_;
    const double own = depth_of(kSeated);
    for (const double depth : kExchange.depths) {
      const double most = ostium_.end - ostium_.arc - kExchange.ahead;
      if (depth < own + kExchange.ahead || depth > most || stop()) continue;
      trial_.restore(led);
      steps_ = script;
      const double most_moved = std::ceil(depth - own + kExchange.slack);
      const double moved = is_reshaped(steps_) ? -most_moved : most_moved;
      if (!go({.tool = kSeated, .push = moved, .until = Until::kInBranch, .at = depth})) {
        return tell_stop(trial_.reason());
      }
      if (depth_of(kSeated) < depth - kExchange.off) {
        const std::string tried = findings_.stopped;
        return tell_stop("the catheter follows " + first_.name + " no further than " +
                         whole_millimetres(std::max(0.0, depth_of(kSeated))) + " into the branch" +
                         (tried.empty() ? "" : "; before that " + tried));
      }
      exchange_here();
    }
  }

  /// From where the trial is, which is left where that ends.
  void exchange_here() {
    const double before = depth_of(kSeated);
    if (!go({.tool = kBroughtIn, .at = kExchange.behind, .spare = 0})) {
      return tell_stop(trial_.reason());
    }
    const double depth = depth_of(kSeated);
    if (depth <= 0.0) {
      return tell_stop("the catheter's tip, " + whole_millimetres(std::max(0.0, before)) +
                       " into the branch, comes out of it as " + wire_.name + " is brought in");
    }
    const std::size_t pushes = trial_.pushes().size();
    const double left = ostium_.end - ostium_.arc - depth;
    const double push = std::ceil(kExchange.behind + left + kExchange.spare);
    const bool goes_on = go({.tool = kBroughtIn, .push = push}, /*last=*/true);
    const double progress = furthest_since(pushes, trial_, *study_.goal.way);
    if (trial_.reached()) return keep(depth, progress);
    tell_stop(goes_on ? "its last push ends before the target" : trial_.reason(), progress);
  }

  void keep(double depth, double progress) {
    const std::string broken = find_broken(steps_);
    if (!broken.empty()) {
      return tell_stop("its scripts break a rule of the case: " + broken, progress);
    }
    FoundScript& found = findings_.found.emplace_back(FoundScript{.steps = steps_});
    found.depth = depth;
    for (const simulate::ToolStep& step : steps_) {
      if (step.turn != 0.0) found.turned += step.until == Until::kFacing ? step.at : step.turn;
    }
    for (const simulate::Push& push : trial_.pushes()) {
      found.peak_force = std::max(found.peak_force, push.peak_contact_force);
    }
  }

  const Study& study_;
  const Ostium& ostium_;
  const std::function<bool()>& cancelled_;
  const Catheter& catheter_;
  const simulate::Wire &first_, &wire_;
  ToolScript steps_;
  simulate::ToolTrial trial_;
  simulate::ToolStep last_;  // of the other wire's script
  StartFindings findings_;
};

struct ExchangeJob {
  std::size_t pair = 0;
  Candidate candidate;  // with the other wire's steps
  StartFindings findings = {};
};

/// What a pair may go on from: scripts of other wires through its catheter that reached, those that
/// hold best first.
std::vector<Candidate> list_seating(const ToolScripts& all, const ToolPair& pair) {
  std::vector<const PairFindings*> others;
  for (const PairFindings& other : all.pairs) {
    const bool same = other.pair.catheter == pair.catheter && other.pair.wire != pair.wire;
    if (same && other.found > 0) others.push_back(&other);
  }
  std::stable_sort(others.begin(), others.end(),
                   [](const auto* a, const auto* b) { return a->held > b->held; });
  std::vector<Candidate> seating;
  for (const PairFindings* other : others) {
    std::size_t own = 0;
    for (const Candidate& found : all.found) {
      if (found.catheter != pair.catheter || found.wire != other->pair.wire) continue;
      if (found.first_wire >= 0 || own == kExchange.scripts) continue;
      if (seating.size() == kExchange.most) return seating;
      seating.push_back(found);
      seating.back().first_wire = found.wire;
      seating.back().wire = pair.wire;
      ++own;
    }
  }
  return seating;
}

double best_share(const ExchangeJob& job) {
  double share = 0.0;
  for (const FoundScript& script : job.findings.found) share = std::max(share, script.share);
  return share;
}

/// Of a pair's jobs what is kept, after the wire whose scripts hold best, and how they ended.
void gather_exchanges(const std::vector<ExchangeJob>& jobs, std::size_t slot, ToolScripts& all) {
  ExchangeFindings& own = all.pairs[slot].exchange;
  const ExchangeJob *furthest = nullptr, *best = nullptr;
  for (const ExchangeJob& job : jobs) {
    if (job.pair != slot) continue;
    all.branches += job.findings.branches;
    own.found += job.findings.count;
    if (furthest == nullptr || job.findings.furthest > furthest->findings.furthest) furthest = &job;
    if (job.findings.count == 0) continue;
    if (best == nullptr || best_share(job) > best_share(*best)) best = &job;
  }
  if (furthest == nullptr) return;
  own.first_wire = (best == nullptr ? furthest : best)->candidate.first_wire;
  if (best == nullptr) {
    own.stopped = furthest->findings.stopped;
    return;
  }
  own.held = best_share(*best);
  std::vector<FoundScript> found;
  for (const ExchangeJob& job : jobs) {
    if (job.pair != slot || job.candidate.first_wire != own.first_wire) continue;
    found.insert(found.end(), job.findings.found.begin(), job.findings.found.end());
  }
  add_scripts(best->candidate, choose_different(found, kExchange.kept), all);
}

}  // namespace

void find_exchanges(const Study& study, const simulate::VesselModel& vessel,
                    const BatchOptions& options, ToolScripts& all) {
  const std::optional<Ostium> ostium = find_ostium(study.goal);
  if (!ostium || !study.tool_rules.exchange) return;
  const Study scout = tool_scout_study(study);
  std::vector<ExchangeJob> jobs;
  for (std::size_t slot = 0; slot < all.pairs.size(); ++slot) {
    PairFindings& pair = all.pairs[slot];
    if (!pair.pair.unfit.empty() || !pair.tried() || pair.held >= kSteadyShare) continue;
    const std::vector<Candidate> seating = list_seating(all, pair.pair);
    for (const Candidate& candidate : seating) jobs.push_back({slot, candidate});
    if (seating.empty()) pair.exchange.stopped = "no other wire comes through this catheter";
  }
  for_each_slot(
      static_cast<int>(jobs.size()),
      [&](int slot) {
        ExchangeJob& job = jobs[static_cast<std::size_t>(slot)];
        job.findings =
            SeatedSearch(scout, job.candidate, *ostium, vessel, options.cancelled).search();
      },
      options);
  for (std::size_t slot = 0; slot < all.pairs.size(); ++slot) gather_exchanges(jobs, slot, all);
}

}  // namespace wireplan::plan
