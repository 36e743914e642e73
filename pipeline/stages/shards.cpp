#include "pipeline/stages/shards.h"

#include <charconv>

namespace wireplan::pipeline {
namespace {

constexpr int kMostShards = 100000;

// Nothing where the text is not a whole number.
std::optional<int> read_whole(std::string_view text) {
  int value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

}  // namespace

Share parse_share(const std::string& text, int round) {
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    const std::optional<int> shard = read_whole(std::string_view(text).substr(0, slash));
    const std::optional<int> shards = read_whole(std::string_view(text).substr(slash + 1));
    if (shard && shards && *shard >= 1 && *shard <= *shards && *shards <= kMostShards) {
      return {.shard = *shard, .shards = *shards, .round = round};
    }
  }
  throw Error("--shard is \"" + text + "\", expected K/N with whole numbers 1 <= K <= N <= " +
              std::to_string(kMostShards) + ": 3/8 is the third of eight parts");
}

std::optional<ShareOutcome> run_share_of_case(const Case& given, RunOptions options,
                                              const Share& share) {
  std::optional<ShareOutcome> outcome;
  options.to = "trials";
  options.instead = [&](Workspace& work) { outcome = run_share(work, share); };
  run_stages(given, options);
  return outcome;
}

std::string describe_share(const Share& share, const std::optional<ShareOutcome>& outcome) {
  if (!outcome) return "the trials of this case are all in the store, nothing to do";
  const std::string round = "round " + std::to_string(share.round);
  if (outcome->round_trials == 0) return round + ": there is none, the round before was the last";
  return round + " (" + plan::level_name(outcome->level) + "), shard " +
         std::to_string(share.shard) + "/" + std::to_string(share.shards) + ": " +
         std::to_string(outcome->own_trials) + " of " + std::to_string(outcome->round_trials) +
         " trials, " + std::to_string(outcome->run) + " run now";
}

FirstRound read_first_round(const Artifact& trials) {
  const Json timing = read_json(trials.folder / kTimingFile, "wireplan.timing/1");
  const Json figures = read_json(trials.folder / kFiguresFile, "wireplan.trials/1");
  return {.run = timing.at("levels").front().at("trials_run"), .trials = figures.at("trials")};
}

}  // namespace wireplan::pipeline
