#include "preprocess/centerline/nearest_wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "preprocess/surface/triangle.h"

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

Nearest NearestWall::find(const Vec3& p, const Nearest& near) const {
  const auto offset_from = [&](const Triangle& t) {
    return nearest_on_triangle(p, t.a, t.b, t.c).offset;
  };
  Vec3 offset = offset_from(triangles_[static_cast<std::size_t>(near.triangle)]);
  Nearest best{.triangle = near.triangle};
  double least = offset.squaredNorm();

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
      const Vec3 other = offset_from(t);
      if (other.squaredNorm() >= least) continue;
      offset = other;
      least = other.squaredNorm();
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
  best.foot = p - offset;
  best.distance = std::sqrt(least);
  return best;
}

}  // namespace wireplan::preprocess
