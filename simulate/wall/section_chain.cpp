#include "simulate/wall/section_chain.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wireplan::simulate {

namespace {

/// Standard deviation of a node's bell curve over the spacing. Displacements that grow evenly along
/// the line come out within 0.5 % of the spacing times their slope, and four to five nodes carry a
/// place: wider curves do better and carry with more.
constexpr double kWidth = 0.6;

/// Parts of a node below the first are dropped, above the second they are whole, smoothly between.
constexpr double kDropped = 1e-3, kWhole = 8e-3;

/// What a node may add to the sum of the bell curves at most where it is not looked at: jumps of
/// the weights of this size are far below what a solve resolves.
constexpr double kUnseen = 1e-10;

constexpr double kLeastPower = -23.0;  // its logarithm

constexpr double kCell = 8.0;          // side of a cell                                      [mm]
constexpr double kChainMargin = 24.0;  // of the grid round the nodes                         [mm]
constexpr int kStepsPerNode = 4;       // places per spacing at which the energy is summed
constexpr double kShortest = 0.35;     // of the spacing: nearer nodes are taken for one

Vec3 point_on(const Centerline& line, double arc) {
  const Eigen::Index last = line.arc_length.size() - 1;
  Eigen::Index k = 0;
  while (k + 1 < last && line.arc_length[k + 1] < arc) ++k;
  if (last == 0) return line.points.col(0);
  const double length = line.arc_length[k + 1] - line.arc_length[k];
  const double part = length > 0.0 ? (arc - line.arc_length[k]) / length : 0.0;
  return line.points.col(k) + part * (line.points.col(k + 1) - line.points.col(k));
}

double radius_on(const Centerline& line, double arc) {
  const Eigen::Index last = line.arc_length.size() - 1;
  Eigen::Index k = 0;
  while (k + 1 < last && line.arc_length[k + 1] < arc) ++k;
  if (last == 0) return line.radius[0];
  const double length = line.arc_length[k + 1] - line.arc_length[k];
  const double part =
      length > 0.0 ? std::clamp((arc - line.arc_length[k]) / length, 0.0, 1.0) : 0.0;
  return line.radius[k] + part * (line.radius[k + 1] - line.radius[k]);
}

/// Of a pin at a distance: 1 within its radius, 0 from twice that on.
double held_part(double distance, double radius) {
  const double t = std::clamp(2.0 - distance / radius, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// q times a step that rises from 0 at kDropped to 1 at kWhole, with two derivatives.
struct Kept {
  double value, slope, curvature;
};
Kept keep(double q) {
  if (q <= kDropped) return {0.0, 0.0, 0.0};
  if (q >= kWhole) return {q, 1.0, 0.0};
  constexpr double range = kWhole - kDropped;
  const double t = (q - kDropped) / range;
  const double s = t * t * t * (10.0 + t * (6.0 * t - 15.0));
  const double ds = 30.0 * t * t * (1.0 - t) * (1.0 - t) / range;
  const double dds = 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / (range * range);
  return {q * s, s + q * ds, 2.0 * ds + q * dds};
}

}  // namespace

SectionChain::SectionChain(const std::vector<preprocess::Branch>& tree,
                           const SectionChainOptions& options)
    : width_(kWidth * options.spacing) {
  expects(!tree.empty() && options.support > 0.0 && options.young_modulus >= 0.0 &&
          options.thickness > 0.0 && options.spacing > 0.0);
  const std::vector<std::vector<Knot>> lines = place_nodes(tree, options.spacing);
  build_cells();
  const int n = nodes();
  std::vector<Block> dense;
  dense.reserve(static_cast<std::size_t>(n) * static_cast<std::size_t>(n + 1) / 2);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) dense.push_back({i, j, Mat3::Zero()});
  }
  for (std::size_t b = 0; b < tree.size(); ++b) {
    const preprocess::Branch& branch = tree[b];
    const double inside =
        branch.parent < 0
            ? 0.0
            : radius_on(tree[static_cast<std::size_t>(branch.parent)].line, branch.parent_arc);
    add_line(branch.line, inside, options, dense);
    if (options.young_modulus > 0.0) add_bending(branch.line, lines[b], options, dense);
  }
  for (const Block& block : dense) {
    if (!block.value.isZero(0.0)) stiffness_.push_back(block);
  }
}

