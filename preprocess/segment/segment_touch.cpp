#include "preprocess/segment/segment_touch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include "preprocess/segment/segment_leak.h"
#include "preprocess/segment/segment_loops.h"

namespace wireplan::preprocess {
namespace {

constexpr double kRoundMm = 20.0, kRoundRadii = 5.0;  // by which a way round is longer
constexpr double kDip = 0.8;        // of both sides' level above the edge: what dips has less
constexpr double kNarrow = 0.75;    // of both sides' radius
constexpr double kKeptMm = 2.0;     // a given point so near says that it is open
constexpr double kLongestMm = 2.5;  // of a touch: between what is undimmed on both sides
constexpr int kMostTouches = 20;    // on one way

// ---- sheets -------------------------------------------------------------------------------------

/// What is left out of the mask so that it has no loops: by voxel the number of its sheet, from 1.
struct Sheets {
  std::vector<std::uint32_t> of;
  std::vector<std::vector<std::size_t>> voxels;  // of sheet 1, 2, ...
};

/// Whether a mask of one piece without cavities has a loop, contacts of corners and edges included:
/// by the Euler number of the voxels as closed cubes, corners - edges + faces - cubes.
bool has_loops(const Grid& grid, const Labels& labels) {
  std::ptrdiff_t euler = 0;
  for (int k = 0; k <= grid.size[2]; ++k) {
    for (int j = 0; j <= grid.size[1]; ++j) {
      for (int i = 0; i <= grid.size[0]; ++i) {
        std::array<int, 8> round{};  // the voxels that meet in this corner: bit 0 is beyond it in i
        for (int bit = 0; bit < 8; ++bit) {
          const Voxel v = {i - 1 + (bit & 1), j - 1 + (bit >> 1 & 1), k - 1 + (bit >> 2)};
          const bool exists = std::min({v[0], v[1], v[2]}) >= 0 && v[0] < grid.size[0] &&
                              v[1] < grid.size[1] && v[2] < grid.size[2];
          round[static_cast<std::size_t>(bit)] = exists ? labels[index_of(grid, v)] : 0;
        }
        euler +=
            round[0] | round[1] | round[2] | round[3] | round[4] | round[5] | round[6] | round[7];
        euler -= (round[1] | round[3] | round[5] | round[7]) +
                 (round[2] | round[3] | round[6] | round[7]) +
                 (round[4] | round[5] | round[6] | round[7]);
        euler += (round[3] | round[7]) + (round[5] | round[7]) + (round[6] | round[7]);
        euler -= round[7];
      }
    }
  }
  return euler != 1;
}

/// Fills the mask from the start, voxels of high value first, and takes none that closes a loop.
Labels fill_without_loops(const Grid& grid, const std::vector<float>& values, const Labels& labels,
                          std::size_t start) {
  const auto later = [](const Ordered& a, const Ordered& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  };
  return grow_simple(grid, values, labels, start, later, is_simple_by_corners);
}

Sheets find_sheets(const Grid& grid, const Labels& labels, const Labels& filled) {
  Sheets sheets{.of = std::vector<std::uint32_t>(labels.size(), 0), .voxels = {}};
  Labels left(labels.size(), 0), seen(labels.size(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n) left[n] = filled[n] == 0 ? labels[n] : 0;
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (left[n] == 0 || seen[n] != 0) continue;
    sheets.voxels.push_back(collect_part(grid, n, left, seen));
    for (const std::size_t m : sheets.voxels.back()) {
      sheets.of[m] = static_cast<std::uint32_t>(sheets.voxels.size());
    }
  }
  return sheets;
}

// ---- ways ---------------------------------------------------------------------------------------

/// The shortest passable way through the mask without the blocked voxels; empty where none is.
std::vector<std::size_t> find_way(const Grid& grid, const std::vector<float>& depth,
                                  const Labels& blocked, std::size_t from, std::size_t to) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::vector<double> cost(depth.size(), kFar);
  std::vector<std::uint32_t> before(depth.size());
  cost[from] = 0.0;
  queue.push({0.0, from});
  while (!queue.empty() && queue.top().second != to) {
    const double reached_at = queue.top().first;
    const std::size_t n = queue.top().second;
    queue.pop();
    if (reached_at > cost[n]) continue;
    const Vec3 here = center_of(grid, n);
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) {
      if (depth[m] <= 0.0F || blocked[m] != 0) return;
      const double r = 0.5 * (static_cast<double>(depth[n]) + static_cast<double>(depth[m]));
      const double next = reached_at + (center_of(grid, m) - here).norm() * (1.0 + 1.0 / (r * r));
      if (next >= cost[m]) return;
      cost[m] = next;
      before[m] = static_cast<std::uint32_t>(n);
      queue.push({next, m});
    });
  }
  std::vector<std::size_t> way;
  if (cost[to] == kFar) return way;
  for (std::size_t n = to; n != from; n = before[n]) way.push_back(n);
  way.push_back(from);
  std::reverse(way.begin(), way.end());
  return way;
}

