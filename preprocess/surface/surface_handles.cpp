#include "preprocess/surface/surface_handles.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <set>
#include <unordered_map>
#include <utility>

#include "preprocess/surface/triangle_sides.h"

namespace wireplan::preprocess {
namespace {

constexpr std::size_t kMostHandles = 128;
constexpr int kBases = 24;               // vertices that loops are sought from at first
constexpr std::size_t kMostBases = 200;  // with those to make loops shorter

/// A class of loops: which of the dual loops of a basis it crosses, an odd number of times.
using Class = std::bitset<2 * kMostHandles>;

/// A closed way along edges.
struct EdgeLoop {
  double length = 0.0;  //                                                                  [mm]
  Class of;
  std::vector<int> vertices;
};

/// Shortest ways from one vertex to all others.
struct WayTree {
  std::vector<double> distance;  //                                                         [mm]
  std::vector<int> by;           // the half edge that leads to a vertex; -1: none
  std::vector<Class> crossed;
};

/// Half edge 3 t + k runs from corner k of triangle t to the next.
class SurfaceLoops {
 public:
  explicit SurfaceLoops(const Surface& surface)
      : surface_(surface),
        twin_(3 * static_cast<std::size_t>(surface.triangles.cols()), -1),
        crosses_(twin_.size()),
        out_of_(static_cast<std::size_t>(surface.vertices.cols()), -1) {
    for_each_edge(sorted_sides(surface), [&](auto begin, auto end) {
      expects(end - begin == 2 && begin->forward != (begin + 1)->forward);
      const int a = 3 * begin->triangle + begin->corner,
                b = 3 * (begin + 1)->triangle + (begin + 1)->corner;
      twin_[index(a)] = b;
      twin_[index(b)] = a;
    });
    for (int half = 0; half < count(); ++half) out_of_[index(from(half))] = half;
    part_.assign(twin_.size(), Part::kNone);
    for (const int half : grow_ways(from(0)).by) {
      if (half >= 0) set_part(half, Part::kTree);
    }
    find_cotree();
    if (basis_.size() > 2 * kMostHandles) {
      basis_.clear();
      return;
    }
    mark_crossings();
    find_crossing_pairs();
  }

  std::size_t handles() const { return basis_.size() / 2; }

  /// Vertices to seek loops from.
  std::vector<int> bases() const {
    std::vector<int> chosen;
    const auto vertices = static_cast<long>(out_of_.size());
    for (long k = 0; k < kBases; ++k) chosen.push_back(static_cast<int>(k * vertices / kBases));
    for (std::size_t k = 0; k < std::min<std::size_t>(basis_.size(), kBases); ++k) {
      chosen.push_back(from(basis_[k]));
    }
    return chosen;
  }

  /// Of each class the shortest loop through the vertex that follows shortest ways but for one
  /// edge.
  void add_loops(int base, std::vector<EdgeLoop>& loops) const {
    const WayTree tree = grow_ways(base);
    struct Closing {
      double length;
      int half;
    };
    std::unordered_map<Class, Closing> shortest;
    for (int half = 0; half < count(); ++half) {
      if (half > twin_[index(half)]) continue;
      const std::size_t a = index(from(half)), b = index(to(half));
      const Class own = tree.crossed[a] ^ tree.crossed[b] ^ crosses_[index(half)];
      if (own.none()) continue;
      const double length = tree.distance[a] + tree.distance[b] + length_of(half);
      const auto [at, fresh] = shortest.try_emplace(own, Closing{length, half});
      if (!fresh && length < at->second.length) at->second = {length, half};
    }
    for (const auto& [own, closing] : shortest) {
      loops.push_back(close_loop(own, closing.half, tree));
    }
  }

