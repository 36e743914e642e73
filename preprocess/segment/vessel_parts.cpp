#include "preprocess/segment/vessel_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <unordered_map>
#include <utility>

namespace wireplan::preprocess {
namespace {

constexpr double kDarker = 0.12, kBrighter = 0.2;  // by which another vessel's level differs
constexpr float kWider = 1.5F, kWiderMm = 1.0F;    // beyond which a wider part is no branch
constexpr float kWiderAlready = 1.3F;              // beyond which half the difference is enough
constexpr double kMostSoft = 0.6, kSoft = 0.45;    // of the boundary; of the contrast behind it
constexpr double kMostSoftOn = 0.75;               // of a part that the vessel goes on in ...
constexpr float kGoesOn = 0.75F;     // ... through a contact of this part of either's depth
constexpr double kCorrelated = 1.5;  // noise of a mean, against that of independent voxels
constexpr double kFewVoxels = 40.0;  // of a core: fewer do not tell its level
constexpr float kMiddle = 0.6F;      // of the depth: what lies deeper is the middle of a part
constexpr double kMostFall = 0.001;  // of the contrast per mm, by which a level is followed down
constexpr float kBoneHu = 800.0F;    // bone has more somewhere
constexpr double kBoneMm3 = 5000.0;  // bright beyond lumen: plaque and stents have less
constexpr double kDoubtfulPart = 0.6, kDoubtfulSoft = 0.4;  // of what a part is refused for

/// Where two parts meet.
struct PartContact {
  std::uint32_t to = 0;
  float depth = 0.0F;  // in the widest place                                               [mm]
};
using PartContacts = std::vector<std::vector<PartContact>>;  // of each part
using PairDepths = std::unordered_map<std::uint64_t, float>;

void add_pair(std::uint64_t a, std::uint64_t b, float depth, PairDepths& pairs) {
  float& most = pairs[std::min(a, b) << 32U | std::max(a, b)];
  most = std::max(most, depth);
}

PartContacts contacts_of(const PairDepths& pairs, std::size_t parts) {
  PartContacts contacts(parts);
  for (const auto& [pair, depth] : pairs) {
    const auto a = static_cast<std::uint32_t>(pair >> 32U), b = static_cast<std::uint32_t>(pair);
    contacts[a].push_back({b, depth});
    contacts[b].push_back({a, depth});
  }
  for (auto& of_part : contacts) {
    std::sort(of_part.begin(), of_part.end(),
              [](const PartContact& a, const PartContact& b) { return a.to < b.to; });
  }
  return contacts;
}

/// Numbers each voxel's part: the deepest of its neighbours is followed until none is deeper.
std::uint32_t climb_all(const Grid& grid, const std::vector<float>& depth,
                        std::vector<std::uint32_t>& of) {
  std::vector<std::uint32_t> up(depth.size(), 0);
  for (std::size_t n = 0; n < depth.size(); ++n) {
    if (depth[n] <= 0.0F) continue;
    std::size_t best = n;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) {
      if (depth[m] > depth[best] || (depth[m] == depth[best] && m < best)) best = m;
    });
    up[n] = static_cast<std::uint32_t>(best);
  }
  std::uint32_t parts = 0;
  of.assign(depth.size(), 0);
  std::vector<std::size_t> path;
  for (std::size_t n = 0; n < depth.size(); ++n) {
    if (depth[n] <= 0.0F || of[n] != 0) continue;
    path.clear();
    std::size_t at = n;
    while (of[at] == 0 && up[at] != at) {
      path.push_back(at);
      at = up[at];
    }
    if (of[at] == 0) of[at] = ++parts;
    for (const std::size_t m : path) of[m] = of[at];
  }
  return parts;
}

void measure_cores(const LumenField& field, const std::vector<float>& depth, VesselParts& found) {
  for (std::size_t n = 0; n < found.of.size(); ++n) {
    VesselPart& part = found.parts[found.of[n]];
    if (found.of[n] == 0) continue;
    part.voxels += 1.0;
    if (depth[n] <= part.depth) continue;
    part.depth = depth[n];
    part.peak = center_of(field.grid, n);
  }
  for (std::size_t n = 0; n < found.of.size(); ++n) {
    VesselPart& part = found.parts[found.of[n]];
    if (found.of[n] == 0 || depth[n] < kMiddle * part.depth) continue;
    part.core += static_cast<double>(field.raw[n]);
    part.core_voxels += 1.0;
  }
  for (VesselPart& part : found.parts) part.core /= std::max(1.0, part.core_voxels);
}

