#include "plan/manoeuvre.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numeric>
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

/// Those that are kept along a push, between two depths.
struct Stops {
  double from, to;  //                                                                    [mm]
  std::vector<Stop> kept;
};

/// A state, and the turn that is tried there.
struct Try {
  const Attempt* parent;
  std::vector<Move> moves;  // up to the state
  const Trial::Mark* mark;
  double turn;  //                                                                        [rad]
  bool pull;    // also after pulls
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

/// The trial of a search: nobody asks for its shapes on the way, nor for where it pressed the wall.
simulate::InsertionOptions without_records(simulate::InsertionOptions options) {
  options.record_every = 1e9;
  options.map_forces = false;
  return options;
}

/// What a Newton iteration takes on one core of 2 GHz: so much for each element of the longest
/// insertion (MEASUREMENTS.md).
double seconds_per_iteration(const Study& study, const simulate::VesselModel& vessel) {
  constexpr double kRigid = 0.5e-6, kYielding = 1.0e-6, kMoving = 2.1e-6;  //             [s]
  return study.insertion.length / study.insertion.element_length *
         (vessel.sections     ? kMoving
          : vessel.compliance ? kYielding
                              : kRigid);
}

void add(SearchEffort& sum, const SearchEffort& effort) {
  sum.branches += effort.branches;
  sum.iterations += effort.iterations;
  sum.most_iterations += effort.most_iterations;
  sum.no_further += effort.no_further;
  sum.cut_off += effort.cut_off;
}

bool feels_turns(const simulate::Wire& wire) { return !(wire.straight() && wire.round()); }

/// Each of the first `count` numbers once, any few in a row spread over all of them: steps of the
/// golden section.
std::vector<std::size_t> spread(std::size_t count) {
  constexpr double kGolden = 0.6180339887498949;
  auto stride = static_cast<std::size_t>(kGolden * static_cast<double>(count));
  stride = std::max<std::size_t>(stride, 1);
  while (std::gcd(stride, count) > 1) ++stride;
  std::vector<std::size_t> order(count);
  for (std::size_t k = 0; k < count; ++k) order[k] = k * stride % count;
  return order;
}

/// The search from one start. Serial.
class Search {
 public:
  Search(const Study& study, const Candidate& start, const Centerline& path,
         const simulate::VesselModel& vessel, const SearchLimits& limits, long most_iterations,
         const std::function<bool()>& cancelled)
      : study_(study),
        path_(path),
        step_(study.insertion.step),
        limits_(limits),
        cancelled_(cancelled),
        trial_(study.wires[static_cast<std::size_t>(start.wire)], make_introducer(study, start),
               study.goal, vessel, without_records(study.insertion)) {
    effort_.most_iterations = most_iterations;
  }

  std::vector<Attempt> run() {
    trial_.save(begin_);
    std::vector<Attempt> front(1), found;
    front[0] = push_on({}, nullptr);
    furthest_ = front[0].progress;
    for (int turns = 0; turns < limits_.most_turns; ++turns) {
      const double before = furthest_;
      std::vector<Attempt> next = expand(front);
      std::stable_sort(next.begin(), next.end(), [](const Attempt& a, const Attempt& b) {
        if (a.reached != b.reached) return a.reached;
        if (a.reached) return a.peak_force < b.peak_force;
        return a.progress > b.progress;
      });
      for (const Attempt& attempt : next) {
        if (attempt.reached && found.size() < kKept) found.push_back(attempt);
      }
      if (!found.empty() || is_cancelled()) break;
      effort_.cut_off = has_no_work_left();
      effort_.no_further = effort_.cut_off == 0 && furthest_ < before + kFurther;
      if (effort_.cut_off + effort_.no_further > 0) break;
      next.resize(std::min<std::size_t>(next.size(), kBeam));
      front = std::move(next);
    }
    return found;
  }
  const SearchEffort& effort() const { return effort_; }

 private:
  bool is_cancelled() const { return cancelled_ && cancelled_(); }
  bool has_no_work_left() const { return effort_.iterations >= effort_.most_iterations; }

