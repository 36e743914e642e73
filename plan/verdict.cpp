#include "plan/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "plan/anatomy/passage.h"
#include "plan/catheters.h"
#include "plan/number_text.h"
#include "plan/search.h"
#include "plan/statistics.h"
#include "plan/verdict_changes.h"

namespace wireplan::plan {
namespace {

constexpr std::array kGradeWords = {" below mild", "mild ", "moderate ", "severe "};
constexpr int kSevere = 3;

std::string percent(double part) { return std::to_string(std::lround(100.0 * part)); }

std::string whole_degrees(double angle) { return std::to_string(std::lround(angle / kRadPerDeg)); }

/// "severe tortuosity", "tortuosity below mild"
std::string graded(int grade, const std::string& what) {
  const std::string word = kGradeWords.at(static_cast<std::size_t>(grade));
  return grade == 0 ? what + word : word + what;
}

int safe_count(const RepeatedPlan& plan) {
  return static_cast<int>(std::count_if(plan.repeats.begin(), plan.repeats.end(),
                                        [](const Repeat& repeat) { return repeat.safe; }));
}

double safe_share(const RepeatedPlan& plan) {
  return static_cast<double>(safe_count(plan)) / static_cast<double>(plan.repeats.size());
}

/// "14 of 16"
std::string safe_of(const RepeatedPlan& plan) {
  return std::to_string(safe_count(plan)) + " of " + std::to_string(plan.repeats.size());
}

/// Collects findings; the worst one is the answer.
class Weighing {
 public:
  Weighing(const Known& known, const VerdictRules& rules)
      : known_(known), ranking_(known.judgement.ranking), rules_(rules) {}

  Verdict weigh() {
    if (ranking_.plans.empty()) {
      weigh_failure();
    } else {
      weigh_plan(ranking_.plans.front());
    }
    if (known_.way) weigh_way(*known_.way);
    return verdict();
  }

 private:
  struct Finding {
    Answer answer;  // that it leads to
    std::string sentence;
  };

  void find(Answer answer, std::string sentence) {
    findings_.push_back({answer, std::move(sentence)});
  }
  void change(std::string sentence) { changes_.push_back(std::move(sentence)); }

  const Measured& trial(int id) const { return known_.plan.trials[static_cast<std::size_t>(id)]; }
  const simulate::Wire& wire_of(int id) const {
    const Candidate& candidate = known_.plan.candidates[static_cast<std::size_t>(id)];
    return known_.study.wires[static_cast<std::size_t>(candidate.wire)];
  }
  std::string round_it(int id) const {
    const Candidate& candidate = known_.plan.candidates[static_cast<std::size_t>(id)];
    if (candidate.catheter < 0) return {};
    std::string text =
        " in the catheter " +
        known_.study.catheters[static_cast<std::size_t>(candidate.catheter)].tool.wire.name;
    if (candidate.first_wire >= 0) {
      text += ", brought in through it in exchange for " +
              known_.study.wires[static_cast<std::size_t>(candidate.first_wire)].name + ",";
    }
    return text;
  }
  const RepeatedPlan* repeats_of(int id) const {
    return find_repeated(known_.judgement.repeated, id);
  }

  // ---- No plan.
  void weigh_failure() {
    Endings all, fine, full;
    int reached_coarsely = 0;
    const simulate::InsertionOptions &own = known_.study.insertion,
                                     coarse = scout_study(known_.study).insertion;
    for (std::size_t k = 0; k < known_.plan.trials.size(); ++k) {
      const int id = static_cast<int>(k);
      const Level level = known_.plan.levels[k];
      const auto add = [&](Endings& endings) {
        add_ending(endings, trial(id), wire_of(id), known_.study.goal,
                   level == Level::kScout ? coarse : own, known_.limits);
      };
      add(all);
      if (level != Level::kScout) add(fine);
      if (level == Level::kFull) add(full);
      reached_coarsely += level != Level::kFull && trial(id).metrics.reached;
    }
    headline_ = headline_of_failure(all, full);
    const Answer answer =
        leaves_open(all, fine, full, reached_coarsely) ? Answer::kUnsure : Answer::kNotFeasible;
    if (full.reached > 0) {
      find(answer, count_of(full.reached, "trial") +
                       (full.reached == 1 ? " reaches the target but breaks"
                                          : " reach the target but break") +
                       " a limit: " + describe_broken_limits(full, known_.limits) + ".");
    }
    if (all.reached < all.trials) find(answer, how_trials_ended(all, fine));
    tell_scripts(answer);
    const bool rigid_is_enough =
        known_.yields && answer == Answer::kNotFeasible && full.trials == 0;
    if (rigid_is_enough) tell_rigid(answer, all);
    for (std::string& text : changes_by(all, known_, "trial")) change(std::move(text));
    const bool nothing_to_learn = rigid_is_enough && all.held_by_wall() == 0;
    if (full.trials < all.trials && !nothing_to_learn) {
      const std::string part = part_of(all.trials - full.trials, all.trials, "trial");
      change("Running all trials in full detail: " +
             (known_.yields ? std::string("the wall was ") + wall_taken() + " in " + part + "."
                            : "long elements were taken in " + part + "."));
    }
  }

