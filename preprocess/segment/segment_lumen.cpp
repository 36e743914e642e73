#include "preprocess/segment/segment_lumen.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "preprocess/segment/side_branches.h"
#include "preprocess/segment/vessel_parts.h"

namespace wireplan::preprocess {
namespace {

constexpr double kEdgePart = 0.4;   // of the contrast
constexpr double kNearWayMm = 3.0;  // where less of it is enough
constexpr double kSpeckMm3 = 15.0;
constexpr float kMiddlePart = 0.6F;  // of a part's depth: what is deeper is surely its own
constexpr double kDoubtfulMm3 = 500.0;

/// At each candidate the level of the way that it is nearest to; 0 elsewhere.
std::vector<float> nearest_levels(const LumenField& field, const Candidates& candidates,
                                  const std::vector<std::vector<WayLevel>>& ways) {
  std::vector<float> level(candidates.labels.size(), 0.0F);
  std::vector<std::size_t> queue;
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      if (level[place.voxel] == 0.0F) queue.push_back(place.voxel);
      level[place.voxel] = place.level;
    }
  }
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for_each_face_neighbour(field.grid, queue[next], [&](std::size_t m) {
      if (candidates.labels[m] == 0 || level[m] != 0.0F) return;
      level[m] = level[queue[next]];
      queue.push_back(m);
    });
  }
  return level;
}

/// Step 1.
Labels find_core(const LumenField& field, const Candidates& candidates,
                 const std::vector<std::vector<WayLevel>>& ways, std::vector<float>& level) {
  const Grid& grid = field.grid;
  const auto part_of = [&](std::size_t n) {
    return (static_cast<double>(field.values[n]) - field.surroundings) /
           (static_cast<double>(level[n]) - field.surroundings);
  };
  Labels core(candidates.labels.size(), 0);
  for (std::size_t n = 0; n < core.size(); ++n) {
    core[n] = level[n] != 0.0F && part_of(n) >= field.core_part ? 1 : 0;
  }
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      core[place.voxel] = 1;
      const double enough = std::min(field.core_part, part_of(place.voxel) - 0.1);
      const double reach =
          static_cast<double>(candidates.depth[place.voxel]) + grid.spacing.minCoeff();
      for (const std::size_t n :
           voxels_in_ball(grid, center_of(grid, place.voxel), std::min(kNearWayMm, reach))) {
        if (level[n] != 0.0F && part_of(n) >= enough) core[n] = 1;
      }
    }
  }
  // Specks of noise would count as wall; larger holes (the inside of a bone's shell) stay open.
  fill_cavities(grid, core, std::max(1.0, kSpeckMm3 / grid.spacing.prod()));
  for (std::size_t n = 0; n < core.size(); ++n) {
    if (core[n] == 0 || level[n] != 0.0F) continue;
    for_each_neighbour(
        grid, n, [&](std::size_t m, const Voxel&) { level[n] = std::max(level[n], level[m]); });
  }
  return core;
}

/// The least of the values one and two voxels on from `n`, in the direction in which `away` grows.
double value_beyond(const LumenField& field, const std::vector<float>& away, std::size_t n) {
  const Grid& grid = field.grid;
  const Voxel v = voxel_at(grid, n);
  Vec3 on = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    Voxel low = v, high = v;
    low[axis] = std::max(v[axis] - 1, 0);
    high[axis] = std::min(v[axis] + 1, grid.size[axis] - 1);
    on[axis] = static_cast<double>(away[index_of(grid, high)] - away[index_of(grid, low)]) /
               grid.spacing[axis];
  }
  auto least = static_cast<double>(field.values[n]);
  if (on.norm() == 0.0) return least;
  const double voxel = std::cbrt(grid.spacing.prod());
  for (const double steps : {1.0, 2.0}) {
    Voxel next = v;
    for (int axis = 0; axis < 3; ++axis) {
      const double by = steps * voxel * on[axis] / on.norm() / grid.spacing[axis];
      next[axis] = std::clamp(v[axis] + static_cast<int>(std::lround(by)), 0, grid.size[axis] - 1);
    }
    least = std::min(least, static_cast<double>(field.values[index_of(grid, next)]));
  }
  return least;
}