  /// Of all, shortest first: what bounds nothing with those before it and crosses none of them.
  std::vector<EdgeLoop> choose(std::vector<EdgeLoop> loops) const {
    std::sort(loops.begin(), loops.end(), [](const EdgeLoop& a, const EdgeLoop& b) {
      if (a.length != b.length) return a.length < b.length;
      return a.vertices < b.vertices;
    });
    std::vector<EdgeLoop> chosen;
    std::vector<Class> reduced;  // the chosen, none with the leading bit of another
    for (EdgeLoop& loop : loops) {
      if (chosen.size() == handles()) break;
      Class rest = loop.of;
      for (const Class& row : reduced) {
        if (rest[leading(row)]) rest ^= row;
      }
      if (rest.none()) continue;
      const bool crosses = std::any_of(chosen.begin(), chosen.end(), [&](const EdgeLoop& other) {
        return cross(loop.of, other.of);
      });
      if (crosses) continue;
      for (Class& row : reduced) {
        if (row[leading(rest)]) row ^= rest;
      }
      reduced.push_back(rest);
      chosen.push_back(std::move(loop));
    }
    return chosen;
  }

  Vec3 middle_of(const EdgeLoop& loop) const {
    Vec3 sum = Vec3::Zero();
    for (const int v : loop.vertices) sum += surface_.vertices.col(v);
    return sum / static_cast<double>(loop.vertices.size());
  }

 private:
  static std::size_t index(int k) { return static_cast<std::size_t>(k); }
  int count() const { return static_cast<int>(twin_.size()); }
  int from(int half) const { return surface_.triangles(half % 3, half / 3); }
  int to(int half) const { return surface_.triangles((half + 1) % 3, half / 3); }
  double length_of(int half) const {
    return (surface_.vertices.col(to(half)) - surface_.vertices.col(from(half))).norm();
  }
  /// The next half edge out of the same vertex.
  int beside(int half) const { return twin_[index(half - half % 3 + (half + 2) % 3)]; }

  static std::size_t leading(const Class& row) {
    std::size_t bit = 0;
    while (!row[bit]) ++bit;
    return bit;
  }
  bool cross(const Class& a, const Class& b) const {
    bool odd = false;
    for (std::size_t k = 0; k < basis_.size(); ++k) {
      if (a[k]) odd = odd != ((b & pairs_[k]).count() % 2 == 1);
    }
    return odd;
  }

  WayTree grow_ways(int base) const {
    WayTree tree{std::vector<double>(out_of_.size(), std::numeric_limits<double>::infinity()),
                 std::vector<int>(out_of_.size(), -1), std::vector<Class>(out_of_.size())};
    using Reached = std::pair<double, int>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
    tree.distance[index(base)] = 0.0;
    queue.push({0.0, base});
    while (!queue.empty()) {
      const auto [distance, v] = queue.top();
      queue.pop();
      if (distance > tree.distance[index(v)] || out_of_[index(v)] < 0) continue;
      int half = out_of_[index(v)];
      do {
        const std::size_t w = index(to(half));
        const double length = distance + length_of(half);
        if (length < tree.distance[w]) {
          tree.distance[w] = length;
          tree.by[w] = half;
          tree.crossed[w] = tree.crossed[index(v)] ^ crosses_[index(half)];
          queue.push({length, to(half)});
        }
        half = beside(half);
      } while (half != out_of_[index(v)]);
    }
    return tree;
  }

  /// From a vertex back to the base.
  std::vector<int> way_to(int v, const WayTree& tree) const {
    std::vector<int> way = {v};
    while (tree.by[index(v)] >= 0) way.push_back(v = from(tree.by[index(v)]));
    return way;
  }

  /// The ways to both ends of the edge, without what they have in common.
  EdgeLoop close_loop(const Class& own, int half, const WayTree& tree) const {
    std::vector<int> way = way_to(from(half), tree), back = way_to(to(half), tree);
    while (way.size() > 1 && back.size() > 1 && way[way.size() - 2] == back[back.size() - 2]) {
      way.pop_back();
      back.pop_back();
    }
    const std::size_t parts = index(way.back());
    EdgeLoop loop{tree.distance[index(from(half))] + tree.distance[index(to(half))] -
                      2.0 * tree.distance[parts] + length_of(half),
                  own, std::move(way)};
    loop.vertices.insert(loop.vertices.end(), back.rbegin() + 1, back.rend());
    return loop;
  }

  enum class Part : unsigned char { kNone, kTree, kCotree, kBasis };

  void set_part(int half, Part part) {
    part_[index(half)] = part_[index(twin_[index(half)])] = part;
  }