  /// What was searched beside straight pushes.
  void tell_scripts(Answer answer) {
    const Scripts& scripts = known_.plan.scripts;
    if (scripts.starts_tried > 0) {
      const std::string found = scripts.found.empty()
                                    ? "none of them reached"
                                    : std::to_string(scripts.found.size()) + " came up to be tried";
      find(answer, "Turns and pulls of the wire on the way were searched too: " +
                       std::to_string(scripts.branches) + " pushes from " +
                       count_of(scripts.starts_tried, "start") + ", " + found + "." +
                       describe_searches(scripts));
    }
    const auto tried = std::count_if(scripts.pairs.begin(), scripts.pairs.end(),
                                     [](const PairFindings& pair) { return pair.tried(); });
    if (tried > 0) {
      find(answer, "Scripts of a catheter with a wire in it were searched for " +
                       count_of(static_cast<int>(tried), "pair") + ".");
    }
    for (std::string& text : describe_pairs(known_)) find(answer, std::move(text));
  }

  /// Why the searches for turns and pulls ended.
  static std::string describe_searches(const Scripts& scripts) {
    std::string text;
    bool cut_off = false;
    for (const auto& [level, effort] : scripts.searches) {
      std::vector<std::string> ends;
      if (effort.no_further > 0) {
        ends.push_back("more turns brought the tip no further from " +
                       count_of(effort.no_further, "start"));
      }
      if (effort.cut_off > 0) {
        ends.push_back("the search was cut off at its limit of work from " +
                       count_of(effort.cut_off, "start"));
      }
      if (ends.empty()) continue;
      text += std::string(level == Level::kFull ? " In full detail " : " In coarse trials ") +
              list_words(ends, "and") + ".";
      cut_off = cut_off || effort.cut_off > 0;
    }
    if (cut_off) {
      text +=
          " Where it was cut off, scripts may have been missed: with fewer wires in the case it "
          "goes further for each.";
    }
    return text;
  }

  /// The wall of a vessel that yields, where trials are not run in full.
  const char* wall_taken() const {
    return known_.moves ? "taken to move as a whole and take no dents" : "taken for rigid";
  }

  /// Why trials against a rigid wall are enough for that answer.
  void tell_rigid(Answer answer, const Endings& all) {
    std::vector<std::string> ends;
    int ended = 0;
    const auto add = [&](int trials, const char* how) {
      if (trials > 0) ends.emplace_back(how);
      ended += trials;
    };
    add(all.passed_by + all.wrong_branch + all.another_way, "in another vessel");
    add(all.left_image, "at an end of the imaged vessel");
    add(all.whole_wire_in + all.all_wire_in, "before the target for want of wire");
    add(all.went_by, "beside the target or beyond it");
    add(all.missed, "with a tip that went no further along the way");
    if (ended == 0) return;
    find(answer, std::string("The wall was ") + wall_taken() + ", which is enough here: " +
                     part_of(ended, all.trials, "trial") + " ended " + list_words(ends, "or") +
                     ", which a wall that gives way by tenths of a millimetre does not change.");
  }

  static std::string how_trials_ended(const Endings& all, const Endings& fine) {
    const std::string number = std::to_string(all.trials), endings = describe_endings(all);
    std::string text =
        endings.starts_with(number + " ")
            ? capital(part_of(all.trials, all.trials, "trial")) + endings.substr(number.size())
            : "Of " + count_of(all.trials, "trial") + " " + endings;
    if (fine.trials == 0) {
      text += ", computed coarsely";
    } else if (fine.trials < all.trials) {
      text += "; " + std::to_string(fine.trials) +
              " of them were computed with fine elements, the "
              "others coarsely";
    }
    return text + ".";
  }

