#pragma once
/// Who is repeated next where a repeat takes seconds, as of scripts of catheter and wire: the first
/// plans as often as is asked for, the others as often as it takes to know that they cannot come
/// before the first.
#include <vector>

#include "plan/robustness.h"

namespace wireplan::plan {

/// Repeats of a script that may come first, and of one that may not: fewer tell next to nothing.
inline constexpr int kFewRepeats = 8, kFewestRepeats = 4;

/// Whether a plan may still come before the first, whose repeats are known: by those of its own it
/// was unsafe less often than the first in all of its; or as often, and the mean difference of
/// their scores over the repeats that both have may be in its favour (mean_interval()). Without any
/// it may where the first was unsafe at all, else where the two are tied. Of plans whose end is not
/// sure none may where the first's is.
bool may_lead(const RankedPlan& plan, const RankedPlan& first,
              const std::vector<RepeatedPlan>& repeated);

/// Whether a plan is among the first so many of the ranking, or the best of a wire.
bool gets_all_repeats(int trial, const Ranking& ranking, int first);

/// Which plans are repeated until each has `count`.
struct NextRepeats {
  std::vector<int> plans = {};  // trials, best first; none: nobody
  int count = 0;
};

/// Of all that do not get all repeats: the best `among` of the ranking, and the
/// best of each catheter, that may lead, first so often as the fewest, then as the few; and once
/// the best of a catheter without any repeats, so often as the fewest. None before the first of the
/// ranking has a few. No more than `most` of each.
NextRepeats choose_others_to_repeat(const Ranking& ranking,
                                    const std::vector<Candidate>& candidates,
                                    const std::vector<RepeatedPlan>& repeated, int first, int among,
                                    int most);

}  // namespace wireplan::plan
