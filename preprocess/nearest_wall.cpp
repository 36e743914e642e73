#include "preprocess/nearest_wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace wireplan::preprocess {
namespace {

constexpr int kLeaf = 8;        // triangles of a box that is not split
constexpr int kDeepest = 64;    // levels; halving ends long before
constexpr double kFlat = 1e-9;  // part of its longest side's square that a triangle's area has

double squared_distance(const Vec3& p, const Vec3& low, const Vec3& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

NearestWall::NearestWall(const Surface& surface) {
  triangles_.reserve(static_cast<std::size_t>(surface.triangles.cols()));
  for (const auto& t : surface.triangles.colwise()) {
    const Vec3 a = surface.vertices.col(t(0)), b = surface.vertices.col(t(1)),
               c = surface.vertices.col(t(2));
    const Vec3 twice_area = (b - a).cross(c - a);
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (twice_area.norm() > kFlat * longest) {
      triangles_.push_back({.a = a, .b = b, .c = c, .normal = twice_area.normalized()});
    }
  }
  expects(!triangles_.empty());
  boxes_.reserve(triangles_.size());
  boxes_.emplace_back();
  split(0, 0, static_cast<int>(triangles_.size()));
}

/// Makes box number `box` of the triangles from `first` to before `last`: halves along the longest
/// side of their middles.
void NearestWall::split(int box, int first, int last) {
  const auto begin = triangles_.begin() + first, end = triangles_.begin() + last;
  const auto middle_of = [](const Triangle& t) { return Vec3((t.a + t.b + t.c) / 3.0); };
  Eigen::AlignedBox3d all, middles;
  for (auto t = begin; t != end; ++t) {
    all.extend(t->a).extend(t->b).extend(t->c);
    middles.extend(middle_of(*t));
  }
  Box made{.low = all.min(), .high = all.max(), .first = first, .count = last - first};
  if (last - first > kLeaf) {
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    const int half = first + (last - first) / 2;
    std::nth_element(begin, triangles_.begin() + half, end,
                     [&](const Triangle& s, const Triangle& t) {
                       return middle_of(s)(axis) < middle_of(t)(axis);
                     });
    made.first = static_cast<int>(boxes_.size());
    made.count = 0;
    boxes_.resize(boxes_.size() + 2);
    split(made.first, first, half);
    split(made.first + 1, half, last);
  }
  boxes_[static_cast<std::size_t>(box)] = made;
}

/// Ericson, "Real-Time Collision Detection", 5.1.5.
Vec3 NearestWall::nearest_on(const Triangle& t, const Vec3& p) {
  const Vec3 ab = t.b - t.a, ac = t.c - t.a, ap = p - t.a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return t.a;
  const Vec3 bp = p - t.b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return t.b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return t.a + d1 / (d1 - d3) * ab;
  const Vec3 cp = p - t.c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return t.c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return t.a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return t.b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t.c - t.b);
  }
  const double inverse = 1.0 / (va + vb + vc);
  return t.a + vb * inverse * ab + vc * inverse * ac;
}

Nearest NearestWall::find(const Vec3& p, const Nearest& near) const {
  Nearest best{.foot = nearest_on(triangles_[static_cast<std::size_t>(near.triangle)], p),
               .triangle = near.triangle};
  double least = (p - best.foot).squaredNorm();

  std::array<std::pair<int, double>, kDeepest> open;  // boxes with their squared distance
  std::size_t count = 0;
  open[count++] = {0, squared_distance(p, boxes_.front().low, boxes_.front().high)};
  while (count > 0) {
    const auto [number, distance] = open[--count];
    if (distance >= least) continue;
    const Box& box = boxes_[static_cast<std::size_t>(number)];

    // The triangles that are not too far for their plane alone.
    for (int k = box.first; k < box.first + box.count; ++k) {
      const Triangle& t = triangles_[static_cast<std::size_t>(k)];
      const double above = t.normal.dot(p - t.a);
      if (above * above >= least) continue;
      const Vec3 foot = nearest_on(t, p);
      const double squared = (p - foot).squaredNorm();
      if (squared >= least) continue;
      least = squared;
      best.foot = foot;
      best.triangle = k;
    }
    if (box.count > 0) continue;

    // The nearer child comes first.
    std::array<std::pair<int, double>, 2> children;
    for (std::size_t c = 0; c < 2; ++c) {
      const int child = box.first + static_cast<int>(c);
      const Box& inner = boxes_[static_cast<std::size_t>(child)];
      children[c] = {child, squared_distance(p, inner.low, inner.high)};
    }
    if (children[0].second < children[1].second) std::swap(children[0], children[1]);
    for (const auto& child : children) {
      if (child.second < least) open[count++] = child;
    }
  }
  best.distance = std::sqrt(least);
  return best;
}

}  // namespace wireplan::preprocess