  bool leaves_open(const Endings& all, const Endings& fine, const Endings& full,
                   int reached_coarsely) {
    const std::size_t before = findings_.size();
    if (fine.clear() == 0) {
      find(Answer::kUnsure,
           fine.trials == 0 ? "No trial was computed with fine elements."
                            : "No trial that was computed with fine elements came to a clear end.");
    }
    if (all.unclear() > rules_.unclear_part * all.trials) {
      find(Answer::kUnsure,
           capital(part_of(all.unclear(), all.trials, "trial")) +
               " ended without telling whether the wire would reach the target; at most " +
               percent(rules_.unclear_part) + " % may.");
    }
    if (reached_coarsely > 0) {
      find(Answer::kUnsure,
           count_of(reached_coarsely, "trial") + (reached_coarsely == 1 ? " reaches" : " reach") +
               " the target against " + wall_of_scouts(known_.moves) + ", and " +
               (reached_coarsely == 1 ? "was" : "were") + " not run in full detail.");
    }
    if (known_.yields && full.trials == 0 && 2 * all.held_by_wall() > all.trials) {
      find(Answer::kUnsure, capital(part_of(all.held_by_wall(), all.trials, "trial")) +
                                " got stuck, folded back or went through the wall, which was " +
                                wall_taken() + ": one that gives way may let the wire pass.");
    }
    return findings_.size() > before;
  }

  // ---- A plan.
  void weigh_length(const RankedPlan& first) {
    if (!known_.way || !known_.way->wire_needed) return;
    const Candidate& candidate = known_.plan.candidates[static_cast<std::size_t>(first.trial)];
    const int own = candidate.catheter;
    double length = HUGE_VAL;  // of the shorter, where the plan has two
    for (const int wire : wires_of(candidate)) {
      length = std::min(length, known_.study.wires[static_cast<std::size_t>(wire)].length());
    }
    if (length >= *known_.way->wire_needed) return;
    const std::string told = whole_millimetres(*known_.way->wire_needed);
    find(Answer::kFeasible, "The wire is " + whole_millimetres(length) + " long, and " + told +
                                " are needed to take " + (own < 0 ? "a" : "the") +
                                " catheter over it and hold it.");
    change("A wire of at least " + told + ", or a shorter catheter.");
  }

  void weigh_plan(const RankedPlan& first) {
    const RepeatedPlan* repeats = repeats_of(first.trial);
    const Metrics& m = trial(first.trial).metrics;
    headline_ = "The wire " + wire_of(first.trial).name + round_it(first.trial) +
                " reaches the target within all limits, " +
                (repeats == nullptr ? "not tried under disturbances"
                                    : "safe in " + safe_of(*repeats) + " disturbed repeats") +
                ", with at most " + two_digits(m.peak_tip_force) + " N at its tip.";
    weigh_share(first, repeats);
    weigh_tip_force(first, repeats);
    weigh_tip_error(first);
    weigh_sensitivity(first);
    if (!doubts_.empty()) {
      headline_ = "In the computation the wire " + wire_of(first.trial).name +
                  round_it(first.trial) + " reaches the target within all limits, but " +
                  list_words(doubts_) + ".";
    }
    if (m.wall_motion.beyond_linear_theory()) {
      find(Answer::kFeasibleWithRisk,
           (known_.moves ? "The wall is dented by " : "The wall moves ") +
               two_digits(m.wall_motion.displacement) + " mm where the vessel's radius is " +
               two_digits(m.wall_motion.radius) + " mm, more than the " +
               two_digits(kLinearWallPart) +
               " of the radius that its model holds for: forces there are rough.");
      const auto merit = [&](const RankedPlan& other) {
        const WallMotion& motion = trial(other.trial).metrics.wall_motion;
        return motion.beyond_linear_theory() ? "" : two_digits(motion.displacement) + " mm";
      };
      const std::string dents = known_.moves ? "dents" : "moves";
      if (!offer_other(first,
                       known_.moves ? "dents of the wall at most " : "the wall moves at most ",
                       merit)) {
        change("A softer wire, which " + dents + " the wall less.");
      }
    }
    weigh_length(first);
  }

