#include "preprocess/volume/label_frame.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

constexpr double kTolerance = 0.1;         // of a voxel
constexpr double kAside = 1e-6;            // of a voxel: to no side of a tie
constexpr std::size_t kFewestEdges = 100;  // of which chance may find enough elsewhere

bool is_identity(const Mat3& m) { return (m - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-3; }

std::string text_of(double value) {
  return number_text(std::abs(value) < 5e-4 ? 0.0 : std::round(value * 1000.0) / 1000.0);
}

/// To a tenth, however large it is [mm].
std::string place_of(double value) {
  std::ostringstream text;
  text << std::setprecision(10) << std::round(value * 10.0) / 10.0 + 0.0;  // no "-0"
  return text.str();
}

/// Grids that hold the same centres, in whatever order of axes and slices.
bool same_centres(const Grid& a, const Grid& b) {
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 ijk((corner & 1) * (a.size[0] - 1), (corner >> 1 & 1) * (a.size[1] - 1),
                   (corner >> 2) * (a.size[2] - 1));
    const Vec3 there = b.ijk_from_lps(a.lps_from_ijk(ijk));
    for (int axis = 0; axis < 3; ++axis) {
      const double end = b.size[axis] - 1;
      if (std::min(std::abs(there[axis]), std::abs(there[axis] - end)) > kTolerance) return false;
    }
  }
  return a.voxels() == b.voxels();
}

// ---- edges of labels in the volume
// ---------------------------------------------------------------

/// A voxel's centre just inside a label's edge, and one as far outside [mm].
struct EdgePair {
  Vec3 inside, outside;
};

/// The edges of labels: toward what is none of them, and between two classes, of which the first
/// has the inside.
struct Edges {
  std::vector<EdgePair> outer;
  std::map<std::pair<std::uint8_t, std::uint8_t>, std::vector<EdgePair>> inner;
};

/// At most so many pairs, evenly taken from all of an edge.
std::vector<EdgePair> thinned_out(const std::vector<EdgePair>& pairs, std::size_t most) {
  if (pairs.size() <= most) return pairs;
  std::vector<EdgePair> some;
  for (std::size_t k = 0; k < most; ++k) some.push_back(pairs[k * pairs.size() / most]);
  return some;
}

/// Of all classes, or of one where it is given. A point lies one voxel from the edge, where that is
/// still on its side: in a thin tube or gap, or where they are to lie `close`, it is at the edge.
Edges find_edges(const Grid& grid, const std::vector<std::uint8_t>& classes, std::uint8_t only,
                 bool close) {
  Edges edges;
  const std::array<std::size_t, 3> stride = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  for (int k = 2; k + 3 < grid.size[2]; ++k) {
    for (int j = 2; j + 3 < grid.size[1]; ++j) {
      for (int i = 2; i + 3 < grid.size[0]; ++i) {
        const std::size_t n = grid.index(i, j, k);
        for (int axis = 0; axis < 3; ++axis) {
          const std::size_t step = stride[static_cast<std::size_t>(axis)];
          const std::uint8_t here = classes[n], next = classes[n + step];
          if (here == next || (only != 0 && here != only && next != only)) continue;
          const bool outer = here == 0 || next == 0;
          const auto same_side = [&](std::size_t at, std::uint8_t one) {
            return outer ? (classes[at] == 0) == (one == 0) : classes[at] == one;
          };
          Vec3 low(i, j, k), high(i, j, k);
          low[axis] -= !close && same_side(n - step, here) ? 1.0 : 0.0;
          high[axis] += !close && same_side(n + 2 * step, next) ? 2.0 : 1.0;
          const Vec3 a = grid.lps_from_ijk(low), b = grid.lps_from_ijk(high);
          const bool first = outer ? here != 0 : here < next;
          std::vector<EdgePair>& to =
              outer ? edges.outer : edges.inner[{std::min(here, next), std::max(here, next)}];
          to.push_back(first ? EdgePair{a, b} : EdgePair{b, a});
        }
      }
    }
  }
  constexpr std::size_t kMost = 3000;
  edges.outer = thinned_out(edges.outer, kMost);
  for (auto& [of, pairs] : edges.inner) pairs = thinned_out(pairs, kMost);
  return edges;
}

/// The volume's values, held between what counts as dark and as bright: 0 to 600 HU in a CT, so
/// that neither lungs nor metal weigh; elsewhere between its median and its brightest.
class Brightness {
 public:
  explicit Brightness(const Image& image) : image_(image) {
    constexpr float kAir = -500.0F;
    const bool ct = image.modality == "CT" ||
                    (image.modality.empty() &&
                     *std::min_element(image.values.begin(), image.values.end()) < kAir);
    if (ct) return;
    std::vector<float> some;
    const std::size_t step = std::max<std::size_t>(1, image.values.size() / 100000);
    for (std::size_t n = 0; n < image.values.size(); n += step) some.push_back(image.values[n]);
    std::sort(some.begin(), some.end());
    low_ = static_cast<double>(some[some.size() / 2]);
    high_ = std::max(low_ + 1e-6, static_cast<double>(some[some.size() * 995 / 1000]));
  }

