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

/// How wide a piece is round a point of its end: its largest inscribed radius nearby, to the faces
/// of the outermost voxels [mm]. In a flat end a ball is no larger than how far its middle lies
/// from the end, so one looks further where that is what holds it.
template <typename InPiece>
double width_near(const Part& part, const std::vector<float>& depth, const InPiece& in_piece,
                  const Vec3& point) {
  constexpr double kFurthest = 25.0, kHeld = 0.7;  // mm; of the way
  const double voxel = part.grid.spacing.mean();
  double widest = 0.0;
  for (double reach = std::max(3.0, 2.0 * part.grid.spacing.maxCoeff()); reach < kFurthest;
       reach *= 1.3) {
    for (const std::size_t n : voxels_in_ball(part.grid, point, reach)) {
      if (in_piece(n)) widest = std::max(widest, static_cast<double>(depth[n]));
    }
    if (widest < kHeld * reach) break;
  }
  return std::max(0.5 * voxel, widest - 0.25 * voxel);
}

/// From the middle of a piece's end to the nearest point of the joined ones.
struct Gap {
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

bool holds(const Box& box, const Voxel& v) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (v[axis] < box.first[axis] || v[axis] > box.last[axis]) return false;
  }
  return true;
}

/// What is joined, and how far each voxel is from it [mm].
struct JoinedPieces {
  Labels marked;
  std::vector<float> away;
};

/// A joined voxel that is as far from this one as the nearest of them: each row that meets the
/// sphere holds two that may be, so that a far one costs no more than the sphere's area.
std::size_t find_nearest(const Grid& grid, const JoinedPieces& joined, std::size_t voxel) {
  const Voxel at = voxel_at(grid, voxel);
  const Box whole{{0, 0, 0}, {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1}};
  const double distance = static_cast<double>(joined.away[voxel]);
  const auto most = [&](int axis) {
    return static_cast<int>(std::ceil(distance / grid.spacing[axis])) + 1;
  };
  double nearest = std::numeric_limits<double>::infinity();
  std::size_t found = voxel;
  for (int dk = -most(2); dk <= most(2); ++dk) {
    for (int dj = -most(1); dj <= most(1); ++dj) {
      const double beside = Vec3(0.0, dj * grid.spacing[1], dk * grid.spacing[2]).squaredNorm();
      const double along = std::sqrt(std::max(0.0, distance * distance - beside));
      const int di = static_cast<int>(std::lround(along / grid.spacing[0]));
      for (const int i : {-di, di}) {
        const Voxel there{at[0] + i, at[1] + dj, at[2] + dk};
        const double here = beside + std::pow(i * grid.spacing[0], 2);
        if (here >= nearest || !holds(whole, there)) continue;
        if (joined.marked[index_of(grid, there)] == 0) continue;
        nearest = here;
        found = index_of(grid, there);
      }
    }
  }
  return found;
}

/// The gap of the piece: none where all of it is further from the joined ones than `furthest`.
Gap find_gap(const Part& part, const PieceOfLabels& piece, const JoinedPieces& joined,
             double furthest) {
  Gap gap;
  float least = std::numeric_limits<float>::infinity();
  for (const std::size_t n : piece.voxels) least = std::min(least, joined.away[n]);
  if (least > furthest) return gap;
  // The end's middle: of all voxels that are hardly further than the nearest.
  const auto near = least + static_cast<float>(0.75 * part.grid.spacing.maxCoeff());
  Vec3 sum = Vec3::Zero();
  double count = 0.0;
  for (const std::size_t n : piece.voxels) {
    if (joined.away[n] > near) continue;
    sum += center_of(part.grid, n);
    count += 1.0;
  }
  const Vec3 middle = sum / count;
  double distance = std::numeric_limits<double>::infinity();
  std::size_t to_voxel = piece.voxels.front();
  for (const std::size_t n : piece.voxels) {
    const Vec3 p = center_of(part.grid, n);
    if (joined.away[n] > near || (p - middle).norm() >= distance) continue;
    distance = (p - middle).norm();
    to_voxel = n;
    gap.to = p;
  }
  gap.from_voxel = find_nearest(part.grid, joined, to_voxel);
  gap.from = center_of(part.grid, gap.from_voxel);
  gap.free_mm = free_way(part.grid, gap.from, gap.to);
  return gap;
}

