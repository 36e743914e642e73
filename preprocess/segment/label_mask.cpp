#include "preprocess/segment/label_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

/// The part of the grid that holds classes, with room round it for bridges.
struct Part {
  Box box;
  Grid grid;
  Labels class_of;
};

struct PieceOfLabels {
  std::vector<std::size_t> voxels;
  std::size_t of = 0;  // index of the class that most of it is
};

/// Connected through voxel faces, the largest first.
std::vector<PieceOfLabels> find_pieces(const Part& part) {
  std::vector<PieceOfLabels> pieces;
  Labels seen(part.class_of.size(), 0);
  for (std::size_t start = 0; start < seen.size(); ++start) {
    if (part.class_of[start] == 0 || seen[start] != 0) continue;
    std::vector<std::size_t> queue = {start};
    seen[start] = 1;
    for (std::size_t next = 0; next < queue.size(); ++next) {
      for_each_face_neighbour(part.grid, queue[next], [&](std::size_t m) {
        if (part.class_of[m] == 0 || seen[m] != 0) return;
        seen[m] = 1;
        queue.push_back(m);
      });
    }
    std::array<std::size_t, 256> counts{};
    for (const std::size_t n : queue) ++counts[part.class_of[n]];
    const auto most = std::max_element(counts.begin() + 1, counts.end());
    pieces.push_back({std::move(queue), static_cast<std::size_t>(most - counts.begin()) - 1});
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const auto& a, const auto& b) { return a.voxels.size() > b.voxels.size(); });
  return pieces;
}

Labels mark(const Part& part, const std::vector<std::size_t>& voxels) {
  Labels marked(part.class_of.size(), 0);
  for (const std::size_t n : voxels) marked[n] = 1;
  return marked;
}

/// Those with a face neighbour that is not among them, as marked.
std::vector<std::size_t> border_of(const Grid& grid, const std::vector<std::size_t>& voxels,
                                   const Labels& marked) {
  std::vector<std::size_t> border;
  for (const std::size_t n : voxels) {
    bool outside = false;
    for_each_face_neighbour(grid, n, [&](std::size_t m) { outside = outside || marked[m] == 0; });
    if (outside) border.push_back(n);
  }
  return border;
}

/// How wide a piece is round a point of its end: its largest inscribed radius nearby, to the faces
/// of the outermost voxels [mm]. In a flat end a ball is no larger than how far its middle lies
/// from the end, so one looks further where that is what holds it.
double width_near(const Part& part, const std::vector<float>& depth, const Labels& piece,
                  const Vec3& point) {
  constexpr double kFurthest = 25.0, kHeld = 0.7;  // mm; of the way
  const double voxel = part.grid.spacing.mean();
  double widest = 0.0;
  for (double reach = std::max(3.0, 2.0 * part.grid.spacing.maxCoeff()); reach < kFurthest;
       reach *= 1.3) {
    for (const std::size_t n : voxels_in_ball(part.grid, point, reach)) {
      if (piece[n] != 0) widest = std::max(widest, static_cast<double>(depth[n]));
    }
    if (widest < kHeld * reach) break;
  }
  return std::max(0.5 * voxel, widest - 0.25 * voxel);
}

/// From the middle of a piece's end to the nearest point of the joined ones.
struct Gap {
  std::size_t piece = 0;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  // in the joined ones; in the piece          [mm]
  double free_mm = std::numeric_limits<double>::infinity();
  std::size_t from_voxel = 0;
};

/// How much of a straight way between two centres lies outside of both voxels [mm].
double free_way(const Grid& grid, const Vec3& a, const Vec3& b) {
  const Vec3 way = (grid.direction.transpose() * (b - a)).cwiseAbs();
  const double length = way.norm();
  if (length == 0.0) return 0.0;
  double part_in_voxel = std::numeric_limits<double>::infinity();  // of the way, in one voxel
  for (int axis = 0; axis < 3; ++axis) {
    if (way[axis] > 0.0)
      part_in_voxel = std::min(part_in_voxel, 0.5 * grid.spacing[axis] / way[axis]);
  }
  return std::max(0.0, 1.0 - 2.0 * part_in_voxel) * length;
}