  std::optional<double> at(const Vec3& point) const {
    const std::optional<Voxel> voxel = nearest_voxel(image_.grid, point);
    if (!voxel) return {};
    const auto value = static_cast<double>(image_.values[index_of(image_.grid, *voxel)]);
    return (std::clamp(value, low_, high_) - low_) / (high_ - low_) * kScale;
  }

  /// Mean step inward over the edge, as the change moves it [HU].
  double contrast(const std::vector<EdgePair>& pairs, const FrameChange& change) const {
    constexpr double kMost = 200.0;
    double sum = 0.0;
    for (const EdgePair& pair : pairs) {
      const auto inside = at(change.linear * pair.inside + change.shift),
                 outside = at(change.linear * pair.outside + change.shift);
      if (inside && outside) sum += std::clamp(*inside - *outside, -kMost, kMost);
    }
    return pairs.empty() ? 0.0 : sum / static_cast<double>(pairs.size());
  }

 private:
  static constexpr double kScale = 600.0;
  const Image& image_;
  double low_ = 0.0, high_ = kScale;
};

/// Mirrored along the grid's axes round a place; x, y or both negated too where that is asked for.
std::vector<FrameChange> mirrored(const Grid& grid, const Vec3& middle, bool negated) {
  std::vector<FrameChange> changes;
  for (int which = 1; which < 8; ++which) {
    const Vec3 signs((which & 1) != 0 ? -1 : 1, (which & 2) != 0 ? -1 : 1,
                     (which & 4) != 0 ? -1 : 1);
    const Mat3 m = grid.direction * signs.asDiagonal() * grid.direction.transpose();
    changes.push_back({.linear = m, .shift = middle - m * middle});
    if (negated && which < 4) changes.push_back({.linear = Mat3(signs.asDiagonal())});
  }
  return changes;
}

/// Axes of the file in another order under the volume's header, as where programs count z, y, x.
std::vector<FrameChange> reordered(const Grid& grid) {
  std::vector<FrameChange> changes;
  std::array<int, 3> order = {0, 1, 2};
  while (std::next_permutation(order.begin(), order.end())) {
    Mat3 swap = Mat3::Zero();
    std::string text;
    for (int axis = 0; axis < 3; ++axis) {
      const int from = order[static_cast<std::size_t>(axis)];
      swap(axis, from) = grid.spacing[axis] / grid.spacing[from];
      text += (axis == 0 ? "" : ", ") + std::string(1, "ijk"[from]);
    }
    const Mat3 m = grid.direction * swap * grid.direction.transpose();
    changes.push_back({m, grid.origin - m * grid.origin, text});
  }
  return changes;
}

/// Finds where pairs that are moved by shifts are seen best, all of them on a lattice round a
/// place. Along a straight vessel all are alike: then the shortest.
Vec3 best_on_lattice(const Brightness& brightness, const std::vector<EdgePair>& pairs,
                     const Vec3& around, double reach, double step) {
  constexpr double kPerMm = 2.0;  // HU; half a voxel aside costs some 10
  double most = -std::numeric_limits<double>::infinity();
  Vec3 found = around;
  const int n = static_cast<int>(std::lround(reach / step));
  for (int k = -n; k <= n; ++k) {
    for (int j = -n; j <= n; ++j) {
      for (int i = -n; i <= n; ++i) {
        const FrameChange change{.shift = around + step * Vec3(i, j, k)};
        const double here = brightness.contrast(pairs, change) - kPerMm * change.shift.norm();
        if (here <= most) continue;
        most = here;
        found = change.shift;
      }
    }
  }
  return found;
}

/// The best shift by up to 20 mm: on every second voxel at first, then round the best, to half a
/// voxel.
Vec3 best_shift(const Grid& grid, const Brightness& brightness,
                const std::vector<EdgePair>& pairs) {
  constexpr double kReach = 20.0;
  const std::vector<EdgePair> few = thinned_out(pairs, 200);
  const double voxel = std::cbrt(grid.spacing.prod()), coarse = std::max(2.0, 2.0 * voxel);
  Vec3 shift = best_on_lattice(brightness, few, Vec3::Zero(), kReach, coarse);
  shift = best_on_lattice(brightness, pairs, shift, coarse, 0.5 * coarse);
  return best_on_lattice(brightness, pairs, shift, 0.5 * coarse, 0.25 * coarse);
}

