#include "plan/manoeuvre.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

namespace wireplan::plan {
namespace {

using simulate::Move;
using simulate::Trial;

constexpr double kAstray = 15.0;     // pushed so far without coming further: elsewhere        [mm]
constexpr double kMarkEvery = 3.0;   // between two depths at which a turn is tried            [mm]
constexpr double kMarksBack = 24.0;  // such depths, from where the wire left the path ...     [mm]
constexpr double kMarksOn = 18.0;    // ... and so much deeper, to pull back from              [mm]
constexpr double kFurther = 2.0;     // along the path: worth going on from                    [mm]
constexpr int kDirections = 8;       // of the tip
constexpr double kPull = 6.0;        // pulled back between two tries to push on ...           [mm]
constexpr int kPulls = 3;            // ... so many times
constexpr int kBeam = 3;             // attempts that are gone on from
constexpr std::size_t kKept = 3;     // scripts per start

/// A script on its way, and what came of it.
struct Attempt {
  std::vector<Move> moves;  // before the last push
  double progress = 0.0;    // along the path                                              [mm]
  double depth = 0.0;       // at which it came so far                                     [mm]
  double peak_force = 0.0;  // of a single contact on the way                              [N]
  bool reached = false;
};

/// A state along a push, to go on from.
struct Stop {
  Trial::Mark mark;
  double depth;  //                                                                       [mm]
};

/// Moves one after the other, pushes and pulls in a row as one.
std::vector<Move> joined(std::vector<Move> moves, const Move& next) {
  const bool together = !moves.empty() && moves.back().turn == 0.0 && next.turn == 0.0 &&
                        moves.back().push * next.push > 0.0;
  if (together) {
    moves.back().push += next.push;
  } else {
    moves.push_back(next);
  }
  return moves;
}

bool feels_turns(const simulate::Wire& wire) { return !(wire.straight() && wire.round()); }

/// The search from one start. Serial.
class Search {
 public:
  Search(const Study& study, const Candidate& start, const Centerline& path,
         const simulate::VesselModel& vessel, const std::function<bool()>& cancelled)
      : study_(study),
        path_(path),
        step_(study.insertion.step),
        cancelled_(cancelled),
        trial_(study.wires[static_cast<std::size_t>(start.wire)], make_introducer(study, start),
               study.goal, vessel, study.insertion) {}

  std::vector<Attempt> run(int most_turns) {
    trial_.save(begin_);
    std::vector<Attempt> front(1), found;
    front[0] = push_on({}, nullptr);
    for (int turns = 0; turns < most_turns && found.empty(); ++turns) {
      std::vector<Attempt> next;
      for (const Attempt& attempt : front) expand(attempt, next);
      std::stable_sort(next.begin(), next.end(), [](const Attempt& a, const Attempt& b) {
        if (a.reached != b.reached) return a.reached;
        if (a.reached) return a.peak_force < b.peak_force;
        return a.progress > b.progress;
      });
      for (const Attempt& attempt : next) {
        if (attempt.reached && found.size() < kKept) found.push_back(attempt);
      }
      next.resize(std::min<std::size_t>(next.size(), kBeam));
      front = std::move(next);
    }
    return found;
  }
  long branches() const { return branches_; }

 private:
  /// Pushes from where the trial is until it ends or goes astray; what came of `moves` and this.
  /// Where `stops` is given, keeps states along the way.
  Attempt push_on(const std::vector<Move>& moves, std::vector<Stop>* stops) {
    ++branches_;
    Attempt attempt{.moves = moves, .progress = progress_here(), .depth = trial_.depth()};
    double last_stop = -kMarkEvery;
    while (trial_.depth() - attempt.depth < std::max(kAstray, stops != nullptr ? kMarksOn : 0.0)) {
      if (stops != nullptr && trial_.depth() > 0.0 && trial_.depth() - last_stop >= kMarkEvery) {
        last_stop = trial_.depth();
        stops->push_back({{}, last_stop});
        trial_.save(stops->back().mark);
      }
      if (!trial_.step({.push = step_})) break;
      const double here = progress_here();
      if (here > attempt.progress) {
        attempt.progress = here;
        attempt.depth = trial_.depth();
      }
    }
    attempt.reached = trial_.reached();
    for (const simulate::Push& push : trial_.pushes()) {
      attempt.peak_force = std::max(attempt.peak_force, push.peak_contact_force);
    }
    return attempt;
  }

  double progress_here() const {
    if (trial_.pushes().empty()) return 0.0;
    return find_progress(trial_.pushes().back().tip, study_, path_);
  }

  /// Tries turns, and pulls after them, round where the attempt left the path. Keeps what came
  /// further.
  void expand(const Attempt& attempt, std::vector<Attempt>& kept) {
    // The attempt again, with the states of its last push.
    trial_.restore(begin_);
    const std::vector<Move>& before = attempt.moves;
    for (const Move& move : before) trial_.make(move);
    if (trial_.ended()) return;
    std::vector<Stop> stops;
    const double from = trial_.depth();
    push_on(before, &stops);
    for (const Stop& stop : stops) {
      if (stop.depth < attempt.depth - kMarksBack || stop.depth > attempt.depth + kMarksOn)
        continue;
      std::vector<Move> moves = before;
      if (stop.depth > from) moves = joined(moves, {.push = stop.depth - from});
      for (int k = 1; k < kDirections; ++k) {
        if (cancelled_ && cancelled_()) return;
        const double angle = 2.0 * kPi * (k <= kDirections / 2 ? k : k - kDirections) / kDirections;
        trial_.restore(stop.mark);
        try_turn(joined(moves, {.turn = angle}), attempt, stop.depth > attempt.depth, kept);
      }
    }
  }