/// The least value that an artery of this level has at its edge, where `beyond` lies behind it:
/// kEdgePart of the contrast, less before fat. `darkest`: as darkest_beside() [HU].
double least_at_edge(const LumenField& field, double level, double beyond, double darkest) {
  constexpr double kHalf = 0.5;
  const double usual = field.surroundings + kEdgePart * (level - field.surroundings);
  if (darkest >= field.surroundings) return usual;
  const double dark = std::clamp(beyond, darkest, field.surroundings);
  const double fat = (field.surroundings - dark) / (field.surroundings - darkest);
  const double part = kEdgePart + fat * (kHalf - kEdgePart);
  return std::min(usual, dark + part * (level - dark));
}

/// Step 3.
void add_rim(const LumenField& field, std::vector<float>& level, Labels& artery, Labels& other) {
  constexpr int kLayers = 2;
  constexpr double kByLevel = 2.0;  // voxels that a difference by the whole contrast counts for
  const Grid& grid = field.grid;
  const double voxel = std::cbrt(grid.spacing.prod()), darkest = darkest_beside(field);
  const std::vector<float> to_artery = distance_to(1, grid, artery);
  const std::vector<float> to_other = distance_to(1, grid, other);
  const auto contrast_of = [&](float of) { return static_cast<double>(of) - field.surroundings; };
  struct Added {
    std::size_t voxel;
    float level;
    bool mine;
  };
  for (int layer = 0; layer < kLayers; ++layer) {
    std::vector<Added> added;
    for (std::size_t n = 0; n < artery.size(); ++n) {
      const auto value = static_cast<double>(field.values[n]);
      if (artery[n] != 0 || other[n] != 0 || value > field.upper) continue;
      float mine = 0.0F, others = 0.0F;  // levels of what it touches
      for_each_face_neighbour(grid, n, [&](std::size_t m) {
        if (artery[m] != 0) mine = std::max(mine, level[m]);
        if (other[m] != 0) others = std::max(others, level[m]);
      });
      if (mine == 0.0F && others == 0.0F) continue;
      const auto reaches = [&](float of, const std::vector<float>& distance) {
        const auto level_of = static_cast<double>(of);
        if (of == 0.0F || value < least_at_edge(field, level_of, darkest, darkest)) return false;
        const double beyond = value_beyond(field, distance, n);
        return value >= least_at_edge(field, level_of, beyond, darkest) &&
               (beyond >= level_of || value >= beyond + kEdgePart * (level_of - beyond));
      };
      const auto away = [&](float distance, float of) {
        return static_cast<double>(distance) / voxel +
               kByLevel * std::abs(value - static_cast<double>(of)) / contrast_of(of);
      };
      const bool is_mine = reaches(mine, to_artery), is_other = reaches(others, to_other);
      if (!is_mine && !is_other) continue;
      const bool nearer =
          is_mine && (!is_other || away(to_artery[n], mine) <= away(to_other[n], others));
      added.push_back({n, nearer ? mine : others, nearer});
    }
    for (const Added& add : added) {
      (add.mine ? artery : other)[add.voxel] = 1;
      level[add.voxel] = add.level;
    }
  }
}

/// The balls that fit in round the ways' voxels, as far as they lie in the same part: where a wide
/// vein touches as widely as the artery is wide, a flood from there would leave the bare way.
std::vector<std::size_t> vessel_round(const Grid& grid, const VesselParts& parts,
                                      const std::vector<float>& depth,
                                      const std::vector<std::vector<WayLevel>>& ways) {
  std::vector<std::size_t> round;
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      const auto radius = static_cast<double>(depth[place.voxel]);
      for (const std::size_t n : voxels_in_ball(grid, center_of(grid, place.voxel), radius)) {
        if (parts.of[n] != 0 && parts.of[n] == parts.of[place.voxel]) round.push_back(n);
      }
    }
  }
  return round;
}