double error_of_core(const LumenField& field, const VesselPart& part) {
  return kCorrelated * field.noise / std::sqrt(std::max(1.0, part.core_voxels));
}

/// Joins to its wider neighbour each part that is none of its own: its contact is nearly as wide as
/// itself, and it is much narrower, or too small to tell its level; unless its level is clearly
/// another.
PairDepths join_bumps(const LumenField& field, const PairDepths& pairs, VesselParts& found) {
  constexpr float kNoNeck = 0.75F, kNarrower = 0.7F;
  auto& parts = found.parts;
  const PartContacts contacts = contacts_of(pairs, parts.size());
  const auto narrower = [&](std::uint32_t a, std::uint32_t b) {
    return parts[a].depth != parts[b].depth ? parts[a].depth < parts[b].depth : a > b;
  };
  std::vector<std::uint32_t> into(parts.size()), order;
  for (std::uint32_t a = 0; a < into.size(); ++a) into[a] = a;
  for (std::uint32_t a = 1; a < into.size(); ++a) order.push_back(a);
  std::sort(order.begin(), order.end(), narrower);
  for (const std::uint32_t a : order) {
    PartContact best;
    for (const PartContact& contact : contacts[a]) {
      if (narrower(a, contact.to) && contact.depth > best.depth) best = contact;
    }
    const VesselPart& part = parts[a];
    if (best.to == 0 || best.depth < kNoNeck * part.depth) continue;
    VesselPart& wider = parts[best.to];
    const bool bump = part.depth < kNarrower * wider.depth;
    if (!bump && part.core_voxels >= kFewVoxels) continue;
    const double apart = std::abs(part.core - wider.core);
    if (apart > 3.0 * error_of_core(field, part) &&
        apart > kDarker * (wider.core - field.surroundings)) {
      continue;
    }
    into[a] = best.to;
    wider.voxels += part.voxels;
    if (bump) continue;
    const double sum = wider.core_voxels + part.core_voxels;
    wider.core = (wider.core * wider.core_voxels + part.core * part.core_voxels) / sum;
    wider.core_voxels = sum;
  }
  for (auto a = order.rbegin(); a != order.rend(); ++a) into[*a] = into[into[*a]];
  for (std::uint32_t& of : found.of) of = into[of];
  PairDepths joined;
  for (const auto& [pair, depth] : pairs) {
    const std::uint32_t a = into[pair >> 32U], b = into[pair & 0xffffffffU];
    if (a != b) add_pair(a, b, depth, joined);
  }
  return joined;
}

/// Averages each part's core with those that it goes on into, so that small ones tell more.
void average_cores(const PartContacts& contacts, std::vector<VesselPart>& parts) {
  constexpr float kNoNeck = 0.8F, kAsWide = 0.5F;
  const std::vector<VesselPart> before = parts;
  for (std::uint32_t a = 1; a < before.size(); ++a) {
    double sum = before[a].core * before[a].core_voxels, voxels = before[a].core_voxels;
    for (const PartContact& contact : contacts[a]) {
      const VesselPart& next = before[contact.to];
      if (contact.depth < kNoNeck * std::min(before[a].depth, next.depth) ||
          next.depth < kAsWide * before[a].depth) {
        continue;
      }
      sum += next.core * next.core_voxels;
      voxels += next.core_voxels;
    }
    if (voxels == 0.0) continue;
    parts[a].core = sum / voxels;
    parts[a].core_voxels = voxels;
  }
}

/// 1 in what is too bright for lumen, too large for plaque or a stent, and somewhere brighter than
/// any contrast: bone.
Labels find_bone(const LumenField& field) {
  const double voxel = field.grid.spacing.prod();
  Labels bone(field.values.size(), 0), seen(field.values.size(), 0);
  const auto is_bright = [&](std::size_t n) {
    return static_cast<double>(field.values[n]) > field.upper;
  };
  std::vector<std::size_t> piece;
  for (std::size_t n = 0; n < bone.size(); ++n) {
    if (seen[n] != 0 || !is_bright(n)) continue;
    piece.assign(1, n);
    seen[n] = 1;
    float brightest = 0.0F;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      brightest = std::max(brightest, field.raw[piece[next]]);
      for_each_face_neighbour(field.grid, piece[next], [&](std::size_t m) {
        if (seen[m] != 0 || !is_bright(m)) return;
        seen[m] = 1;
        piece.push_back(m);
      });
    }
    if (static_cast<double>(piece.size()) * voxel < kBoneMm3 || brightest < kBoneHu) continue;
    for (const std::size_t m : piece) bone[m] = 1;
  }
  return bone;
}

