#pragma once
/// How trials failed, and what would change that.
#include <string>
#include <vector>

#include "plan/verdict.h"

namespace wireplan::plan {

/// What a case whose target is in a branch may try where its wires alone do not do.
inline constexpr const char* kShapedCatheter =
    R"(A shaped catheter that leads the wire into the branch ("catheters": "suggest" tries some))";

/// "a", "a and b", "a, b and c", or with another word before the last.
std::string list_words(const std::vector<std::string>& parts, const std::string& last = "and");
/// Of all that there are: "3 of 9 trials", "all 9 trials", "both trials", "the one trial"
std::string part_of(int count, int all, const std::string& noun);
/// With a capital letter in front.
std::string capital(std::string text);

/// How trials ended.
struct Endings {
  int trials = 0;
  int reached = 0;                                          // also those that broke a limit
  int broke_tip_force = 0, broke_path = 0, broke_wall = 0;  // of these; one may break several
  int passed_by = 0, wrong_branch = 0, left_image = 0, stuck = 0, prolapsed = 0, left_lumen = 0;
  int another_way = 0;  // at the target, but not along the way
  int crossed = 0;      // ran through themselves: with contact between the loops they may go on
  int no_equilibrium = 0, our_fault = 0;
  int whole_wire_in = 0;  // of those that missed, with all of the wire in the body, ...
  int all_wire_in = 0;    // ... with as much of it as may go in ...
  int went_by = 0;        // of those that missed, past the target, beside it or beyond
  int missed = 0;         // ... and the others

  int unclear() const { return left_image + crossed + no_equilibrium + our_fault; }
  int clear() const { return trials - unclear(); }
  int held_by_wall() const { return stuck + prolapsed + left_lumen; }
};

/// Adds a trial of that wire toward that goal, inserted so.
void add_ending(Endings& endings, const Measured& trial, const simulate::Wire& wire,
                const simulate::Goal& goal, const simulate::InsertionOptions& insertion,
                const Limits& limits);

/// "12 passed by the branch, 3 got stuck": all that did not reach, the most frequent first.
std::string describe_endings(const Endings& endings);

/// In one sentence, of all trials and of those of them that were run in full: none is a plan.
std::string headline_of_failure(const Endings& all, const Endings& full);

/// Which limits those that reached break; expects that there are some.
std::string describe_broken_limits(const Endings& endings, const Limits& limits);

/// Of catheters and wires, where none of their scripts is a plan: what stopped each pair that
/// was tried, then why others were not; at most so many sentences, and one that counts the others.
std::vector<std::string> describe_pairs(const Known& known, std::size_t most = 4);

/// How far apart a plan ends with settings changed that should not matter: of one that is not
/// sensitive.
std::string describe_steadiness(const std::vector<Refinement>& refinements, int trial);

/// What would change how these end, the most frequent first; from what at least one in ten of them
/// ended by. `noun` is what they are: "trial", "repeat".
std::vector<std::string> changes_by(const Endings& endings, const Known& known,
                                    const std::string& noun);

}  // namespace wireplan::plan