  /// From a state, the last of the moves, a turn; then pushes on, and where `pull`, pulls back and
  /// pushes on instead.
  void try_turn(std::vector<Move> moves, const Attempt& parent, bool pull,
                std::vector<Attempt>& kept) {
    trial_.make(moves.back());
    if (trial_.ended()) return;
    Trial::Mark turned;
    trial_.save(turned);
    for (int pulls = 0; pulls <= (pull ? kPulls : 0); ++pulls) {
      if (pulls > 0) {
        const Move back{.push = -std::min(kPull, std::max(0.0, trial_.depth() - 2.0 * step_))};
        if (back.push > -step_) return;
        trial_.make(back);
        if (trial_.ended()) return;
        moves = joined(moves, back);
        trial_.save(turned);
      }
      Attempt attempt = push_on(moves, nullptr);
      if (attempt.reached || attempt.progress > parent.progress + kFurther) kept.push_back(attempt);
      trial_.restore(turned);
    }
  }

  const Study& study_;
  const Centerline& path_;
  double step_;  //                                                                       [mm]
  const std::function<bool()>& cancelled_;
  Trial trial_;
  Trial::Mark begin_;
  long branches_ = 0;
};

}  // namespace

std::vector<int> choose_starts(const Study& study, const std::vector<Candidate>& candidates,
                               const std::vector<double>& progress,
                               const std::vector<simulate::Outcome>& outcomes, int per_wire) {
  expects(candidates.size() == progress.size() && candidates.size() == outcomes.size());
  std::vector<int> chosen;
  for (int wire = 0; wire < std::ssize(study.wires); ++wire) {
    std::vector<int> own;
    for (int k = 0; k < std::ssize(candidates); ++k) {
      const std::size_t slot = static_cast<std::size_t>(k);
      const bool fit = candidates[slot].wire == wire && candidates[slot].moves.empty() &&
                       feels_turns(study.wires[static_cast<std::size_t>(wire)]) &&
                       outcomes[slot] != simulate::Outcome::kReached &&
                       outcomes[slot] != simulate::Outcome::kFailed;
      if (fit) own.push_back(k);
    }
    std::stable_sort(own.begin(), own.end(), [&](int a, int b) {
      return progress[static_cast<std::size_t>(a)] > progress[static_cast<std::size_t>(b)];
    });
    own.resize(std::min<std::size_t>(own.size(), static_cast<std::size_t>(per_wire)));
    chosen.insert(chosen.end(), own.begin(), own.end());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

Manoeuvres find_manoeuvres(const Study& study, const std::vector<Candidate>& starts,
                           const Centerline& path, const simulate::VesselModel& vessel,
                           int most_turns, const BatchOptions& options) {
  std::vector<std::vector<Attempt>> found(starts.size());
  std::vector<long> branches(starts.size(), 0);
  for_each_slot(
      static_cast<int>(starts.size()),
      [&](int slot) {
        const std::size_t k = static_cast<std::size_t>(slot);
        Search search(study, starts[k], path, vessel, options.cancelled);
        found[k] = search.run(most_turns);
        branches[k] = search.branches();
      },
      options);
  Manoeuvres all;
  for (std::size_t k = 0; k < starts.size(); ++k) {
    all.branches += branches[k];
    for (const Attempt& attempt : found[k]) {
      Candidate candidate = starts[k];
      candidate.moves = attempt.moves;
      all.found.push_back(std::move(candidate));
      all.starts.push_back(static_cast<int>(k));
    }
  }
  return all;
}

std::vector<simulate::Move> as_written(std::vector<simulate::Move> moves) {
  for (Move& move : moves) {
    move.turn = clean(move.turn / kRadPerDeg) * kRadPerDeg;
    move.push = move.turn != 0.0 ? 0.0 : clean(move.push);
  }
  return moves;
}

std::vector<std::string> describe_each_move(const std::vector<simulate::Move>& moves,
                                            double insertion) {
  if (moves.empty()) return {};
  std::vector<std::string> told;
  char part[60];
  for (const Move& move : moves) {
    if (move.turn != 0.0) {
      std::snprintf(part, sizeof part, "turn %.0f deg %s", std::abs(move.turn) / kRadPerDeg,
                    move.turn > 0.0 ? "clockwise" : "counterclockwise");
    } else {
      std::snprintf(part, sizeof part, "%s %.1f mm", move.push > 0.0 ? "push" : "pull back",
                    std::abs(move.push));
    }
    told.emplace_back(part);
  }
  std::snprintf(part, sizeof part, "then push on to %.1f mm", insertion);
  told.emplace_back(part);
  return told;
}

std::string describe_moves(const std::vector<simulate::Move>& moves, double insertion) {
  std::string text;
  for (const std::string& part : describe_each_move(moves, insertion)) {
    text += (text.empty() ? "" : ", ") + part;
  }
  return text;
}

}  // namespace wireplan::plan