/// Counts the faces that each part has to what is not in the mask, and those behind which, two
/// voxels on, the values stay high, or bone begins.
void count_faces(const LumenField& field, const std::vector<float>& level, VesselParts& found) {
  const Grid& grid = field.grid;
  const Labels bone = field.hounsfield ? find_bone(field) : Labels(field.values.size(), 0);
  for (std::size_t n = 0; n < found.of.size(); ++n) {
    if (found.of[n] == 0) continue;
    VesselPart& part = found.parts[found.of[n]];
    const double contrast = static_cast<double>(level[n]) - field.surroundings;
    const double high = field.surroundings + kSoft * contrast;
    const Voxel v = voxel_at(grid, n);
    for_each_face_neighbour(grid, n, [&](std::size_t m) {
      if (found.of[m] != 0) return;
      const Voxel w = voxel_at(grid, m);
      const Voxel next = {2 * w[0] - v[0], 2 * w[1] - v[1], 2 * w[2] - v[2]};
      const bool exists = std::min({next[0], next[1], next[2]}) >= 0 && next[0] < grid.size[0] &&
                          next[1] < grid.size[1] && next[2] < grid.size[2];
      const std::size_t behind = exists ? index_of(grid, next) : m;
      const auto value = static_cast<double>(field.values[behind]);
      part.faces += 1.0;
      part.soft += bone[behind] != 0 || (value > high && value < field.upper) ? 1.0 : 0.0;
    });
  }
}

/// How far a part's level is from that of the vessel that it was reached from: beyond 1 it is
/// another's. 0 where it cannot be told.
double other_level(const LumenField& field, const LevelRule& rule, float level,
                   const VesselPart& part) {
  const double contrast = static_cast<double>(level) - field.surroundings;
  const double brighter = part.core - static_cast<double>(level);
  const double darker = -brighter - (1.0 - rule.seen_raw(part.depth)) * contrast;
  if (std::max(darker, brighter) <= 3.0 * error_of_core(field, part)) return 0.0;
  return std::max(darker / kDarker, brighter / kBrighter) / contrast;
}

/// A way into a part from one that is the vessel's.
struct Entrance {
  float width = 0.0F;    // of the narrowest place on the way there                         [mm]
  float contact = 0.0F;  // of the last contact                                             [mm]
  std::uint32_t from = 0, to = 0;
};

/// The wider is looked at first, else that of the lower numbers.
bool comes_later(const Entrance& a, const Entrance& b) {
  if (a.width != b.width) return a.width < b.width;
  return std::pair(a.to, a.from) > std::pair(b.to, b.from);
}
using Entrances = std::priority_queue<Entrance, std::vector<Entrance>, decltype(&comes_later)>;

/// Whether the entrance leads to the same vessel; a part refused may be reached from elsewhere.
bool leads_on(const LumenField& field, const LevelRule& rule, const Entrance& entrance, double neck,
              const VesselPart& from, VesselPart& part) {
  const double beside = other_level(field, rule, from.level, part);
  const bool widens = part.depth > kWiderAlready * entrance.contact + static_cast<float>(neck);
  // Where the ways' vessel goes on, as wide as before, more of what lies beside it may be bright.
  const bool goes_on =
      from.on_way && entrance.contact >= kGoesOn * std::max(from.depth, part.depth);
  if (part.soft > (goes_on ? kMostSoftOn : kMostSoft) * part.faces ||
      part.depth > kWider * entrance.width + kWiderMm || beside > (widens ? 0.5 : 1.0)) {
    return false;
  }
  part.on_way = goes_on;
  part.doubtful = from.doubtful || beside > kDoubtfulPart || part.soft > kDoubtfulSoft * part.faces;
  const double apart = (part.peak - from.peak).norm();
  const double contrast = static_cast<double>(from.level) - field.surroundings;
  part.level = rule.follow(from.level, part.core, rule.seen_raw(part.depth), apart);
  if (field.hounsfield && !part.on_way) {
    const double least = static_cast<double>(from.level) - kMostFall * apart * contrast;
    part.level = std::max(part.level, static_cast<float>(least));
  }
  return true;
}