/// Marks the voxels as joined, and finds anew how far all within `known` [mm] of them are:
/// elsewhere the distances are above `known`, if too large. Returns the box of what was found anew.
Box join(const Part& part, const std::vector<std::size_t>& voxels, double known,
         JoinedPieces& joined) {
  const Voxel first = voxel_at(part.grid, voxels.front());
  Box box{first, first};
  for (const std::size_t n : voxels) {
    const Voxel v = voxel_at(part.grid, n);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.first[axis] = std::min(box.first[axis], v[axis]);
      box.last[axis] = std::max(box.last[axis], v[axis]);
    }
    joined.marked[n] = 1;
  }
  box = grown(box, known, part.grid);
  const Grid local = cropped(part.grid, box);
  const std::vector<float> away = distance_to(1, local, crop_values(part.grid, box, joined.marked));
  std::size_t k = 0;
  for_each_row(part.grid, box, [&](std::size_t start) {
    for (int i = 0; i < local.size[0]; ++i, ++k) {
      float& here = joined.away[start + static_cast<std::size_t>(i)];
      here = std::min(here, away[k]);
    }
  });
  return box;
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

bool reaches_into(const Part& part, const PieceOfLabels& piece, const Box& box) {
  return std::any_of(piece.voxels.begin(), piece.voxels.end(),
                     [&](std::size_t n) { return holds(box, voxel_at(part.grid, n)); });
}

/// Tells of the pieces how far they are from the joined ones, and takes them out.
void leave_out(Part& part, const std::vector<PieceOfLabels>& pieces, JoinedPieces& joined,
               LabelMask& made) {
  joined.away = distance_to(1, part.grid, joined.marked);
  for (const PieceOfLabels& piece : pieces) {
    const Gap gap = find_gap(part, piece, joined, std::numeric_limits<double>::infinity());
    made.lost.push_back({piece.of, gap.to, gap.free_mm,
                         part.grid.spacing.prod() * static_cast<double>(piece.voxels.size())});
    for (const std::size_t n : piece.voxels) part.class_of[n] = 0;
  }
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
  if (pieces.size() == 1) return;
  const Grid& grid = part.grid;
  JoinedPieces joined{.marked = Labels(part.class_of.size(), 0), .away = {}};
  for (const std::size_t n : pieces.front().voxels) joined.marked[n] = 1;
  joined.away = distance_to(1, grid, joined.marked);
  pieces.erase(pieces.begin());
  Labels inside(part.class_of.size(), 0);
  for (std::size_t n = 0; n < inside.size(); ++n) inside[n] = part.class_of[n] != 0 ? 1 : 0;
  const std::vector<float> depth = distance_to(0, grid, inside);
  // Half a voxel's diagonal of a way is in the voxel at each of its ends.
  const double furthest = most_gap + grid.spacing.norm();
  std::vector<Gap> gaps(pieces.size());
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    gaps[k] = find_gap(part, pieces[k], joined, furthest);
  }
  while (!pieces.empty()) {
    const auto least = std::min_element(
        gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.free_mm < b.free_mm; });
    if (least->free_mm >= most_gap) {
      leave_out(part, pieces, joined, made);
      return;
    }
    const Gap gap = *least;
    const std::ptrdiff_t which = least - gaps.begin();
    PieceOfLabels piece = std::move(pieces[static_cast<std::size_t>(which)]);
    pieces.erase(pieces.begin() + which);
    gaps.erase(gaps.begin() + which);
    const auto in_joined = [&](std::size_t n) { return joined.marked[n] != 0; };
    for (const std::size_t n : piece.voxels) inside[n] = 2;
    const double radius =
        std::max(kThroughFaces * grid.spacing.maxCoeff(),
                 std::min(width_near(part, depth, in_joined, gap.from),
                          width_near(
                              part, depth, [&](std::size_t n) { return inside[n] == 2; }, gap.to)));
    for (const std::size_t n : piece.voxels) inside[n] = 1;
    const std::uint8_t from = part.class_of[gap.from_voxel];
    made.bridges.push_back({static_cast<std::size_t>(from) - 1, piece.of, 0.5 * (gap.from + gap.to),
                            gap.free_mm, radius});
    fill_bridge(part, gap, radius, static_cast<std::uint8_t>(piece.of + 1), piece.voxels);
    const Box changed = join(part, piece.voxels, furthest + grid.spacing.maxCoeff(), joined);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      if (reaches_into(part, pieces[k], changed)) {
        gaps[k] = find_gap(part, pieces[k], joined, furthest);
      }
    }
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
