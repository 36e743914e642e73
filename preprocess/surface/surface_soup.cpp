#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "preprocess/surface/surface_mend.h"
#include "preprocess/surface/triangle_sides.h"

namespace wireplan::preprocess {
namespace {

constexpr int kRounds = 50;  // of dropping sheets and cutting out tangles
// Vertices that were parted move this part of the way to their neighbours' mean.
constexpr double kParting = 0.05;

using Sides = std::vector<Side>;
using SidePair = std::pair<const Side*, const Side*>;

Vec3 vertex(const Surface& s, int v) { return s.vertices.col(v); }

Vec3 middle_of(const Surface& s, int t) {
  return (vertex(s, s.triangles(0, t)) + vertex(s, s.triangles(1, t)) +
          vertex(s, s.triangles(2, t))) /
         3.0;
}

double area_of(const Surface& s, int t) {
  const Vec3 a = vertex(s, s.triangles(0, t));
  return 0.5 * (vertex(s, s.triangles(1, t)) - a).cross(vertex(s, s.triangles(2, t)) - a).norm();
}

/// Width of the box round the triangles' corners.
double width_of(const Surface& s, const std::vector<int>& triangles) {
  Vec3 low = middle_of(s, triangles.front()), high = low;
  for (const int t : triangles) {
    for (const int v : s.triangles.col(t)) {
      low = low.cwiseMin(vertex(s, v));
      high = high.cwiseMax(vertex(s, v));
    }
  }
  return (high - low).norm();
}

Surface without(const Surface& s, const std::vector<char>& drop) {
  Surface kept{.vertices = s.vertices, .triangles = {}};
  kept.triangles.resize(3, std::count(drop.begin(), drop.end(), 0));
  for (Eigen::Index t = 0, column = 0; t < s.triangles.cols(); ++t) {
    if (!drop[static_cast<std::size_t>(t)]) kept.triangles.col(column++) = s.triangles.col(t);
  }
  return kept;
}

/// Drops triangles with a corner twice, and all but the first of those with the same corners.
Surface without_doubles(const Surface& s, std::vector<Mend>& mends) {
  std::set<std::array<int, 3>> seen;
  std::vector<char> drop(static_cast<std::size_t>(s.triangles.cols()), 0);
  std::map<MendKind, Mend> found;
  for (int t = 0; t < s.triangles.cols(); ++t) {
    std::array<int, 3> corners = {s.triangles(0, t), s.triangles(1, t), s.triangles(2, t)};
    std::sort(corners.begin(), corners.end());
    const bool degenerate = corners[0] == corners[1] || corners[1] == corners[2];
    if (!degenerate && seen.insert(corners).second) continue;
    drop[static_cast<std::size_t>(t)] = 1;
    const MendKind kind = degenerate ? MendKind::kDegenerate : MendKind::kDuplicate;
    Mend& mend =
        found
            .try_emplace(
                kind,
                Mend{.kind = kind, .count = 0, .place = middle_of(s, t), .size = width_of(s, {t})})
            .first->second;
    ++mend.count;
  }
  for (const auto& [kind, mend] : found) mends.push_back(mend);
  return without(s, drop);
}

/// Triangles that hang together through edges of two.
struct Patches {
  std::vector<int> of;  // triangle -> lowest triangle of its patch
  std::map<int, std::vector<int>> triangles;
  std::map<int, double> area;
  std::set<int> open;  // patches with an edge of one triangle
  int largest = 0;
};

Patches find_patches(const Surface& s, const Sides& sides) {
  const int count = static_cast<int>(s.triangles.cols());
  DisjointSets sets(count);
  for_each_edge(sides, [&](auto begin, auto end) {
    if (end - begin == 2) sets.unite(begin->triangle, (begin + 1)->triangle);
  });
  Patches patches;
  for (int t = 0; t < count; ++t) {
    patches.of.push_back(sets.find(t));
    patches.triangles[patches.of.back()].push_back(t);
    patches.area[patches.of.back()] += area_of(s, t);
  }
  for_each_edge(sides, [&](auto begin, auto end) {
    if (end - begin == 1) patches.open.insert(patches.of[begin->triangle]);
  });
  patches.largest =
      std::max_element(patches.area.begin(), patches.area.end(), [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first;
  return patches;
}

/// The sheet to drop at an edge of more than two triangles: the smallest but for the largest of
/// all, of those that end freely where an even number meets, which may be contact.
std::optional<int> sheet_to_drop(const Patches& patches, Sides::const_iterator begin,
                                 Sides::const_iterator end) {
  const bool odd = (end - begin) % 2 == 1;
  std::optional<int> best;
  for (auto side = begin; side != end; ++side) {
    const int patch = patches.of[side->triangle];
    if (patch == patches.largest || (!odd && patches.open.count(patch) == 0)) continue;
    if (!best || patches.area.at(patch) < patches.area.at(*best)) best = patch;
  }
  return best;
}

/// Drops sheets until no edge asks for it.
Surface without_sheets(Surface s, std::vector<Mend>& mends) {
  for (int round = 0; round < kRounds; ++round) {
    const Sides sides = sorted_sides(s);
    const Patches patches = find_patches(s, sides);
    std::set<int> dropped;
    for_each_edge(sides, [&](auto begin, auto end) {
      if (end - begin < 3) return;
      const std::optional<int> sheet = sheet_to_drop(patches, begin, end);
      if (sheet) dropped.insert(*sheet);
    });
    if (dropped.empty()) break;
    std::vector<char> drop(static_cast<std::size_t>(s.triangles.cols()), 0);
    for (const int sheet : dropped) {
      const std::vector<int>& triangles = patches.triangles.at(sheet);
      for (const int t : triangles) drop[static_cast<std::size_t>(t)] = 1;
      mends.push_back({.kind = MendKind::kFin,
                       .count = static_cast<int>(triangles.size()),
                       .place = middle_of(s, triangles[triangles.size() / 2]),
                       .size = width_of(s, triangles)});
    }
    s = without(s, drop);
  }
  return s;
}

/// Which triangles are to be turned so that all of a patch agree, outward by the patch's volume.
std::vector<char> patch_turns(const Surface& s, const Sides& sides, const Patches& patches) {
  std::vector<std::vector<std::pair<int, bool>>> next(static_cast<std::size_t>(s.triangles.cols()));
  for_each_edge(sides, [&](auto begin, auto end) {
    if (end - begin != 2) return;
    const auto other = begin + 1;
    const bool same = begin->forward != other->forward;
    next[static_cast<std::size_t>(begin->triangle)].emplace_back(other->triangle, same);
    next[static_cast<std::size_t>(other->triangle)].emplace_back(begin->triangle, same);
  });
  std::vector<char> turn(next.size(), 0), seen(next.size(), 0);
  for (const auto& [patch, triangles] : patches.triangles) {
    std::vector<int> stack = {patch};
    seen[static_cast<std::size_t>(patch)] = 1;
    const Vec3 origin = middle_of(s, patch);
    double volume = 0.0;
    while (!stack.empty()) {
      const int t = stack.back();
      stack.pop_back();
      const double part = (vertex(s, s.triangles(0, t)) - origin)
                              .dot((vertex(s, s.triangles(1, t)) - origin)
                                       .cross(vertex(s, s.triangles(2, t)) - origin));
      volume += turn[static_cast<std::size_t>(t)] ? -part : part;
      for (const auto& [other, same] : next[static_cast<std::size_t>(t)]) {
        if (seen[static_cast<std::size_t>(other)]) continue;
        seen[static_cast<std::size_t>(other)] = 1;
        turn[static_cast<std::size_t>(other)] = static_cast<char>(
            same ? turn[static_cast<std::size_t>(t)] : !turn[static_cast<std::size_t>(t)]);
        stack.push_back(other);
      }
    }
    if (volume >= 0.0) continue;
    for (const int t : triangles) turn[static_cast<std::size_t>(t)] ^= 1;
  }
  return turn;
}

/// Pairs the triangles round an edge that many share, so that each pair encloses a wedge of the
/// inside: sorted by angle about the edge, one that runs back along it is followed by one that runs
/// forward. None where they do not alternate.
std::vector<SidePair> pairs_round_edge(const Surface& s, Sides::const_iterator begin,
                                       Sides::const_iterator end, const std::vector<char>& turn) {
  struct Spoke {
    double angle;
    const Side* side;
    bool forward;
  };
  const Vec3 from = vertex(s, begin->low), along = (vertex(s, begin->high) - from).normalized();
  const Vec3 u = along.unitOrthogonal(), v = along.cross(u);
  std::vector<Spoke> spokes;
  for (auto side = begin; side != end; ++side) {
    const Vec3 out = vertex(s, s.triangles((side->corner + 2) % 3, side->triangle)) - from;
    spokes.push_back({std::atan2(out.dot(v), out.dot(u)), &*side,
                      side->forward != (turn[static_cast<std::size_t>(side->triangle)] != 0)});
  }
  std::sort(spokes.begin(), spokes.end(),
            [](const Spoke& a, const Spoke& b) { return a.angle < b.angle; });
  std::vector<SidePair> pairs;
  for (std::size_t k = 0; k < spokes.size(); ++k) {
    const Spoke &a = spokes[k], &b = spokes[(k + 1) % spokes.size()];
    if (a.forward == b.forward || a.angle == b.angle) return {};
    if (!a.forward) pairs.emplace_back(a.side, b.side);
  }
  return pairs;
}

/// Which sides are joined: those of edges of two triangles, and at other edges those that enclose a
/// wedge of the inside. Edges for which no such pairs are found go to `tangled`.
std::vector<SidePair> join_sides(const Surface& s, const Sides& sides,
                                 const std::vector<char>& turn, std::vector<Side>& tangled) {
  std::vector<SidePair> joined;
  for_each_edge(sides, [&](auto begin, auto end) {
    if (end - begin == 2) joined.emplace_back(&*begin, &*(begin + 1));
    if (end - begin < 3) return;
    const std::vector<SidePair> pairs = pairs_round_edge(s, begin, end, turn);
    if (pairs.empty()) tangled.push_back(*begin);
    joined.insert(joined.end(), pairs.begin(), pairs.end());
  });
  return joined;
}

/// Without the triangles at either end of the edges, one mend per cluster of them.
Surface cut_out(const Surface& s, const std::vector<Side>& tangled, std::vector<Mend>& mends) {
  std::set<int> ends;
  for (const Side& side : tangled) ends.insert({side.low, side.high});
  DisjointSets clusters(static_cast<int>(s.vertices.cols()));
  for (const Side& side : tangled) clusters.unite(side.low, side.high);
  std::vector<char> drop(static_cast<std::size_t>(s.triangles.cols()), 0);
  std::map<int, std::vector<int>> cut;
  for (int t = 0; t < s.triangles.cols(); ++t) {
    for (const int v : s.triangles.col(t)) {
      if (ends.count(v) == 0 || drop[static_cast<std::size_t>(t)]) continue;
      drop[static_cast<std::size_t>(t)] = 1;
      cut[clusters.find(v)].push_back(t);
    }
  }
  for (const auto& [cluster, triangles] : cut) {
    mends.push_back({.kind = MendKind::kTangle,
                     .count = static_cast<int>(triangles.size()),
                     .place = vertex(s, cluster),
                     .size = width_of(s, triangles)});
  }
  return without(s, drop);
}

/// Turns triangles so that joined ones agree. Throws where that is impossible.
void orient(Surface& s, const std::vector<SidePair>& joined, const std::string& origin,
            std::vector<Mend>& mends) {
  std::vector<std::vector<const SidePair*>> next(static_cast<std::size_t>(s.triangles.cols()));
  for (const SidePair& pair : joined) {
    next[static_cast<std::size_t>(pair.first->triangle)].push_back(&pair);
    next[static_cast<std::size_t>(pair.second->triangle)].push_back(&pair);
  }
  std::vector<int> turn(next.size(), -1);  // not seen, as it is, turned
  for (std::size_t start = 0; start < next.size(); ++start) {
    if (turn[start] >= 0) continue;
    turn[start] = 0;
    std::vector<int> piece = {static_cast<int>(start)};
    int turned = 0;
    for (std::size_t k = 0; k < piece.size(); ++k) {
      const int t = piece[k];
      turned += turn[static_cast<std::size_t>(t)];
      for (const SidePair* pair : next[static_cast<std::size_t>(t)]) {
        const auto& [a, b] = *pair;
        const int other = a->triangle == t ? b->triangle : a->triangle;
        const int wanted = turn[static_cast<std::size_t>(t)] ^ (a->forward == b->forward ? 1 : 0);
        int& there = turn[static_cast<std::size_t>(other)];
        if (there == -1) piece.push_back(other);
        if (there == -1) there = wanted;
        if (there == wanted) continue;
        throw Error(origin + ": the surface has one side only (like a Moebius strip): at " +
                    place_text(middle_of(s, other)) +
                    " mm its normals cannot be made to agree with their neighbours'. Expected a "
                    "surface with an inside; cut it apart there in a mesh editor (3D Slicer, "
                    "MeshLab, Blender), or segment again");
      }
    }
    // The majority stays; the whole piece is turned outward later.
    const int of = static_cast<int>(piece.size());
    const int minority = std::min(turned, of - turned);
    const int odd_one = turned <= of - turned ? 1 : 0;
    std::optional<Vec3> place;
    for (const int t : piece) {
      if (turn[static_cast<std::size_t>(t)] != odd_one) continue;
      if (!place) place = middle_of(s, t);
      std::swap(s.triangles(1, t), s.triangles(2, t));
    }
    if (minority > 0) {
      mends.push_back({.kind = MendKind::kTurned, .count = minority, .place = *place});
    }
  }
}

/// Gives each fan of joined triangles vertices of its own. Expects sides as they were before
/// `orient`, whose corners the pairs name by their vertices.
Surface split_vertices(const Surface& s, const std::vector<SidePair>& joined,
                       std::vector<Mend>& mends) {
  const auto corner_at = [&](int t, int v) {
    int k = 0;
    while (s.triangles(k, t) != v) ++k;
    return 3 * t + k;
  };
  const int corners = 3 * static_cast<int>(s.triangles.cols());
  DisjointSets fans(corners);
  for (const auto& [a, b] : joined) {
    for (const int v : {a->low, a->high}) {
      fans.unite(corner_at(a->triangle, v), corner_at(b->triangle, v));
    }
  }
  std::vector<int> number(static_cast<std::size_t>(corners), -1);  // new vertex of a fan
  std::vector<int> before;                                         // old vertex of a new one
  Surface split{.vertices = {}, .triangles = s.triangles};
  for (int c = 0; c < corners; ++c) {
    int& fan = number[static_cast<std::size_t>(fans.find(c))];
    if (fan < 0) {
      fan = static_cast<int>(before.size());
      before.push_back(s.triangles(c % 3, c / 3));
    }
    split.triangles(c % 3, c / 3) = fan;
  }
  split.vertices.resize(3, static_cast<Eigen::Index>(before.size()));
  std::vector<int> copies(static_cast<std::size_t>(s.vertices.cols()), 0);
  for (std::size_t v = 0; v < before.size(); ++v) {
    split.vertices.col(static_cast<Eigen::Index>(v)) = s.vertices.col(before[v]);
    ++copies[static_cast<std::size_t>(before[v])];
  }

  // Copies of one place leave it, each a little toward the middle of its own fan.
  const Eigen::Index n = split.vertices.cols();
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, n);
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(n);
  for (const auto& t : split.triangles.colwise()) {
    for (int k = 0; k < 3; ++k) {
      const int v = t(k);
      sum.col(v) += split.vertices.col(t((k + 1) % 3)) + split.vertices.col(t((k + 2) % 3));
      weight(v) += 2.0;
    }
  }
  std::optional<Mend> contact;
  for (Eigen::Index v = 0; v < n; ++v) {
    if (copies[static_cast<std::size_t>(before[static_cast<std::size_t>(v)])] < 2) continue;
    const Vec3 at = split.vertices.col(v), away = kParting * (sum.col(v) / weight(v) - at);
    split.vertices.col(v) += away;
    if (!contact) contact = Mend{.kind = MendKind::kContact, .count = 0, .place = at};
    ++contact->count;
    contact->size = std::max(contact->size, 2.0 * away.norm());
  }
  if (contact) mends.push_back(*contact);
  return split;
}

}  // namespace

Surface make_manifold(Surface soup, const std::string& origin, std::vector<Mend>& mends) {
  Surface s = without_doubles(soup, mends);
  for (int round = 0; s.triangles.cols() > 0; ++round) {
    s = without_sheets(s, mends);
    const Sides sides = sorted_sides(s);
    std::vector<Side> tangled;
    const std::vector<SidePair> joined =
        join_sides(s, sides, patch_turns(s, sides, find_patches(s, sides)), tangled);
    if (!tangled.empty() && round < kRounds) {
      s = cut_out(s, tangled, mends);
      continue;
    }
    orient(s, joined, origin, mends);
    return split_vertices(s, joined, mends);
  }
  throw Error(origin +
              ": nothing is left of the surface without its duplicate, degenerate and hanging "
              "triangles; expected the closed surface of a vessel");
}

}  // namespace wireplan::preprocess
