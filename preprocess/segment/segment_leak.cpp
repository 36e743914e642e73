#include "preprocess/segment/segment_leak.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <queue>
#include <utility>

namespace wireplan::preprocess {
namespace {

constexpr double kGrowth = 2.0, kGrowthMm = 1.0;  // beyond which a wider part is no branch
constexpr double kLeastLeakMm3 = 50.0;            // smaller ones are cut, but not told

/// Which voxels a search works on: those of the mask, with their depth below its surface [mm].
struct Inside {
  const Grid& grid;
  std::vector<float> depth;  // 0 outside
};

Inside measure_inside(const Grid& grid, const Labels& labels) {
  return {.grid = grid, .depth = measure_depth(grid, labels)};
}

/// Calls visit(neighbour, step [mm]) for the up to 26 voxels round voxel n that lie inside.
template <typename Visit>
void for_each_inside(const Inside& inside, std::size_t n, Visit visit) {
  for_each_neighbour(inside.grid, n, [&](std::size_t m, const Voxel& step) {
    if (inside.depth[m] <= 0.0F) return;
    visit(m, inside.grid.spacing.cwiseProduct(Vec3(step[0], step[1], step[2])).norm());
  });
}

/// From a voxel uphill to where the depth has a maximum: a seed may lie near the wall.
std::size_t climb(const Inside& inside, std::size_t n) {
  for (;;) {
    std::size_t best = n;
    for_each_inside(inside, n, [&](std::size_t m, double) {
      if (inside.depth[m] > inside.depth[best]) {
        best = m;
      }
    });
    if (best == n) {
      return n;
    }
    n = best;
  }
}

/// Voxels on the ways from the first seed to the others, each as short and as far from the wall as
/// it can be (cost 1 / depth^2 per length). Every seed's own middle is among them.
std::vector<std::size_t> find_ways(const Inside& inside, const std::vector<std::size_t>& seeds,
                                   Route& route) {
  std::vector<std::size_t> ends;
  for (const std::size_t seed : seeds) {
    ends.push_back(climb(inside, seed));
  }
  constexpr float kFar = std::numeric_limits<float>::infinity();
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::vector<float> cost(inside.depth.size(), kFar);
  std::vector<std::uint32_t> before(inside.depth.size());
  cost[ends.front()] = 0.0F;
  queue.push({0.0F, ends.front()});
  std::ptrdiff_t missing = std::ssize(ends);
  while (!queue.empty()) {
    const float reached_at = queue.top().first;
    const std::size_t n = queue.top().second;
    queue.pop();
    if (reached_at > cost[n]) {
      continue;
    }
    missing -= std::count(ends.begin(), ends.end(), n);
    if (missing == 0) break;
    for_each_inside(inside, n, [&](std::size_t m, double step) {
      const double depth = 0.5 * (static_cast<double>(inside.depth[n]) + inside.depth[m]);
      const auto next =
          static_cast<float>(static_cast<double>(reached_at) + step / (depth * depth));
      if (next < cost[m]) {
        cost[m] = next;
        before[m] = static_cast<std::uint32_t>(n);
        queue.push({next, m});
      }
    });
  }

  std::vector<std::size_t> ways;
  std::size_t narrowest = ends.front();
  for (const std::size_t end : ends) {
    ways.push_back(end);
    if (cost[end] == kFar) {
      continue;
    }
    std::vector<Vec3> points = {center_of(inside.grid, end)};
    for (std::size_t n = end; n != ends.front(); n = before[n]) {
      points.push_back(center_of(inside.grid, before[n]));
      ways.push_back(before[n]);
      narrowest = inside.depth[n] < inside.depth[narrowest] ? n : narrowest;
    }
    std::reverse(points.begin(), points.end());
    route.points = smooth_line(std::move(points));
    route.length_mm = length_of_line(route.points);
  }
  route.narrowest_radius_mm = static_cast<double>(inside.depth[narrowest]);
  route.narrowest = center_of(inside.grid, narrowest);
  return ways;
}

/// Visits what `starts` reach in the order of the widest way: visit(voxel, from, width), the width
/// [mm] being the least depth on it. Among equals the lower index comes first.
template <typename Visit>
void flood_by_width(const Inside& inside, const std::vector<std::size_t>& starts, Visit visit) {
  using Entry = std::pair<float, std::size_t>;
  const auto narrower = [](const Entry& a, const Entry& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  };
  std::priority_queue<Entry, std::vector<Entry>, decltype(narrower)> queue(narrower);
  Labels seen(inside.depth.size(), 0);
  const auto reach = [&](std::size_t n, std::size_t from, float width) {
    if (seen[n] == 0) {
      seen[n] = 1;
      const float own = std::min(width, inside.depth[n]);
      visit(n, from, own);
      queue.push({own, n});
    }
  };
  for (const std::size_t start : starts) {
    reach(start, start, std::numeric_limits<float>::infinity());
  }
  while (!queue.empty()) {
    const float width = queue.top().first;
    const std::size_t n = queue.top().second;
    queue.pop();
    for_each_inside(inside, n, [&](std::size_t m, double) { reach(m, n, width); });
  }
}

/// Numbers the pieces of the voxels for which wide(n) holds: 0 elsewhere, then 1, 2, ...
template <typename Wide>
std::vector<std::uint32_t> number_pieces(const Inside& inside, Wide wide, std::uint32_t& pieces) {
  std::vector<std::uint32_t> piece(inside.depth.size(), 0);
  pieces = 0;
  for (std::size_t n = 0; n < piece.size(); ++n) {
    if (piece[n] != 0 || !wide(n)) {
      continue;
    }
    piece[n] = ++pieces;
    std::vector<std::size_t> queue = {n};
    for (std::size_t next = 0; next < queue.size(); ++next) {
      for_each_inside(inside, queue[next], [&](std::size_t m, double) {
        if (piece[m] == 0 && wide(m)) {
          piece[m] = pieces;
          queue.push_back(m);
        }
      });
    }
  }
  return piece;
}

/// True where the voxel behind the face from n to m, or the next one (the first may be half of
/// either), is brighter than `upper`.
bool bright_behind(const Grid& grid, const std::vector<float>& values, double upper, std::size_t n,
                   std::size_t m) {
  const Voxel v = voxel_at(grid, n), w = voxel_at(grid, m);
  Voxel next;
  bool exists = true;
  for (int axis = 0; axis < 3; ++axis) {
    next[axis] = 2 * w[axis] - v[axis];
    exists = exists && next[axis] >= 0 && next[axis] < grid.size[axis];
  }
  return static_cast<double>(values[m]) > upper ||
         (exists && static_cast<double>(values[index_of(grid, next)]) > upper);
}

/// Figures of each piece, which is what has its number in `owner`.
std::vector<Leak> describe(const Inside& inside, const std::vector<float>& values, double upper,
                           const std::vector<std::uint32_t>& owner, std::uint32_t pieces) {
  std::vector<Leak> leaks(pieces);
  std::vector<double> voxels(pieces, 0.0), boundary(pieces, 0.0), bright(pieces, 0.0);
  const double voxel_mm3 = inside.grid.spacing.prod();
  for (std::size_t n = 0; n < owner.size(); ++n) {
    if (owner[n] == 0) {
      continue;
    }
    const std::size_t p = owner[n] - 1;
    Leak& leak = leaks[p];
    voxels[p] += 1.0;
    leak.volume_mm3 += voxel_mm3;
    leak.mean_hu += static_cast<double>(values[n]);
    leak.radius_mm = std::max(leak.radius_mm, static_cast<double>(inside.depth[n]));
    for_each_face_neighbour(inside.grid, n, [&](std::size_t m) {
      if (owner[m] == owner[n]) {
        return;
      }
      // the neighbour of the trusted vessel: the widest such contact is the neck
      if (owner[m] == 0 && inside.depth[m] > 0.0F) {
        const double width = static_cast<double>(std::min(inside.depth[n], inside.depth[m]));
        if (width > leak.neck_radius_mm) {
          leak.neck_radius_mm = width;
          leak.place = center_of(inside.grid, n);
        }
      } else if (inside.depth[m] == 0.0F) {
        boundary[p] += 1.0;
        bright[p] += bright_behind(inside.grid, values, upper, n, m) ? 1.0 : 0.0;
      }
    });
  }
  for (std::size_t p = 0; p < leaks.size(); ++p) {
    leaks[p].mean_hu /= std::max(1.0, voxels[p]);
    leaks[p].bright_fraction = bright[p] / std::max(1.0, boundary[p]);
  }
  return leaks;
}

}  // namespace

std::vector<float> measure_depth(const Grid& grid, const Labels& labels) {
  std::vector<float> depth = distance_to(0, grid, labels);
  const auto half = static_cast<float>(0.5 * grid.spacing.minCoeff());
  for (float& d : depth) d = d > 0.0F ? d - half : 0.0F;  // from the face between two voxels
  return depth;
}

std::vector<Vec3> smooth_line(std::vector<Vec3> points) {
  constexpr std::size_t kReach = 3;
  for (int round = 0; round < 3; ++round) {
    const std::vector<Vec3> before = points;
    for (std::size_t n = 1; n + 1 < points.size(); ++n) {
      const std::size_t reach = std::min({kReach, n, points.size() - 1 - n});
      Vec3 sum = Vec3::Zero();
      for (std::size_t m = n - reach; m <= n + reach; ++m) {
        sum += before[m];
      }
      points[n] = sum / static_cast<double>(2 * reach + 1);
    }
  }
  return points;
}

double length_of_line(const std::vector<Vec3>& points) {
  double length = 0.0;
  for (std::size_t n = 1; n < points.size(); ++n) {
    length += (points[n] - points[n - 1]).norm();
  }
  return length;
}

Route find_route(const Grid& grid, const std::vector<std::size_t>& seeds, const Labels& labels) {
  expects(!seeds.empty());
  Route route;
  find_ways(measure_inside(grid, labels), seeds, route);
  return route;
}

LeakSearch cut_leaks(const Grid& grid, const std::vector<float>& values, double upper,
                     const std::vector<std::size_t>& seeds, Labels& labels,
                     const KnownParts* known) {
  expects(!seeds.empty() && values.size() == labels.size());
  LeakSearch search;
  const Inside inside = measure_inside(grid, labels);
  const std::vector<std::size_t> ways =
      known != nullptr ? known->ways : find_ways(inside, seeds, search.route);

  // what is much wider than the way to it
  std::vector<float> width(labels.size(), 0.0F);
  flood_by_width(inside, ways, [&](std::size_t n, std::size_t, float w) { width[n] = w; });
  std::uint32_t pieces = 0;
  std::vector<std::uint32_t> owner = number_pieces(
      inside,
      [&](std::size_t n) {
        return inside.depth[n] > 0.0F && ((known != nullptr && known->other[n] != 0) ||
                                          inside.depth[n] > static_cast<float>(kGrowth) * width[n] +
                                                                static_cast<float>(kGrowthMm));
      },
      pieces);
  if (pieces == 0) {
    return search;
  }

  // both sides from wide to narrow, until they meet in the neck
  std::vector<std::size_t> starts = ways;
  for (std::size_t n = 0; n < owner.size(); ++n) {
    if (owner[n] != 0 || (known != nullptr && known->own[n] != 0)) {
      starts.push_back(n);
    }
  }
  flood_by_width(inside, starts, [&](std::size_t n, std::size_t from, float) {
    owner[n] = n == from ? owner[n] : owner[from];
  });

  // what touches is one leak: a vein and the organ that it drains
  owner = number_pieces(
      inside, [&](std::size_t n) { return owner[n] != 0; }, pieces);
  search.leaks = describe(inside, values, upper, owner, pieces);
  for (std::size_t n = 0; n < labels.size(); ++n) {
    labels[n] = owner[n] == 0 ? labels[n] : std::uint8_t{0};
  }
  std::erase_if(search.leaks, [](const Leak& leak) { return leak.volume_mm3 < kLeastLeakMm3; });
  std::stable_sort(search.leaks.begin(), search.leaks.end(),
                   [](const Leak& a, const Leak& b) { return a.volume_mm3 > b.volume_mm3; });
  return search;
}

double bright_boundary(const Grid& grid, const std::vector<float>& values, double upper,
                       const Labels& labels) {
  double faces = 0.0, bright = 0.0;
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] == 0) {
      continue;
    }
    for_each_face_neighbour(grid, n, [&](std::size_t m) {
      if (labels[m] == 0) {
        faces += 1.0;
        bright += bright_behind(grid, values, upper, n, m) ? 1.0 : 0.0;
      }
    });
  }
  return bright / std::max(1.0, faces);
}

}  // namespace wireplan::preprocess