  void weigh_share(const RankedPlan& first, const RepeatedPlan* repeats) {
    if (repeats == nullptr) {
      find(Answer::kUnsure,
           "How often the plan stays safe is not known: it was not repeated under disturbances.");
      doubts_.push_back("how often it stays safe is not known");
      change("Repeating the plan under disturbances, to know how often it stays safe.");
      return;
    }
    const int count = static_cast<int>(repeats->repeats.size());
    const auto [low, high] = wilson_interval(safe_count(*repeats), count);
    const auto reached = std::count_if(repeats->repeats.begin(), repeats->repeats.end(),
                                       [](const Repeat& repeat) { return repeat.reached; });
    const bool too_low = safe_share(*repeats) < rules_.safe_share;
    const bool too_few = (low <= rules_.doubtful_share && high >= rules_.safe_share) ||
                         (!too_low && low < rules_.sure_share);
    const bool seldom = high < rules_.doubtful_share;
    std::string text = "Safe in " + safe_of(*repeats) + " disturbed repeats, which is " +
                       percent(safe_share(*repeats)) + " % (" + percent(low) + " to " +
                       percent(high) + " % with 95 % confidence), where " +
                       percent(rules_.safe_share) + " % is asked for";
    if (reached > safe_count(*repeats)) text += "; it reaches in " + std::to_string(reached);
    if (too_few) {
      text +=
          "; too few repeats to tell: at least " + percent(rules_.sure_share) + " % are to be sure";
    }
    if (seldom) text += "; a plan that fails more often than not is none to count on";
    find(too_few || seldom ? Answer::kUnsure
         : too_low         ? Answer::kFeasibleWithRisk
                           : Answer::kFeasible,
         text + ".");
    if (seldom) doubts_.push_back("in disturbed repeats it fails more often than not");
    if (too_few) doubts_.push_back("the repeats are too few to tell how often it stays safe");
    if (too_few) change("More than " + count_of(count, "repeat") + ", to know the share better.");
    if (!too_low) return;
    Endings failed;
    for (const RepeatedTrials& own : known_.plan.repeated) {
      if (own.trial != first.trial) continue;
      for (std::size_t k = 0; k < own.trials.size(); ++k) {
        if (repeats->repeats[k].safe) continue;
        add_ending(failed, own.trials[k], wire_of(first.trial), known_.study.goal,
                   known_.study.insertion, known_.limits);
      }
    }
    for (std::string& text_of : changes_by(failed, known_, "failed repeat")) {
      change(std::move(text_of));
    }
  }

  /// In 95 % of its repeats.
  static double disturbed_tip_force(const RepeatedPlan& repeats) {
    std::vector<double> forces;
    for (const Repeat& repeat : repeats.repeats) forces.push_back(repeat.peak_tip_force);
    return find_spread(forces).high;
  }

  /// As it was planned, and in 95 % of its repeats where it has any.
  double most_tip_force(int id) const {
    const double force = trial(id).metrics.peak_tip_force;
    const RepeatedPlan* repeats = repeats_of(id);
    return repeats == nullptr ? force : std::max(force, disturbed_tip_force(*repeats));
  }

  void weigh_tip_force(const RankedPlan& first, const RepeatedPlan* repeats) {
    std::string text =
        "Tip force at most " + two_digits(trial(first.trial).metrics.peak_tip_force) + " N";
    if (repeats != nullptr) {
      text += ", and " + two_digits(disturbed_tip_force(*repeats)) +
              " N in 95 % of the disturbed repeats";
    }
    const double warn = known_.limits.tip_force_warn;
    const bool risk = most_tip_force(first.trial) > warn;
    text += std::string(risk ? ": above" : ": below") + " the warning level of " +
            four_digits(warn) + " N (limit " + four_digits(known_.limits.tip_force_fail) + " N).";
    find(risk ? Answer::kFeasibleWithRisk : Answer::kFeasible, text);
    if (!risk) return;
    const auto merit = [&](const RankedPlan& other) -> std::string {
      const double less = most_tip_force(other.trial);
      if (less > warn) return "";
      const std::size_t own = repeats_of(other.trial)->repeats.size();
      const bool fewer = repeats != nullptr && own < repeats->repeats.size();
      return two_digits(less) + " N" +
             (fewer ? ", over " + std::to_string(own) + " disturbed repeats" : "");
    };
    if (!offer_other(first, "tip force at most ", merit)) {
      change("A wire with a softer tip, which presses less on the wall.");
    }
  }

  /// For a plan whose end hangs on how it is computed.
  void change_for_a_steadier() {
    const bool bare = known_.study.catheters.empty();
    std::string sentence = bare && find_ostium(known_.study.goal)
                               ? std::string(kShapedCatheter) + ", or another "
                               : "Another ";
    sentence.append(bare ? "wire, angle or roll" : "wire, catheter, angle or roll");
    change(sentence + " whose end does not hang on how it is computed.");
  }

