// What the shape of a wire in a vessel tells: whether it has folded or left, and where it bends
// most.
#include <algorithm>
#include <cmath>

#include "simulate/insertion/insertion.h"

namespace wireplan::simulate {

namespace {

constexpr double kFoldTurn = 150.0 * kRadPerDeg;  // turning beyond the rest shape's that is one
constexpr double kFoldLead = 10.0;    // ... with the bow so far ahead of the tip            [mm]
constexpr double kFoldLength = 60.0;  // ... within so much wire                [mm]

}  // namespace

std::optional<Vec3> Insertion::find_fold() const {
  const int n = rod_.nodes();
  for (int i = problem_.first; i + 1 < n; ++i) {
    const Vec3 from = edge(i).normalized();
    double rest = 0.0, length = 0.0;
    Vec3 bow = state_.x.col(i);
    for (int j = i + 1; j + 1 < n && length < kFoldLength; ++j) {
      length += rod_.rest_length[j];
      rest += std::abs(rod_.rest_angle[j]);
      if (from.dot(state_.x.col(j) - bow) > 0.0) bow = state_.x.col(j);
      const double turn = std::acos(std::clamp(from.dot(edge(j).normalized()), -1.0, 1.0));
      const bool leads = from.dot(bow - tip()) > kFoldLead &&
                         (bow - introducer_.point).norm() > (tip() - introducer_.point).norm();
      if (turn - rest > kFoldTurn && leads) return bow;
    }
  }
  return {};
}

std::optional<int> Insertion::left_through() const {
  const std::vector<preprocess::Opening>& openings = vessel_.lumen.openings();
  if (vessel_.sections == nullptr) return preprocess::left_through(openings, free_wire());
  // Places at rest are looked for only where the wire may have left.
  if (!preprocess::may_have_left(openings, at_rest(tip()))) return {};
  return preprocess::left_through(openings, end_at_rest(*vessel_.sections, state_.sections,
                                                        free_wire(), preprocess::kLookedAt));
}

Vec3 Insertion::most_bent() const {
  int most = std::min(problem_.first, rod_.nodes() - 2);
  for (int i = most; i + 1 < rod_.nodes(); ++i) {
    if (turn_at(i).norm() / rod_.share[i] > turn_at(most).norm() / rod_.share[most]) most = i;
  }
  return state_.x.col(most);
}

}  // namespace wireplan::simulate