/// Evenly on each line between its ends and the places where branches leave it, which their lines
/// share. Returns the nodes of each line in its order.
std::vector<std::vector<SectionChain::Knot>> SectionChain::place_nodes(
    const std::vector<preprocess::Branch>& tree, double spacing) {
  std::vector<Vec3> places;
  const auto node_at = [&](const Vec3& place) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      if ((places[k] - place).norm() < kShortest * spacing) return static_cast<int>(k);
    }
    places.push_back(place);
    return static_cast<int>(places.size()) - 1;
  };
  std::vector<std::vector<Knot>> lines(tree.size());
  for (std::size_t b = 0; b < tree.size(); ++b) {
    const Centerline& line = tree[b].line;
    const double start = line.arc_length[0], end = line.arc_length[line.arc_length.size() - 1];
    std::vector<double> shared = {start, end};
    for (const preprocess::Branch& child : tree) {
      if (child.parent == static_cast<int>(b) && child.parent_arc > start &&
          child.parent_arc < end) {
        shared.push_back(child.parent_arc);
      }
    }
    std::sort(shared.begin(), shared.end());
    // Shared places first: what lies nearer to them than that gives way.
    for (const double arc : shared) node_at(point_on(line, arc));
    const auto add = [&](double arc) {
      const int node = node_at(point_on(line, arc));
      if (lines[b].empty() || lines[b].back().node != node) lines[b].push_back({arc, node});
    };
    add(start);
    for (std::size_t k = 0; k + 1 < shared.size(); ++k) {
      const double length = shared[k + 1] - shared[k];
      const int parts = std::max(1, static_cast<int>(std::ceil(length / spacing - 1e-9)));
      for (int p = 1; p <= parts; ++p) add(shared[k] + p * length / parts);
    }
  }
  places_.resize(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t k = 0; k < places.size(); ++k) {
    places_.col(static_cast<Eigen::Index>(k)) = places[k];
  }
  return lines;
}

void SectionChain::build_cells() {
  for (int k = 0; k < nodes(); ++k) all_.push_back(k);
  origin_ = places_.rowwise().minCoeff() - Vec3::Constant(kChainMargin);
  const Vec3 size = places_.rowwise().maxCoeff() + Vec3::Constant(kChainMargin) - origin_;
  cells_ = (size / kCell).array().ceil().cast<int>();
  const double half = 0.5 * std::sqrt(3.0) * kCell;
  const double fall = -2.0 * width_ * width_ * std::log(kUnseen);
  near_.resize(static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]) *
               static_cast<std::size_t>(cells_[2]));
  std::size_t at = 0;
  for (int z = 0; z < cells_[2]; ++z) {
    for (int y = 0; y < cells_[1]; ++y) {
      for (int x = 0; x < cells_[0]; ++x, ++at) {
        const Vec3 center = origin_ + kCell * (Vec3(x, y, z) + Vec3::Constant(0.5));
        const Eigen::VectorXd distance = (places_.colwise() - center).colwise().norm();
        const double nearest = distance.minCoeff() + half;
        const double furthest = std::sqrt(nearest * nearest + fall) + half;
        for (int k = 0; k < nodes(); ++k) {
          if (distance[k] <= furthest) near_[at].push_back(k);
        }
      }
    }
  }
}

const std::vector<int>& SectionChain::candidates(const Vec3& rest) const {
  const Vec3 place = (rest - origin_) / kCell;
  std::size_t at = 0;
  for (int d = 2; d >= 0; --d) {
    if (!(place[d] >= 0.0 && place[d] < cells_[d])) return all_;
    at = at * static_cast<std::size_t>(cells_[d]) + static_cast<std::size_t>(place[d]);
  }
  return near_[at];
}

namespace {

/// A symmetric matrix by its columns from the diagonal down: entry by entry, since as Eigen's outer
/// products they take twice the time.
struct Symmetric {
  double of[6] = {};