  void weigh_tip_error(const RankedPlan& first) {
    const simulate::Goal& goal = known_.study.goal;
    if (!first.tip_error && first.tip_unsure) {
      find(Answer::kUnsure,
           "The error of the tip's place could not be told: runs with other elements or shorter "
           "pushes do not end there.");
      doubts_.push_back("runs with other elements or shorter pushes do not end there");
      change_for_a_steadier();
      return;
    }
    if (!first.tip_error) {
      find(Answer::kUnsure, "The error of the tip's place is not known.");
      doubts_.push_back("the error of the tip's place is not known");
      change("Computing the plan with finer elements too, to know the tip's error.");
      return;
    }
    const double distance = trial(first.trial).metrics.tip_to_target;
    const bool large = first.tip_unsure;
    std::string text = "The tip's stated error is " + two_digits(*first.tip_error) +
                       " mm, of the computation alone";
    text += goal.at_section
                ? "; the lumen at the target has a radius of " + one_decimal(goal.radius) + " mm"
                : "; it ends " + one_decimal(distance) + " mm from the middle of a target of " +
                      one_decimal(goal.radius) + " mm radius";
    if (large) text += ", so it may not be in the target";
    find(large ? Answer::kUnsure : Answer::kFeasible, text + ".");
    if (large) doubts_.push_back("the tip's error is too large to tell that it is in the target");
    if (large) change("A computation with finer elements, for a smaller error of the tip.");
  }

  void weigh_sensitivity(const RankedPlan& first) {
    if (!first.sensitive) return;  // its error is not known either, or it stands behind none
    if (!is_sensitive(first)) {
      find(Answer::kFeasible, "The end of the plan does not hang on how it is computed: " +
                                  describe_steadiness(known_.plan.refinements, first.trial) + ".");
      return;
    }
    find(Answer::kUnsure, "The end of the plan hangs on how it is computed: " + *first.sensitive +
                              ". The real wire may end elsewhere than shown, too.");
    doubts_.push_back("where its tip ends hangs on how it is computed");
    change_for_a_steadier();
  }

  /// The best other plan that `merit` has something to say of, if any: one that in its repeats is
  /// safe as often as is asked for, or as the first, and whose tip is known to end in the target.
  template <typename Merit>
  bool offer_other(const RankedPlan& first, const std::string& what, const Merit& merit) {
    for (std::size_t k = 0; k < ranking_.plans.size(); ++k) {
      const RankedPlan& other = ranking_.plans[k];
      const RepeatedPlan* repeats = repeats_of(other.trial);
      if (other.trial == first.trial || repeats == nullptr) continue;
      if (!other.tip_error || ends_unsure(other)) continue;
      if (safe_share(*repeats) < std::min(rules_.safe_share, first.expected_safe)) continue;
      const std::string text = merit(other);
      if (text.empty()) continue;
      const auto id = static_cast<std::size_t>(other.trial);
      std::string sentence = "Plan " + std::to_string(k + 1) + " in its place (";
      sentence.append(describe(known_.study, known_.plan.candidates[id]));
      sentence.append("): ").append(what).append(text).append(".");
      change(std::move(sentence));
      return true;
    }
    return false;
  }

  // ---- The way.
  void weigh_way(const WayFindings& way) {
    weigh_device(way.device);
    weigh_sheath(way);
    bool severe = false;
    if (way.tortuosity) {
      severe = way.tortuosity_grade >= kSevere;
      const std::string times = two_decimals(*way.tortuosity);
      find(severe ? Answer::kFeasibleWithRisk : Answer::kFeasible,
           (times == "1.00" ? "The way is straight (1.00 times the line between its ends): "
                            : "The way is " + times +
                                  " times as long as the straight line between its ends: ") +
               graded(way.tortuosity_grade, "tortuosity") + ".");
    }
    const std::string bend = "The sharpest bend leaves " + whole_degrees(way.bend) +
                             " deg between its arms (180 is straight), " +
                             whole_millimetres(way.bend_at) + " from the access";
    if (way.bend_ostium.empty() && way.bend >= kNoBend && way.bend_grade == 0) {
      find(Answer::kFeasible, "No bend of the way leaves less than " + whole_degrees(way.bend) +
                                  " deg between its arms (180 is straight): " +
                                  graded(way.bend_grade, "angulation") + ".");
    } else if (way.bend_ostium.empty()) {
      severe = severe || way.bend_grade >= kSevere;
      find(way.bend_grade >= kSevere ? Answer::kFeasibleWithRisk : Answer::kFeasible,
           bend + ": " + graded(way.bend_grade, "angulation") + ".");
    } else {
      find(Answer::kFeasible, bend + ", where the way turns into " + way.bend_ostium + ".");
    }
    if (severe) change("Another access, from which the way is less bent.");
  }