/// The gap of the piece, given how far each voxel is from the joined ones, and their border.
Gap find_gap(const Part& part, const PieceOfLabels& piece, std::size_t index,
             const std::vector<float>& away, const std::vector<std::size_t>& border) {
  Gap gap{.piece = index};
  float least = std::numeric_limits<float>::infinity();
  for (const std::size_t n : piece.voxels) least = std::min(least, away[n]);
  // The end's middle: of all voxels that are hardly further than the nearest.
  const auto near = least + static_cast<float>(0.75 * part.grid.spacing.maxCoeff());
  Vec3 sum = Vec3::Zero();
  double count = 0.0;
  for (const std::size_t n : piece.voxels) {
    if (away[n] > near) continue;
    sum += center_of(part.grid, n);
    count += 1.0;
  }
  const Vec3 middle = sum / count;
  double distance = std::numeric_limits<double>::infinity();
  for (const std::size_t n : piece.voxels) {
    const Vec3 p = center_of(part.grid, n);
    if (away[n] > near || (p - middle).norm() >= distance) continue;
    distance = (p - middle).norm();
    gap.to = p;
  }
  distance = std::numeric_limits<double>::infinity();
  for (const std::size_t n : border) {
    const Vec3 p = center_of(part.grid, n);
    const double here = (p - gap.to).norm();
    if (here >= distance) continue;
    distance = here;
    gap.from = p;
    gap.from_voxel = n;
  }
  gap.free_mm = free_way(part.grid, gap.from, gap.to);
  return gap;
}

/// Fills the way between both ends, and a radius into each of them.
void fill_bridge(Part& part, const Gap& gap, double radius, std::uint8_t as,
                 std::vector<std::size_t>& joined) {
  const Vec3 way = gap.to - gap.from;
  const double length = way.norm();
  const double step = 0.5 * part.grid.spacing.minCoeff();
  for (double at = -0.5 * radius; at <= length + 0.5 * radius; at += step) {
    const Vec3 p = gap.from + at / length * way;
    if (!nearest_voxel(part.grid, p)) continue;
    for (const std::size_t n : voxels_in_ball(part.grid, p, radius)) {
      if (part.class_of[n] != 0) continue;
      part.class_of[n] = as;
      joined.push_back(n);
    }
  }
  // A thin way between centres, through voxel faces: in a grid of long voxels a ball may miss some.
  for (double at = 0.0; at <= length; at += 0.2 * step) {
    const std::optional<Voxel> v = nearest_voxel(part.grid, gap.from + at / length * way);
    if (!v || part.class_of[index_of(part.grid, *v)] != 0) continue;
    part.class_of[index_of(part.grid, *v)] = as;
    joined.push_back(index_of(part.grid, *v));
  }
}

Part cut_part(const LabelVolume& labels, double margin) {
  Part part;
  const auto first = std::find_if(labels.class_of.begin(), labels.class_of.end(),
                                  [](auto one) { return one != 0; });
  expects(first != labels.class_of.end());
  const Voxel seed =
      voxel_at(labels.grid, static_cast<std::size_t>(first - labels.class_of.begin()));
  part.box = grown(bounding_box(labels.grid, labels.class_of, {seed, seed}), margin, labels.grid);
  part.grid = cropped(labels.grid, part.box);
  part.class_of = crop_values(labels.grid, part.box, labels.class_of);
  return part;
}

/// Closed cavities become what lies beside them.
void fill_closed(Part& part) {
  Labels inside(part.class_of.size(), 0);
  for (std::size_t n = 0; n < inside.size(); ++n) inside[n] = part.class_of[n] != 0 ? 1 : 0;
  fill_cavities(part.grid, inside, std::numeric_limits<double>::infinity());
  bool filled = true;
  while (filled) {
    filled = false;
    for (std::size_t n = 0; n < inside.size(); ++n) {
      if (inside[n] == 0 || part.class_of[n] != 0) continue;
      for_each_face_neighbour(part.grid, n, [&](std::size_t m) {
        if (part.class_of[n] == 0) part.class_of[n] = part.class_of[m];
      });
      filled = filled || part.class_of[n] != 0;
    }
  }
}

/// A ball of so many voxels round any point on a space diagonal holds face neighbours all along it:
/// sqrt(2 / 3) and a little.
constexpr double kThroughFaces = 0.85;

/// Refuses more pieces, the largest first, than a vessel has; specks do not count.
void require_few(const std::vector<PieceOfLabels>& pieces, std::size_t most) {
  if (pieces.size() <= most || pieces[most].voxels.size() < kLeastPiece) return;
  const auto count = std::count_if(pieces.begin(), pieces.end(), [](const PieceOfLabels& piece) {
    return piece.voxels.size() >= kLeastPiece;
  });
  throw Error("the chosen classes lie in " + std::to_string(count) +
              " pieces that are not connected: noise, expected a vessel of at most " +
              std::to_string(most) +
              " pieces (four for each of mask.most_handles); choose the classes that are arteries, "
              "and smooth what noise left of them; if it is a vessel all the same, raise "
              "mask.most_handles");
}