  void add_square(double scale, const Vec3& a) {
    const double x = scale * a[0], y = scale * a[1], z = scale * a[2];
    of[0] += x * a[0], of[1] += x * a[1], of[2] += x * a[2];
    of[3] += y * a[1], of[4] += y * a[2], of[5] += z * a[2];
  }
  /// scale (a b' + b a')
  void add_products(double scale, const Vec3& a, const Vec3& b) {
    const double x = scale * a[0], y = scale * a[1], z = scale * a[2];
    of[0] += 2.0 * x * b[0], of[1] += x * b[1] + y * b[0], of[2] += x * b[2] + z * b[0];
    of[3] += 2.0 * y * b[1], of[4] += y * b[2] + z * b[1], of[5] += 2.0 * z * b[2];
  }
  void add(double scale, const Symmetric& other) {
    for (int k = 0; k < 6; ++k) of[k] += scale * other.of[k];
  }
  void put(Mat3& to) const { to << of[0], of[1], of[2], of[1], of[3], of[4], of[2], of[4], of[5]; }
};

}  // namespace

void SectionChain::find_weights(const Vec3& rest, bool with_bend,
                                std::vector<Weight>& weights) const {
  const std::vector<int>& nodes = candidates(rest);
  const double per_square = 1.0 / (width_ * width_);
  // 1. Each node's part of the sum of bell curves; those that cannot be of use are not kept.
  double nearest = std::numeric_limits<double>::infinity();
  for (const int k : nodes) nearest = std::min(nearest, (rest - places_.col(k)).squaredNorm());
  weights.clear();
  double sum = 0.0;
  Vec3 mean = Vec3::Zero();  // of the nodes' places from here, over the square of the width
  Symmetric squares;
  for (const int k : nodes) {
    const Vec3 away = places_.col(k) - rest;
    const double power = 0.5 * per_square * (nearest - away.squaredNorm());
    if (power < kLeastPower) continue;
    const double e = std::exp(power);
    const Vec3 a = per_square * away;
    sum += e;
    mean += e * a;
    if (with_bend) squares.add_square(e, a);
    if (e > 0.5 * kDropped) weights.push_back({k, e, a, Mat3::Zero()});
  }
  mean /= sum;
  Symmetric spread;
  spread.add(1.0 / sum, squares);
  spread.add_square(-1.0, mean);
  // 2. Without those that are next to nothing. With a node's a from the mean: q' = q a, and
  //    q'' = q (a a' - spread).
  double total = 0.0;
  Vec3 total_slope = Vec3::Zero();
  Symmetric total_bend;
  std::size_t count = 0;
  for (const Weight& part : weights) {
    const double q = part.value / sum;
    const Kept kept = keep(q);
    if (kept.value == 0.0) continue;
    const Vec3 a = part.slope - mean;
    Weight& weight = weights[count++];
    weight.node = part.node;
    weight.value = kept.value;
    weight.slope = (kept.slope * q) * a;
    total += weight.value;
    total_slope += weight.slope;
    if (!with_bend) continue;
    Symmetric bend;
    bend.add_square((kept.curvature * q + kept.slope) * q, a);
    bend.add(-kept.slope * q, spread);
    total_bend.add(1.0, bend);
    bend.put(weight.bend);
  }
  weights.resize(count);
  // 3. Of sum 1.
  const double per_total = 1.0 / total;
  for (Weight& weight : weights) {
    weight.value *= per_total;
    weight.slope = per_total * (weight.slope - weight.value * total_slope);
    if (!with_bend) continue;
    Symmetric change;
    change.add_products(per_total, weight.slope, total_slope);
    change.add(per_total * weight.value, total_bend);
    Mat3 less;
    change.put(less);
    weight.bend = per_total * weight.bend - less;
  }
}

Vec3 SectionChain::displacement(const Vec3& rest, const Eigen::Matrix3Xd& u) const {
  std::vector<Weight> weights;
  find_weights(rest, false, weights);
  Vec3 sum = Vec3::Zero();
  for (const Weight& weight : weights) sum += weight.value * u.col(weight.node);
  return sum;
}

Eigen::Matrix3Xd SectionChain::carried(const Eigen::Matrix3Xd& rest,
                                       const Eigen::Matrix3Xd& u) const {
  Eigen::Matrix3Xd moved = rest;
  for (Eigen::Index k = 0; k < rest.cols(); ++k) moved.col(k) += displacement(rest.col(k), u);
  return moved;
}

/// Adds stiffness |direction (sum row_j u_j)|^2 / 2, of a projector.
void SectionChain::add_square(const Eigen::VectorXd& row, double stiffness, const Mat3& direction,
                              std::vector<Block>& dense) const {
  for (int i = 0; i < nodes(); ++i) {
    if (row[i] == 0.0) continue;
    for (int j = 0; j <= i; ++j) {
      if (row[j] == 0.0) continue;
      const auto at = static_cast<std::size_t>(i) * static_cast<std::size_t>(i + 1) / 2 +
                      static_cast<std::size_t>(j);
      dense[at].value += (stiffness * row[i] * row[j]) * direction;
    }
  }
}