double length_of_way(const Grid& grid, const std::vector<std::size_t>& way) {
  std::vector<Vec3> points;
  for (const std::size_t n : way) points.push_back(center_of(grid, n));
  return length_of_line(smooth_line(std::move(points)));
}

// ---- what a sheet is ----------------------------------------------------------------------------

/// The parts of `filled` within a radius of the place, connected there, that the sheet touches.
std::vector<std::vector<std::size_t>> find_sides(const Grid& grid, const Labels& filled,
                                                 const std::vector<std::size_t>& sheet,
                                                 const Vec3& place, double radius) {
  const Labels near = [&] {
    Labels marked(filled.size(), 0);
    for (const std::size_t n : voxels_in_ball(grid, place, radius)) marked[n] = filled[n];
    return marked;
  }();
  Labels seen(filled.size(), 0);
  std::vector<std::vector<std::size_t>> sides;
  for (const std::size_t n : sheet) {
    for_each_neighbour(grid, n, [&](std::size_t start, const Voxel&) {
      if (near[start] == 0 || seen[start] != 0) return;
      sides.push_back(collect_part(grid, start, near, seen));
    });
  }
  return sides;
}

/// Whether the part goes on in two directions or more: so many parts of it lie at the ball's
/// surface.
bool passes_by(const Grid& grid, const std::vector<std::size_t>& side, const Vec3& place,
               double inner) {
  Labels outer(grid.voxels(), 0), seen(grid.voxels(), 0);
  for (const std::size_t n : side) {
    outer[n] = (center_of(grid, n) - place).norm() > inner ? 1 : 0;
  }
  int exits = 0;
  for (const std::size_t n : side) {
    if (outer[n] == 0 || seen[n] != 0) continue;
    collect_part(grid, n, outer, seen);
    ++exits;
  }
  return exits > 1;
}

/// A search for touches by values, which cuts, or by radii, which does not.
struct TouchSearch {
  const Grid& grid;
  const std::vector<float>& values;
  const std::vector<Vec3>& kept;
  double most_part = 0.0;  // a touch has less than this part of the sides' level above the edge
  double edge = 0.0;
  double part_below = 0.0;  // a side's level: this part of its voxels has less
  bool cut = false;
};

/// So much of the voxels' values is less, by number.
double level_of_part(const std::vector<float>& values, const std::vector<std::size_t>& voxels,
                     double part_below) {
  std::vector<float> levels;
  for (const std::size_t n : voxels) levels.push_back(values[n]);
  const auto at = levels.begin() +
                  static_cast<std::ptrdiff_t>(part_below * static_cast<double>(levels.size() - 1));
  std::nth_element(levels.begin(), at, levels.end());
  return static_cast<double>(*at);
}

/// Whether the parts on both sides come near each other undimmed: a bridge that is dark for longer
/// is a vessel, thin or narrowed.
bool come_near(const TouchSearch& search, const Labels& filled,
               const std::vector<std::size_t>& sheet, const Touch& touch) {
  const Grid& grid = search.grid;
  const double most = std::max(kLongestMm, 3.0 * grid.spacing.maxCoeff());
  const double bright = search.edge + search.most_part * (touch.side - search.edge);
  std::vector<std::vector<Vec3>> parts;
  for (const auto& side : find_sides(grid, filled, sheet, touch.place, 2.0 * most)) {
    parts.emplace_back();
    for (const std::size_t n : side) {
      if (static_cast<double>(search.values[n]) >= bright)
        parts.back().push_back(center_of(grid, n));
    }
  }
  for (std::size_t a = 0; a < parts.size(); ++a) {
    for (std::size_t b = a + 1; b < parts.size(); ++b) {
      for (const Vec3& p : parts[a]) {
        for (const Vec3& q : parts[b]) {
          if ((p - q).norm() <= most) return true;
        }
      }
    }
  }
  return false;
}

/// The inscribed radius of the vessel beside a place at its wall: the largest in a ball that grows
/// with what it finds.
double radius_beside(const Grid& grid, const std::vector<float>& depth, const Vec3& place) {
  constexpr int kRounds = 4;
  const double reach = 3.0 + 2.0 * grid.spacing.maxCoeff();
  double radius = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    double most = radius;
    for (const std::size_t n : voxels_in_ball(grid, place, radius + reach)) {
      most = std::max(most, static_cast<double>(depth[n]));
    }
    if (!(most > radius) || !std::isfinite(most)) break;
    radius = most;
  }
  return radius;
}