/// The middle of the box round what is labelled, of all classes or of one.
Vec3 middle_of(const Grid& grid, const std::vector<std::uint8_t>& classes, std::uint8_t only) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const std::uint8_t one = classes[grid.index(i, j, k)];
        if (one == 0 || (only != 0 && one != only)) continue;
        low = low.cwiseMin(Vec3(i, j, k));
        high = high.cwiseMax(Vec3(i, j, k));
      }
    }
  }
  return grid.lps_from_ijk(0.5 * (low + high));
}

/// Mirrored round their own middle, as within a crop of their own, and shifted.
std::vector<FrameChange> mirrored_and_shifted(const Grid& grid, const Vec3& middle,
                                              const Brightness& brightness,
                                              const std::vector<EdgePair>& pairs) {
  std::vector<FrameChange> changes = mirrored(grid, middle, /*negated=*/false);
  for (FrameChange& change : changes) {
    std::vector<EdgePair> moved;
    for (const EdgePair& pair : pairs) {
      moved.push_back({change.linear * pair.inside + change.shift,
                       change.linear * pair.outside + change.shift});
    }
    change.shift += best_shift(grid, brightness, moved);
  }
  return changes;
}

/// How clearly the volume shows edges between two classes, whichever of them is the brighter [HU].
double inner_contrast(const Brightness& brightness, const Edges& edges) {
  double most = 0.0;
  for (const auto& [classes, pairs] : edges.inner) {
    if (pairs.size() >= kFewestEdges) {
      most = std::max(most, std::abs(brightness.contrast(pairs, {})));
    }
  }
  return most;
}

}  // namespace

std::string describe_change(const FrameChange& change) {
  if (!change.order.empty()) {
    return "stored in another order of axes: its voxel [i, j, k] is the volume's [" + change.order +
           "]";
  }
  const Vec3& t = change.shift;
  const auto triple = [](const Vec3& v) {
    return "(" + place_of(v.x()) + ", " + place_of(v.y()) + ", " + place_of(v.z()) + ")";
  };
  if (is_identity(change.linear)) return "shifted by " + triple(t) + " mm";
  const bool signs = (change.linear.cwiseAbs() - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-3;
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    if (signs && change.linear(axis, axis) > 0.0 && std::abs(t[axis]) < 1e-3) continue;
    if (!text.empty()) text += ", ";
    if (signs) {
      text += name + "' = " + place_of(t[axis]) +
              (change.linear(axis, axis) < 0.0 ? " - " : " + ") + name;
    } else {
      text += name + "' = (" + text_of(change.linear(axis, 0)) + ", " +
              text_of(change.linear(axis, 1)) + ", " + text_of(change.linear(axis, 2)) +
              ") . p + " + place_of(t[axis]);
    }
  }
  if (!signs) return "turned by " + text + " in LPS mm";
  std::string axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (change.linear(axis, axis) < 0.0)
      axes += (axes.empty() ? "" : " and ") + std::string(1, "xyz"[axis]);
  }
  return "mirrored in " + axes + ": " + text + " in LPS mm";
}

std::optional<FrameChange> find_contradiction(const Grid& labels, const Grid& volume) {
  if (labels.size != volume.size || same_centres(labels, volume)) return {};
  // Spacings that move no voxel of the grid's other end by a tenth are the same.
  const Eigen::Array3d count(volume.size[0], volume.size[1], volume.size[2]);
  const Eigen::Array3d off = (labels.spacing - volume.spacing).array().abs() * count;
  if ((off > kTolerance * volume.spacing.array()).any()) return {};
  FrameChange change;
  change.linear = volume.direction * labels.direction.transpose();
  change.shift = volume.origin - change.linear * labels.origin;
  return change;
}

bool shares_lattice(const Grid& from, const Grid& to) {
  const Mat3 step = to.spacing.cwiseInverse().asDiagonal() * to.direction.transpose() *
                    from.direction * from.spacing.asDiagonal();
  const Vec3 start = to.ijk_from_lps(from.origin);
  const double longest = *std::max_element(from.size.begin(), from.size.end());
  const Mat3 whole = step.array().round().matrix();
  return ((start.array() - start.array().round()).abs() < kTolerance).all() &&
         (whole.cwiseAbs().rowwise().sum().array() == 1.0).all() &&
         (step - whole).cwiseAbs().maxCoeff() * longest < kTolerance;
}