/// Support and stretch along a line, summed at places a quarter of the spacing apart; derivatives
/// along it by differences over that step, so that a line's jitter does no harm. What lies `inside`
/// the parent has no support of its own.
void SectionChain::add_line(const Centerline& line, double inside,
                            const SectionChainOptions& options, std::vector<Block>& dense) const {
  const double start = line.arc_length[0], end = line.arc_length[line.arc_length.size() - 1];
  const double length = end - start;
  const int steps =
      std::max(2, static_cast<int>(std::ceil(kStepsPerNode * length / options.spacing - 1e-9)));
  const double step = length / steps;
  if (step == 0.0) return;
  std::vector<Weight> here;
  const auto weights_at = [&](double arc, Eigen::VectorXd& row) {
    find_weights(point_on(line, arc), false, here);
    row.setZero(nodes());
    for (const Weight& weight : here) row[weight.node] = weight.value;
  };
  const auto add = [&](const Eigen::VectorXd& values, double stiffness, const Mat3& direction) {
    add_square(values, stiffness, direction, dense);
  };
  Eigen::VectorXd before, row, after;
  for (int k = 0; k < steps; ++k) {
    const double arc = start + (k + 0.5) * step;
    const Vec3 place = point_on(line, arc);
    const double radius = radius_on(line, arc);
    double support = kPi * radius * options.support;
    double held = 1.0;
    for (const Pin& pin : options.pins) {
      held = std::max(held,
                      1.0 + (pin.factor - 1.0) * held_part((place - pin.place).norm(), pin.radius));
    }
    support *= held;
    weights_at(arc, row);
    const double outside = std::clamp((arc - start + 0.5 * step - inside) / step, 0.0, 1.0);
    if (outside > 0.0) add(row, outside * step * support, Mat3::Identity());
    if (options.young_modulus == 0.0) continue;
    const double wall = 2.0 * kPi * radius * options.thickness * options.young_modulus;
    // Half a step to either side within the line.
    const double half = 0.5 * step;
    const Vec3 back = point_on(line, arc - half), ahead = point_on(line, arc + half);
    const Vec3 tangent = (ahead - back).normalized();
    const Mat3 along = tangent * tangent.transpose();
    weights_at(arc - half, before);
    weights_at(arc + half, after);
    add((after - before) / step, step * wall, along);
  }
}

/// Bending between each three nodes of a line that follow each other, by differences: second
/// derivatives of the weights ripple from node to node.
void SectionChain::add_bending(const Centerline& line, const std::vector<Knot>& knots,
                               const SectionChainOptions& options,
                               std::vector<Block>& dense) const {
  for (std::size_t k = 1; k + 1 < knots.size(); ++k) {
    const Knot &a = knots[k - 1], &b = knots[k], &c = knots[k + 1];
    const double back = b.arc - a.arc, ahead = c.arc - b.arc, share = 0.5 * (back + ahead);
    const double radius = radius_on(line, b.arc);
    const double bending =
        kPi * radius * radius * radius * options.thickness * options.young_modulus;
    const Vec3 tangent = (places_.col(c.node) - places_.col(a.node)).normalized();
    Eigen::VectorXd row = Eigen::VectorXd::Zero(nodes());
    row[a.node] += 1.0 / back;
    row[b.node] -= 1.0 / back + 1.0 / ahead;
    row[c.node] += 1.0 / ahead;
    add_square(row, bending / share, Mat3::Identity() - tangent * tangent.transpose(), dense);
  }
}

double SectionChain::energy(const Eigen::Matrix3Xd& u,
                            Eigen::Ref<Eigen::Matrix3Xd> gradient) const {
  double twice = 0.0;
  for (const Block& block : stiffness_) {
    const Vec3 force = block.value * u.col(block.j);
    gradient.col(block.i) += force;
    twice += u.col(block.i).dot(force);
    if (block.i == block.j) continue;
    const Vec3 back = block.value.transpose() * u.col(block.i);
    gradient.col(block.j) += back;
    twice += u.col(block.j).dot(back);
  }
  return 0.5 * twice;
}

}  // namespace wireplan::simulate