/// The sheet as a touch of the way, if it is one.
std::optional<Touch> look_at_sheet(const TouchSearch& search, const std::vector<float>& depth,
                                   const Labels& filled, const std::vector<std::size_t>& sheet,
                                   Labels& blocked, const std::vector<std::size_t>& way) {
  const Grid& grid = search.grid;
  const std::size_t most = *std::max_element(sheet.begin(), sheet.end(), [&](auto a, auto b) {
    return search.values[a] < search.values[b];
  });
  Vec3 sum = Vec3::Zero();
  for (const std::size_t n : sheet) sum += center_of(grid, n);
  Touch touch{.place = sum / static_cast<double>(sheet.size()),
              .level = static_cast<double>(search.values[most])};
  for (const Vec3& point : search.kept) {
    for (const std::size_t n : sheet) {
      if ((center_of(grid, n) - point).norm() <= kKeptMm) return {};
    }
  }
  const double radius = radius_beside(grid, depth, touch.place), voxel = grid.spacing.maxCoeff(),
               inner = 3.0 * radius + 2.0 * voxel;

  // Both sides are more than the sheet; round a hole in the vessel they are one.
  std::vector<double> levels;
  for (const auto& side :
       find_sides(grid, filled, sheet, touch.place, 2.5 * radius + 3.0 * voxel)) {
    levels.push_back(level_of_part(search.values, side, search.part_below));
  }
  if (levels.size() < 2) return {};
  std::sort(levels.begin(), levels.end(), std::greater<>());
  touch.side = levels[1];
  if (touch.level - search.edge >= search.most_part * (touch.side - search.edge)) return {};

  // They are far apart along the vessel.
  for (const std::size_t n : sheet) blocked[n] = 1;
  const std::vector<std::size_t> round = find_way(grid, depth, blocked, way.front(), way.back());
  for (const std::size_t n : sheet) blocked[n] = 0;
  if (round.empty()) return {};
  touch.through_mm = length_of_way(grid, way);
  touch.round_mm = length_of_way(grid, round);
  if (touch.round_mm < touch.through_mm + kRoundMm + kRoundRadii * radius) return {};

  // What is cut is short, and both sides pass each other.
  if (!search.cut) return touch;
  if (!come_near(search, filled, sheet, touch)) return {};
  int passing = 0;
  for (const auto& side : find_sides(grid, filled, sheet, touch.place, inner + 2.0 * voxel)) {
    passing += passes_by(grid, side, touch.place, inner) ? 1 : 0;
  }
  return passing < 2 ? std::nullopt : std::optional<Touch>(touch);
}

std::vector<Touch> search_touches(const TouchSearch& search, const std::vector<std::size_t>& ends,
                                  Labels& labels) {
  const Grid& grid = search.grid;
  const Labels piece = flood(grid, {ends.front()}, [&](std::size_t n) { return labels[n] != 0; });
  if (!has_loops(grid, piece)) return {};
  const std::vector<float> depth = measure_depth(grid, piece);
  const Labels filled = fill_without_loops(grid, search.values, piece, ends.front());
  const Sheets sheets = find_sheets(grid, piece, filled);
  std::vector<Touch> touches;
  if (sheets.voxels.empty()) return touches;

  Labels blocked(labels.size(), 0);
  std::vector<bool> looked_at(sheets.voxels.size() + 1, false);
  for (std::size_t e = 1; e < ends.size(); ++e) {
    bool again = true;
    const std::size_t most = touches.size() + kMostTouches;
    while (again && touches.size() < most) {
      again = false;
      const std::vector<std::size_t> way = find_way(grid, depth, blocked, ends.front(), ends[e]);
      for (const std::size_t n : way) {
        const std::uint32_t number = sheets.of[n];
        if (number == 0 || looked_at[number] || touches.size() >= most) continue;
        looked_at[number] = true;
        const std::vector<std::size_t>& sheet = sheets.voxels[number - 1];
        std::optional<Touch> touch = look_at_sheet(search, depth, filled, sheet, blocked, way);
        if (!touch) continue;
        touch->cut = search.cut;
        touches.push_back(*touch);
        if (!search.cut) continue;
        for (const std::size_t m : sheet) blocked[m] = 1;
        again = true;  // the way is another one now
        break;
      }
    }
  }
  if (!search.cut || touches.empty()) return touches;

  // What was connected with the access stays so, or nothing is cut.
  const auto inside = [&](std::size_t n) { return labels[n] != 0; };
  const Labels before = flood(grid, {ends.front()}, inside);
  const Labels after =
      flood(grid, {ends.front()}, [&](std::size_t n) { return inside(n) && blocked[n] == 0; });
  if (std::any_of(ends.begin(), ends.end(), [&](auto n) { return before[n] != after[n]; })) {
    for (Touch& touch : touches) touch.cut = false;
    return touches;
  }
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (before[n] != after[n]) labels[n] = 0;  // the sheets, and crumbs beside them
  }
  return touches;
}

}  // namespace

std::vector<Touch> cut_touches(const Grid& grid, const std::vector<float>& values, double edge,
                               const std::vector<std::size_t>& ends, const std::vector<Vec3>& kept,
                               Labels& labels) {
  expects(!ends.empty() && values.size() == labels.size());
  return search_touches({grid, values, kept, kDip, edge, 0.75, /*cut=*/true}, ends, labels);
}

std::vector<Touch> find_touches(const Grid& grid, const Labels& labels,
                                const std::vector<std::size_t>& ends,
                                const std::vector<Vec3>& kept) {
  expects(!ends.empty());
  const std::vector<float> depth = measure_depth(grid, labels);
  Labels same = labels;
  return search_touches({grid, depth, kept, kNarrow, 0.0, 1.0, /*cut=*/false}, ends, same);
}

}  // namespace wireplan::preprocess