/// Pieces of doubtful parts that were kept, the largest first.
std::vector<Leak> find_doubtful(const LumenField& field, const VesselParts& parts,
                                const std::vector<float>& depth, const Labels& artery) {
  std::vector<Leak> doubtful;
  Labels marked(artery.size(), 0), seen(artery.size(), 0);
  for (std::size_t n = 0; n < artery.size(); ++n) {
    marked[n] = artery[n] != 0 && parts.parts[parts.of[n]].doubtful ? 1 : 0;
  }
  for (std::size_t n = 0; n < artery.size(); ++n) {
    if (marked[n] == 0 || seen[n] != 0) continue;
    Leak leak;
    std::vector<std::size_t> queue = {n};
    seen[n] = 1;
    for (std::size_t next = 0; next < queue.size(); ++next) {
      const std::size_t m = queue[next];
      leak.mean_hu += static_cast<double>(field.raw[m]);
      if (static_cast<double>(depth[m]) > leak.radius_mm) {
        leak.radius_mm = static_cast<double>(depth[m]);
        leak.place = center_of(field.grid, m);
      }
      for_each_face_neighbour(field.grid, m, [&](std::size_t beside) {
        if (marked[beside] == 0 || seen[beside] != 0) return;
        seen[beside] = 1;
        queue.push_back(beside);
      });
    }
    leak.mean_hu /= static_cast<double>(queue.size());
    leak.volume_mm3 = static_cast<double>(queue.size()) * field.grid.spacing.prod();
    if (leak.volume_mm3 >= kDoubtfulMm3) doubtful.push_back(leak);
  }
  std::stable_sort(doubtful.begin(), doubtful.end(),
                   [](const Leak& a, const Leak& b) { return a.volume_mm3 > b.volume_mm3; });
  return doubtful;
}

/// Whether most of what was cut came back as a branch.
bool is_branch(const Leak& leak, const std::vector<Leak>& branches) {
  constexpr double kMost = 0.5, kBesideMm = 3.0;
  return std::any_of(branches.begin(), branches.end(), [&](const Leak& branch) {
    return branch.volume_mm3 >= kMost * leak.volume_mm3 &&
           (branch.place - leak.place).norm() <= branch.radius_mm + kBesideMm;
  });
}

}  // namespace

LocalLumen find_local_lumen(const LumenField& field, const Candidates& candidates,
                            const std::vector<std::vector<WayLevel>>& ways,
                            const std::vector<std::size_t>& seeds, double neck,
                            const MaskLimits& limits) {
  std::vector<float> level = nearest_levels(field, candidates, ways);
  const Labels core = find_core(field, candidates, ways, level);
  require_no_flood(field.grid, core, limits, MaskBy::kLevels);
  const std::vector<float> depth = measure_depth(field.grid, core);
  const VesselParts parts = divide_vessels(field, core, depth, level, ways, neck);

  Labels own(core.size(), 0), other(core.size(), 0);
  for (std::size_t n = 0; n < core.size(); ++n) {
    if (core[n] == 0) continue;
    const VesselPart& part = parts.parts[parts.of[n]];
    level[n] = part.level;
    other[n] = part.other ? 1 : 0;
    own[n] = !part.other && depth[n] >= kMiddlePart * part.depth ? 1 : 0;
  }
  std::vector<std::size_t> trusted;
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      trusted.push_back(place.voxel);
      other[place.voxel] = 0;
    }
  }
  for (const std::size_t n : vessel_round(field.grid, parts, depth, ways)) own[n] = 1;
  LocalLumen found;
  found.labels = core;
  const KnownParts known{.ways = trusted, .own = own, .other = other};
  found.leaks = cut_leaks(field.grid, field.values, field.upper, seeds, found.labels, &known).leaks;
  std::erase_if(found.leaks, [](const Leak& leak) { return leak.neck_radius_mm == 0.0; });
  for (std::size_t n = 0; n < core.size(); ++n) {
    other[n] = core[n] != 0 && found.labels[n] == 0 ? 1 : 0;
  }
  found.doubtful = find_doubtful(field, parts, depth, found.labels);
  add_rim(field, level, found.labels, other);
  found.branches = add_side_branches(field, level, found.labels, other);
  std::erase_if(found.leaks, [&](const Leak& leak) { return is_branch(leak, found.branches); });
  found.other = std::move(other);
  return found;
}

}  // namespace wireplan::preprocess
