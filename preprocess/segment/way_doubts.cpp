#include "preprocess/segment/way_doubts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <queue>
#include <utility>

namespace wireplan::preprocess {
namespace {

constexpr double kBesideMm = 10.0;   // how far before and behind a place one looks
constexpr double kEveryMm = 2.0;     // and how often
constexpr double kLeastStep = 0.16;  // of the contrast, from which a change of level is told
constexpr double kNeck = 0.5;        // of the lesser side: what is no wider is a neck
constexpr double kWideVoxels = 3.0;  // a side is at least so wide, in radius
constexpr double kSamePlaceMm = 15.0;

/// A place of a way with those before and behind it, as places in the way.
struct Span {
  std::size_t before = 0, at = 0, after = 0;
};

std::vector<Span> spans_of(const Grid& grid, const std::vector<WayLevel>& way) {
  std::vector<double> arc(way.size(), 0.0);
  for (std::size_t k = 1; k < way.size(); ++k) {
    arc[k] =
        arc[k - 1] + (center_of(grid, way[k].voxel) - center_of(grid, way[k - 1].voxel)).norm();
  }
  std::vector<Span> spans;
  double last = -kEveryMm;
  for (std::size_t k = 0; k < way.size(); ++k) {
    if (arc[k] < kBesideMm || arc.back() - arc[k] < kBesideMm || arc[k] - last < kEveryMm) continue;
    last = arc[k];
    Span span{.before = k, .at = k, .after = k};
    while (arc[k] - arc[span.before] < kBesideMm) --span.before;
    while (arc[span.after] - arc[k] < kBesideMm) ++span.after;
    spans.push_back(span);
  }
  return spans;
}

/// Uphill in depth to a maximum within reach of where one began.
std::size_t middle_of(const Grid& grid, const std::vector<float>& depth, std::size_t start) {
  const Vec3 from = center_of(grid, start);
  std::size_t best = start, at = start;
  do {
    at = best;
    for_each_neighbour(grid, at, [&](std::size_t m, const Voxel&) {
      if (depth[m] > depth[best] && (center_of(grid, m) - from).norm() <= 0.5 * kBesideMm) best = m;
    });
  } while (best != at);
  return best;
}

/// The narrowest place of the widest way from one voxel to another; none where they are not
/// connected within reach of `round`.
std::optional<std::size_t> neck_between(const Grid& grid, const std::vector<float>& depth,
                                        std::size_t from, std::size_t to, const Vec3& round) {
  constexpr double kReach = 2.5;                             // times the way looked at
  std::priority_queue<std::pair<float, std::size_t>> queue;  // the widest first
  Labels seen(depth.size(), 0);
  std::size_t neck = from;
  queue.push({depth[from], from});
  seen[from] = 1;
  while (!queue.empty()) {
    const auto [width, n] = queue.top();
    queue.pop();
    if (width < depth[neck]) neck = n;
    if (n == to) return neck;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) {
      if (seen[m] != 0 || depth[m] <= 0.0F) return;
      seen[m] = 1;
      if ((center_of(grid, m) - round).norm() <= kReach * kBesideMm) queue.push({depth[m], m});
    });
  }
  return {};
}

/// The greatest change of level along a way, beyond what it changes by over its whole length.
std::optional<WayDoubt> level_doubt(const LumenField& field, const std::vector<WayLevel>& way,
                                    const std::vector<Span>& spans) {
  if (spans.empty()) return {};
  const auto level_at = [&](std::size_t k) { return static_cast<double>(way[k].level); };
  const double whole = level_at(way.size() - 1) - level_at(0);
  const auto count = static_cast<double>(spans.size());
  const double steady = whole * 2.0 * kBesideMm / (kEveryMm * count + 2.0 * kBesideMm);
  WayDoubt most;
  double greatest = kLeastStep;
  for (const Span& span : spans) {
    const double before = level_at(span.before), after = level_at(span.after);
    const double contrast = 0.5 * (before + after) - field.surroundings;
    const double step = std::abs(after - before - steady) / contrast;
    if (step < greatest) continue;
    greatest = step;
    most = {.place = center_of(field.grid, way[span.at].voxel),
            .before_hu = before,
            .after_hu = after,
            .by_level = true};
  }
  return most.by_level ? std::optional(most) : std::nullopt;
}

/// The narrowest neck along a way, against what lies before and behind it.
std::optional<WayDoubt> width_doubt(const LumenField& field, const std::vector<float>& depth,
                                    const std::vector<WayLevel>& way,
                                    const std::vector<Span>& spans) {
  const double wide = kWideVoxels * std::cbrt(field.grid.spacing.prod());
  WayDoubt most;
  double least = kNeck;
  for (const Span& span : spans) {
    const std::size_t from = middle_of(field.grid, depth, way[span.before].voxel);
    const std::size_t to = middle_of(field.grid, depth, way[span.after].voxel);
    const auto beside = static_cast<double>(std::min(depth[from], depth[to]));
    if (beside < wide) continue;
    const Vec3 at = center_of(field.grid, way[span.at].voxel);
    const std::optional<std::size_t> neck = neck_between(field.grid, depth, from, to, at);
    if (!neck || static_cast<double>(depth[*neck]) > least * beside) continue;
    least = static_cast<double>(depth[*neck]) / beside;
    most = {.place = center_of(field.grid, *neck),
            .before_hu = static_cast<double>(way[span.before].level),
            .after_hu = static_cast<double>(way[span.after].level),
            .neck_mm = static_cast<double>(depth[*neck]),
            .beside_mm = beside,
            .by_width = true};
  }
  return most.by_width ? std::optional(most) : std::nullopt;
}

}  // namespace

std::vector<WayDoubt> find_way_doubts(const LumenField& field, const std::vector<float>& depth,
                                      const std::vector<std::vector<WayLevel>>& ways) {
  std::vector<WayDoubt> doubts;
  const auto add = [&](const std::optional<WayDoubt>& doubt) {
    const bool told = doubt && std::any_of(doubts.begin(), doubts.end(), [&](const WayDoubt& one) {
                        return one.by_level == doubt->by_level &&
                               (one.place - doubt->place).norm() < kSamePlaceMm;
                      });
    if (doubt && !told) doubts.push_back(*doubt);
  };
  for (const std::vector<WayLevel>& way : ways) {
    const std::vector<Span> spans = spans_of(field.grid, way);
    if (field.hounsfield) add(level_doubt(field, way, spans));
    add(width_doubt(field, depth, way, spans));
  }
  return doubts;
}

}  // namespace wireplan::preprocess