/// Joins pieces to the first, and tells of those that stay alone.
void join_pieces(Part& part, std::vector<PieceOfLabels> pieces, double most_gap,
                 std::size_t most_pieces, LabelMask& made) {
  require_few(pieces, most_pieces);
  const double voxel = part.grid.spacing.prod();
  while (!pieces.empty() && pieces.back().voxels.size() < kLeastPiece && pieces.size() > 1) {
    made.lost_specks_mm3 += voxel * static_cast<double>(pieces.back().voxels.size());
    for (const std::size_t n : pieces.back().voxels) part.class_of[n] = 0;
    pieces.pop_back();
  }
  std::vector<std::size_t> joined = std::move(pieces.front().voxels);
  pieces.erase(pieces.begin());
  Labels inside(part.class_of.size(), 0);
  for (std::size_t n = 0; n < inside.size(); ++n) inside[n] = part.class_of[n] != 0 ? 1 : 0;
  const std::vector<float> depth =
      pieces.empty() ? std::vector<float>{} : distance_to(0, part.grid, inside);
  while (!pieces.empty()) {
    const Labels marked = mark(part, joined);
    const std::vector<float> away = distance_to(1, part.grid, marked);
    const std::vector<std::size_t> border = border_of(part.grid, joined, marked);
    std::vector<Gap> gaps;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      gaps.push_back(find_gap(part, pieces[k], k, away, border));
    }
    const Gap gap = *std::min_element(
        gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.free_mm < b.free_mm; });
    if (gap.free_mm >= most_gap) {
      for (const Gap& other : gaps) {
        const PieceOfLabels& piece = pieces[other.piece];
        made.lost.push_back(
            {piece.of, other.to, other.free_mm, voxel * static_cast<double>(piece.voxels.size())});
        for (const std::size_t n : piece.voxels) part.class_of[n] = 0;
      }
      return;
    }
    const std::size_t which = gap.piece;
    const Labels other = mark(part, pieces[which].voxels);
    const double radius = std::max(kThroughFaces * part.grid.spacing.maxCoeff(),
                                   std::min(width_near(part, depth, marked, gap.from),
                                            width_near(part, depth, other, gap.to)));
    const std::uint8_t from = part.class_of[gap.from_voxel];
    made.bridges.push_back({static_cast<std::size_t>(from) - 1, pieces[which].of,
                            0.5 * (gap.from + gap.to), gap.free_mm, radius});
    joined.insert(joined.end(), pieces[which].voxels.begin(), pieces[which].voxels.end());
    fill_bridge(part, gap, radius, static_cast<std::uint8_t>(pieces[which].of + 1), joined);
    pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(which));
  }
}

}  // namespace

LabelMask merge_labels(const LabelVolume& labels, double most_gap, std::size_t most_pieces) {
  expects(labels.class_of.size() == labels.grid.voxels() && most_gap >= 0.0);
  Part part = cut_part(labels, most_gap);
  LabelMask made;
  join_pieces(part, find_pieces(part), most_gap, most_pieces, made);
  fill_closed(part);

  made.mask = {.grid = labels.grid, .labels = Labels(labels.grid.voxels(), 0)};
  made.class_of.assign(labels.grid.voxels(), 0);
  std::size_t n = 0, count = 0;
  for_each_row(labels.grid, part.box, [&](std::size_t start) {
    for (int i = 0; i < part.grid.size[0]; ++i, ++n) {
      if (part.class_of[n] == 0) continue;
      const std::size_t whole = start + static_cast<std::size_t>(i);
      made.mask.labels[whole] = 1;
      made.class_of[whole] = part.class_of[n];
      made.touches_border =
          made.touches_border || on_border(labels.grid, voxel_at(labels.grid, whole));
      ++count;
    }
  });
  made.volume_mm3 = static_cast<double>(count) * labels.grid.spacing.prod();
  return made;
}

double inscribed_radius(const Mask& mask, const Vec3& point, double most) {
  double radius = most;
  for (const std::size_t n : voxels_in_ball(mask.grid, point, most)) {
    if (mask.labels[n] == 0) radius = std::min(radius, (center_of(mask.grid, n) - point).norm());
  }
  return radius;
}

}  // namespace wireplan::preprocess