  /// Pushes from where the trial is until it ends or goes astray; what came of `moves` and this.
  /// Where `stops` is given, keeps states along the way.
  Attempt push_on(const std::vector<Move>& moves, Stops* stops) {
    ++effort_.branches;
    Attempt attempt{.moves = moves, .progress = progress_here(), .depth = trial_.depth()};
    double last_stop = -kMarkEvery;
    while (trial_.depth() - attempt.depth < std::max(kAstray, stops != nullptr ? kMarksOn : 0.0)) {
      if (stops != nullptr && trial_.depth() > 0.0 && trial_.depth() - last_stop >= kMarkEvery) {
        last_stop = trial_.depth();
        if (last_stop >= stops->from && last_stop <= stops->to) {
          trial_.save(stops->kept.emplace_back(Stop{{}, last_stop}).mark);
        }
      }
      const std::size_t made = trial_.pushes().size();
      const bool goes_on = trial_.step({.push = step_});
      if (trial_.pushes().size() > made) effort_.iterations += trial_.pushes().back().iterations;
      if (!goes_on) break;
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
    return find_progress(trial_.tip_at_rest(), study_, path_);
  }

  /// A round: tries turns, and pulls after them, round the places where the attempts left the path.
  /// What came further than the attempt that it went on from, in the order of the tries.
  std::vector<Attempt> expand(const std::vector<Attempt>& front) {
    std::vector<Stops> stops(front.size());
    std::vector<Try> tries;
    for (std::size_t k = 0; k < front.size(); ++k) list_tries(front[k], stops[k], tries);
    std::vector<std::vector<Attempt>> kept(tries.size());
    in_vain_ = 0;
    int left_behind = 0;
    bool reached = false;
    for (const std::size_t k : spread(tries.size())) {
      const bool enough = in_vain_ >= limits_.patience || left_behind >= kBeam;
      if (is_cancelled() || has_no_work_left() || (enough && !reached)) break;
      try_turn(tries[k], kept[k]);
      for (const Attempt& attempt : kept[k]) {
        reached = reached || attempt.reached;
        left_behind += attempt.progress > tries[k].parent->progress + kMarksBack + kMarksOn;
      }
    }
    std::vector<Attempt> all;
    for (std::vector<Attempt>& own : kept) {
      all.insert(all.end(), std::make_move_iterator(own.begin()),
                 std::make_move_iterator(own.end()));
    }
    return all;
  }

  /// The tries round the place where an attempt left the path, from states that `stops` keeps.
  void list_tries(const Attempt& attempt, Stops& stops, std::vector<Try>& tries) {
    // The attempt again, with the states of its last push.
    trial_.restore(begin_);
    for (const Move& move : attempt.moves) make(move);
    if (trial_.ended()) return;
    const double from = trial_.depth();
    stops = {.from = attempt.depth - kMarksBack, .to = attempt.depth + kMarksOn, .kept = {}};
    push_on(attempt.moves, &stops);
    for (const Stop& stop : stops.kept) {
      std::vector<Move> moves = attempt.moves;
      if (stop.depth > from) moves = joined(moves, {.push = stop.depth - from});
      for (int k = 1; k < kDirections; ++k) {
        const double angle = 2.0 * kPi * (k <= kDirections / 2 ? k : k - kDirections) / kDirections;
        tries.push_back({.parent = &attempt,
                         .moves = moves,
                         .mark = &stop.mark,
                         .turn = angle,
                         .pull = stop.depth > attempt.depth});
      }
    }
  }

  /// From a state, the last of the moves, a turn; then pushes on, and where `pull`, pulls back and
  /// pushes on instead.
  void try_turn(const Try& its, std::vector<Attempt>& kept) {
    trial_.restore(*its.mark);
    std::vector<Move> moves = joined(its.moves, {.turn = its.turn});
    make(moves.back());
    if (trial_.ended()) return;
    Trial::Mark turned;
    trial_.save(turned);
    for (int pulls = 0; pulls <= (its.pull ? kPulls : 0); ++pulls) {
      if (pulls > 0) {
        const Move back{.push = -std::min(kPull, std::max(0.0, trial_.depth() - 2.0 * step_))};
        if (back.push > -step_) return;
        make(back);
        if (trial_.ended()) return;
        moves = joined(moves, back);
        trial_.save(turned);
      }
      Attempt attempt = push_on(moves, nullptr);
      ++in_vain_;
      if (attempt.reached || attempt.progress > furthest_ + kFurther) {
        furthest_ = std::max(furthest_, attempt.progress);
        in_vain_ = 0;
      }
      if (attempt.reached || attempt.progress > its.parent->progress + kFurther) {
        kept.push_back(std::move(attempt));
      }
      trial_.restore(turned);
    }
  }

  void make(const Move& move) {
    const std::size_t made = trial_.pushes().size();
    trial_.make(move);
    for (std::size_t k = made; k < trial_.pushes().size(); ++k) {
      effort_.iterations += trial_.pushes()[k].iterations;
    }
  }

  const Study& study_;
  const Centerline& path_;
  double step_;  //                                                                       [mm]
  const SearchLimits& limits_;
  const std::function<bool()>& cancelled_;
  Trial trial_;
  Trial::Mark begin_;
  double furthest_ = 0.0;  // that any attempt came along the path                          [mm]
  int in_vain_ = 0;        // branches in a row that came no further
  SearchEffort effort_;
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
                           const SearchLimits& limits, const BatchOptions& options) {
  std::vector<std::vector<Attempt>> found(starts.size());
  std::vector<SearchEffort> efforts(starts.size());
  const double each =
      limits.most_seconds / std::max<double>(1.0, static_cast<double>(starts.size()));
  const long share = static_cast<long>(each / seconds_per_iteration(study, vessel));
  for_each_slot(
      static_cast<int>(starts.size()),
      [&](int slot) {
        const std::size_t k = static_cast<std::size_t>(slot);
        Search search(study, starts[k], path, vessel, limits, share, options.cancelled);
        found[k] = search.run();
        efforts[k] = search.effort();
      },
      options);
  Manoeuvres all;
  for (std::size_t k = 0; k < starts.size(); ++k) {
    add(all.effort, efforts[k]);
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
