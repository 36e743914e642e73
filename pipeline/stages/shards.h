#pragma once
/// `wireplan trials CASE --shard K/N`: the trials of one case by several processes, each started
/// alone, in any order and as often as needed. They meet in the store and nowhere else.
#include <string>

#include "pipeline/stages/stages.h"

namespace wireplan::pipeline {

/// "3/8" is the third of eight parts. Throws `Error` for what is not 1 <= K <= N.
Share parse_share(const std::string& text, int round);

/// Makes what the trials read (where another process makes it, waits for that), then runs the
/// share. Nothing where the store has all trials of the case already.
std::optional<ShareOutcome> run_share_of_case(const Case& given, RunOptions options,
                                              const Share& share);

/// "round 1 (scout), shard 3/8: 28 of 221 trials, 28 run now"
std::string describe_share(const Share& share, const std::optional<ShareOutcome>& outcome);

/// How many trials of the first round were run by the process that made the artifact `trials`, and
/// not by a shard before it; and how many there are.
struct FirstRound {
  int run = 0, trials = 0;
};
FirstRound read_first_round(const Artifact& trials);

}  // namespace wireplan::pipeline