  /// A tree of triangles across edges that the tree of vertices leaves; what both leave is a basis.
  void find_cotree() {
    up_.assign(static_cast<std::size_t>(surface_.triangles.cols()), -1);
    std::vector<char> seen(up_.size(), 0);
    std::vector<int> queue = {0};
    seen[0] = 1;
    for (std::size_t next = 0; next < queue.size(); ++next) {
      for (int half = 3 * queue[next]; half < 3 * queue[next] + 3; ++half) {
        const int across = twin_[index(half)] / 3;
        if (part_[index(half)] != Part::kNone || seen[index(across)] != 0) continue;
        set_part(half, Part::kCotree);
        seen[index(across)] = 1;
        up_[index(across)] = twin_[index(half)];
        queue.push_back(across);
      }
    }
    for (int half = 0; half < count(); ++half) {
      if (part_[index(half)] != Part::kNone) continue;
      set_part(half, Part::kBasis);
      basis_.push_back(half);
    }
  }

  /// Each dual loop: across its edge of the basis, and back by the tree of triangles.
  void mark_crossings() {
    for (std::size_t k = 0; k < basis_.size(); ++k) {
      const auto flip = [&](int half) {
        crosses_[index(half)].flip(k);
        crosses_[index(twin_[index(half)])].flip(k);
      };
      flip(basis_[k]);
      for (int triangle : {basis_[k] / 3, twin_[index(basis_[k])] / 3}) {
        while (up_[index(triangle)] >= 0) {
          const int half = up_[index(triangle)];
          flip(half);
          triangle = twin_[index(half)] / 3;
        }
      }
    }
  }

  /// Which loops of the basis (an edge, and the tree's ways to its ends) cross each other: those
  /// whose ends alternate on a walk round the tree.
  void find_crossing_pairs() {
    std::unordered_map<int, std::size_t> number;
    for (std::size_t k = 0; k < basis_.size(); ++k) {
      number[basis_[k]] = number[twin_[index(basis_[k])]] = k;
    }
    std::vector<std::size_t> ends;
    const int start = out_of_[index(from(0))];
    int half = start;
    do {
      if (part_[index(half)] == Part::kBasis) ends.push_back(number.at(half));
      half = beside(part_[index(half)] == Part::kTree ? twin_[index(half)] : half);
    } while (half != start);
    pairs_.assign(basis_.size(), {});
    for (std::size_t k = 0; k < basis_.size(); ++k) {
      bool inside = false;
      for (const std::size_t end : ends) {
        if (end == k) {
          inside = !inside;
        } else if (inside) {
          pairs_[k].flip(end);
        }
      }
    }
  }

  const Surface& surface_;
  std::vector<int> twin_;
  std::vector<Class> crosses_;  // of each half edge
  std::vector<int> out_of_;     // a half edge that leaves each vertex
  std::vector<Part> part_;
  std::vector<int> up_;     // the half edge by which a triangle leaves toward the cotree's root
  std::vector<int> basis_;  // half edges, one of each edge
  std::vector<Class> pairs_;
};

double sum_of(const std::vector<EdgeLoop>& loops) {
  double sum = 0.0;
  for (const EdgeLoop& loop : loops) sum += loop.length;
  return sum;
}

}  // namespace

std::vector<Handle> find_handles(const Surface& surface) {
  const SurfaceLoops all(surface);
  if (all.handles() == 0) return {};
  std::vector<EdgeLoop> loops;
  std::set<int> tried;
  const auto seek_from = [&](int base) {
    if (tried.size() >= kMostBases || !tried.insert(base).second) return;
    all.add_loops(base, loops);
    loops = all.choose(std::move(loops));
  };
  for (const int base : all.bases()) seek_from(base);
  for (double before = HUGE_VAL; sum_of(loops) < before;) {
    before = sum_of(loops);
    for (const EdgeLoop& loop : std::vector<EdgeLoop>(loops)) {
      for (const std::size_t third : {1U, 2U}) {
        seek_from(loop.vertices[third * loop.vertices.size() / 3]);
      }
    }
  }
  std::vector<Handle> handles;
  for (const EdgeLoop& loop : loops) {
    handles.push_back({all.middle_of(loop), loop.length / (2.0 * kPi)});
  }
  return handles;
}

}  // namespace wireplan::preprocess