  void weigh_device(const Passage& passage) {
    const double off = 2.0 * known_.wall_offset;
    const bool too_wide = passage.device >= passage.max_ratio * passage.lumen;
    const bool surely = passage.device > passage.max_ratio * (passage.lumen + off);
    std::string text = "The narrowest place of the way is " + three_digits(passage.lumen) +
                       " mm wide, " + whole_millimetres(passage.at) + " from the access; " +
                       "a device of " + three_digits(passage.device) +
                       (passage.assumed ? " mm, which is assumed, " : " mm ");
    text += surely     ? "does not pass"
            : too_wide ? "passes only if the lumen is wider than it seems, which it may be by " +
                             two_digits(off) + " mm"
            : passage.oval ? "passes where the lumen, oval there, gives way"
                           : "passes";
    const bool decides = surely && !passage.assumed;
    if (decides) narrow_ = text + ".";
    find(decides    ? Answer::kNotFeasible
         : too_wide ? Answer::kFeasibleWithRisk
                    : Answer::kFeasible,
         text + ".");
    if (too_wide) {
      change("A device thinner than " + three_digits(passage.max_ratio * passage.lumen) + " mm.");
    }
  }

  void weigh_sheath(const WayFindings& way) {
    const Passage& sheath = way.sheath;
    if (!way.weighs_sheath) {
      find(Answer::kFeasible, "No sheath is weighed: the assumed one is " +
                                  whole_millimetres(way.sheath_length) + " long, the way " +
                                  whole_millimetres(way.length) + ".");
      return;
    }
    const bool too_wide = sheath.device >= sheath.max_ratio * sheath.lumen;
    find(too_wide ? Answer::kFeasibleWithRisk : Answer::kFeasible,
         "The sheath of " + three_digits(sheath.device) +
             (sheath.assumed ? " mm (assumed) is " : " mm is ") +
             two_decimals(sheath.device / sheath.lumen) +
             " times as wide as the narrowest lumen in the first " +
             whole_millimetres(way.sheath_length) + " (" + three_digits(sheath.lumen) + " mm); " +
             (too_wide ? "it must be below " : "below ") + four_digits(sheath.max_ratio) +
             (too_wide      ? "."
              : sheath.oval ? " it passes where the lumen, oval there, gives way."
                            : " it passes."));
    if (too_wide) {
      change("A sheath thinner than " + three_digits(sheath.max_ratio * sheath.lumen) +
             " mm, or another access.");
    }
  }

  Verdict verdict() {
    const auto worse = [](const Finding& a, const Finding& b) { return a.answer > b.answer; };
    std::stable_sort(findings_.begin(), findings_.end(), worse);
    expects(!findings_.empty());
    Verdict verdict{.answer = findings_.front().answer,
                    .headline = narrow_.empty() ? headline_ : narrow_,
                    .reasons = {},
                    .changes = std::move(changes_)};
    for (Finding& finding : findings_) verdict.reasons.push_back(std::move(finding.sentence));
    return verdict;
  }

  const Known& known_;
  const Ranking& ranking_;
  VerdictRules rules_;
  std::vector<Finding> findings_;
  std::vector<std::string> changes_;
  std::string headline_;
  std::vector<std::string> doubts_;  // that leave it open whether the plan holds
  std::string narrow_;               // the headline where the device does not pass
};

}  // namespace

const char* answer_name(Answer answer) {
  constexpr std::array kNames = {"feasible", "feasible_with_risk", "unsure", "not_feasible"};
  return kNames.at(static_cast<std::size_t>(answer));
}

const char* answer_words(Answer answer) {
  constexpr std::array kWords = {"feasible", "feasible with risk", "unsure", "not feasible"};
  return kWords.at(static_cast<std::size_t>(answer));
}

Verdict find_verdict(const Known& known, const VerdictRules& rules) {
  return Weighing(known, rules).weigh();
}

}  // namespace wireplan::plan