std::vector<std::uint8_t> onto_grid(const Grid& to, const Grid& from,
                                    const std::vector<std::uint8_t>& classes) {
  expects(classes.size() == from.voxels());
  std::vector<std::uint8_t> result(to.voxels(), 0);
  const bool aligned = shares_lattice(from, to);
#pragma omp parallel for schedule(static)
  for (int k = 0; k < to.size[2]; ++k) {
    std::array<std::uint8_t, 8> label{};
    std::array<double, 8> weight{};
    for (int j = 0; j < to.size[1]; ++j) {
      for (int i = 0; i < to.size[0]; ++i) {
        Vec3 p = from.ijk_from_lps(to.lps_from_ijk(Vec3(i, j, k)));
        // Half way between two centres, as where spacings are multiples, one side of a vessel gains
        // what the other loses.
        p = aligned ? p.array().round().matrix().eval() : (p.array() + kAside).matrix().eval();
        const Vec3 low = p.array().floor().matrix(), part = p - low;
        std::size_t found = 0;
        double inside = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
          double share = 1.0;
          Voxel v{};
          bool there = true;
          for (int axis = 0; axis < 3; ++axis) {
            const int up = corner >> axis & 1;
            share *= up != 0 ? part[axis] : 1.0 - part[axis];
            const double at = low[axis] + up;
            there = there && at >= 0.0 && at < from.size[axis];
            v[axis] = there ? static_cast<int>(at) : 0;
          }
          if (!there || share == 0.0) continue;
          const std::uint8_t one = classes[index_of(from, v)];
          if (one == 0) continue;
          inside += share;
          std::size_t at = 0;
          while (at < found && label[at] != one) ++at;
          if (at == found) {
            label[found] = one;
            weight[found++] = 0.0;
          }
          weight[at] += share;
        }
        if (inside < 0.5) continue;
        const auto largest =
            std::max_element(weight.begin(), weight.begin() + static_cast<std::ptrdiff_t>(found));
        result[to.index(i, j, k)] = label[static_cast<std::size_t>(largest - weight.begin())];
      }
    }
  }
  return result;
}

std::optional<FrameChange> find_better_frame(const Image& image,
                                             const std::vector<std::uint8_t>& classes,
                                             double& contrast, std::uint8_t only) {
  expects(classes.size() == image.grid.voxels());
  // Seen well: a mean step of a fifth of the usual contrast. As they lie: less than a third of it;
  // half of it where they are seen too well for labels that are drawn too narrow or too wide. A
  // mirror that is moved as well has more ways to fit by chance.
  constexpr double kSeen = 80.0, kPart = 0.35, kClear = 140.0, kPartOfClear = 0.5, kByChance = 1.15;
  const Grid& grid = image.grid;
  const Edges edges = find_edges(grid, classes, only, /*close=*/false);
  const Brightness brightness(image);
  contrast = brightness.contrast(edges.outer, {});
  if (only != 0 && edges.outer.size() < kFewestEdges) {
    contrast = std::numeric_limits<double>::quiet_NaN();
  }
  if (!(contrast < kSeen)) return {};
  if (const double inner = inner_contrast(brightness, edges); inner >= kSeen) {
    contrast = inner;  // a wall round its lumen
    return {};
  }
  std::optional<FrameChange> best;
  double most = kSeen;
  const auto try_change = [&](const FrameChange& change, double least) {
    const double here = brightness.contrast(edges.outer, change);
    if (here < least || contrast > (here < kClear ? kPart : kPartOfClear) * here) return;
    most = here;
    best = change;
  };
  const Vec3 middle =
      grid.lps_from_ijk(0.5 * Vec3(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1));
  for (const FrameChange& change : mirrored(grid, middle, /*negated=*/true))
    try_change(change, most);
  for (const FrameChange& change : reordered(grid)) try_change(change, most);
  try_change({.shift = best_shift(grid, brightness, edges.outer)}, most);
  for (const FrameChange& change :
       mirrored_and_shifted(grid, middle_of(grid, classes, only), brightness, edges.outer)) {
    try_change(change, kByChance * most);
  }
  return best;
}

std::optional<FrameChange> find_near_shift(const Image& image,
                                           const std::vector<std::uint8_t>& classes) {
  expects(classes.size() == image.grid.voxels());
  // By more than half a voxel, by which programs' habits differ, and more than noise makes; steps
  // of less than half a voxel, as the nearest one tells the value; chosen.
  constexpr double kReach = 3.0, kStep = 0.49, kLeast = 0.9, kGain = 1.15;
  const Edges edges = find_edges(image.grid, classes, 0, /*close=*/true);
  if (edges.outer.size() < kFewestEdges) return {};
  const Brightness brightness(image);
  const double voxel = std::cbrt(image.grid.spacing.prod());
  FrameChange near;
  near.shift = best_on_lattice(brightness, thinned_out(edges.outer, 1000), Vec3::Zero(),
                               kReach * voxel, kStep * voxel);
  const double here = brightness.contrast(edges.outer, {}),
               there = brightness.contrast(edges.outer, near);
  if (near.shift.norm() < kLeast * voxel || there < kGain * here) return {};
  // Labels that are drawn too narrow or too wide are seen better moved to either side.
  if (brightness.contrast(edges.outer, {.shift = -near.shift}) >= here) return {};
  return near;
}

}  // namespace wireplan::preprocess