void visit_parts(const LumenField& field, const PartContacts& contacts, double neck,
                 const std::vector<std::uint32_t>& starts, std::vector<VesselPart>& parts) {
  const LevelRule rule(field);
  Entrances entrances(&comes_later);
  const auto add_contacts = [&](std::uint32_t from, float width) {
    for (const PartContact& contact : contacts[from]) {
      if (parts[contact.to].level != 0.0F || static_cast<double>(contact.depth) < neck) continue;
      entrances.push({std::min(width, contact.depth), contact.depth, from, contact.to});
    }
  };
  for (const std::uint32_t start : starts) add_contacts(start, parts[start].depth);
  while (!entrances.empty()) {
    const Entrance entrance = entrances.top();
    entrances.pop();
    VesselPart& part = parts[entrance.to];
    if (part.level != 0.0F) continue;
    if (leads_on(field, rule, entrance, neck, parts[entrance.from], part)) {
      add_contacts(entrance.to, entrance.width);
    }
  }
}

/// A part with less volume than the ball that fits in there is no vessel, but a piece of the one
/// that it touches most widely.
void adopt_pieces(const Grid& grid, const PartContacts& contacts, std::vector<VesselPart>& parts) {
  const double voxel = grid.spacing.prod();
  const std::vector<VesselPart> before = parts;
  for (std::size_t a = 1; a < parts.size(); ++a) {
    const auto radius = static_cast<double>(before[a].depth);
    const double ball = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
    if (before[a].level != 0.0F || before[a].voxels * voxel >= ball) continue;
    PartContact widest;
    for (const PartContact& contact : contacts[a]) {
      if (contact.depth > widest.depth) widest = contact;
    }
    parts[a].level = before[widest.to].level;
  }
}

/// The parts that the ways lead through, with their levels: that of the way at the place next to
/// the part's middle, corrected by the part's own core, which holds more voxels.
std::vector<std::uint32_t> find_starts(const LumenField& field,
                                       const std::vector<std::vector<WayLevel>>& ways,
                                       VesselParts& found) {
  std::vector<std::uint32_t> starts;
  std::vector<double> off(found.parts.size(), std::numeric_limits<double>::infinity());
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      const std::uint32_t of = found.of[place.voxel];
      if (of == 0) continue;
      VesselPart& part = found.parts[of];
      const double here = (center_of(field.grid, place.voxel) - part.peak).norm();
      if (!part.on_way) starts.push_back(of);
      part.on_way = true;
      if (here >= off[of]) continue;
      off[of] = here;
      part.level = place.level;
    }
  }
  const LevelRule rule(field);
  for (const std::uint32_t start : starts) {
    VesselPart& part = found.parts[start];
    if (part.core_voxels < kFewVoxels || off[start] > 0.5 * static_cast<double>(part.depth))
      continue;
    constexpr double kWhole = std::numeric_limits<double>::infinity();  // of the difference
    part.level = rule.follow(part.level, part.core, rule.seen_raw(part.depth), kWhole);
  }
  return starts;
}

}  // namespace

VesselParts divide_vessels(const LumenField& field, const Labels& mask,
                           const std::vector<float>& depth, const std::vector<float>& level,
                           const std::vector<std::vector<WayLevel>>& ways, double neck) {
  expects(mask.size() == depth.size() && level.size() == depth.size());
  VesselParts found;
  found.parts.resize(climb_all(field.grid, depth, found.of) + 1U);
  measure_cores(field, depth, found);
  PairDepths pairs;
  for (std::size_t n = 0; n < found.of.size(); ++n) {
    if (found.of[n] == 0) continue;
    for_each_neighbour(field.grid, n, [&](std::size_t m, const Voxel&) {
      if (found.of[m] > found.of[n]) {
        add_pair(found.of[n], found.of[m], std::min(depth[n], depth[m]), pairs);
      }
    });
  }
  const PartContacts contacts = contacts_of(join_bumps(field, pairs, found), found.parts.size());
  average_cores(contacts, found.parts);
  count_faces(field, level, found);

  const std::vector<std::uint32_t> starts = find_starts(field, ways, found);
  visit_parts(field, contacts, neck, starts, found.parts);
  adopt_pieces(field.grid, contacts, found.parts);
  for (VesselPart& part : found.parts) {
    if (part.level != 0.0F) continue;
    part.other = true;
    part.level = static_cast<float>(part.core);
  }
  return found;
}

}  // namespace wireplan::preprocess
