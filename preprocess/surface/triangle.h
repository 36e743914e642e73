#pragma once
/// Nearest point of a triangle: what centerline, distance field and search for contacts share.
#include <Eigen/Geometry>

#include "preprocess/base.h"

namespace wireplan {

/// The point of a triangle that is nearest to another point.
struct NearestOnTriangle {
  Vec3 offset;  // from there to the other point                                         [mm]
  Vec3 weight;  // barycentric, of the corners; sum 1
  int feature;  // that it lies on: 0-2 the corners, 3-5 the edges 01, 12, 20, 6 the face
};

/// Ericson, "Real-Time Collision Detection", 5.1.5. Expects a triangle with an area.
inline NearestOnTriangle nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b,
                                             const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {ap, Vec3::UnitX(), 0};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {bp, Vec3::UnitY(), 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double w = d1 / (d1 - d3);
    return {ap - w * ab, {1.0 - w, w, 0.0}, 3};
  }
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {cp, Vec3::UnitZ(), 2};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double w = d2 / (d2 - d6);
    return {ap - w * ac, {1.0 - w, 0.0, w}, 5};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {bp - w * (c - b), {0.0, 1.0 - w, w}, 4};
  }
  const double inverse = 1.0 / (va + vb + vc), v = vb * inverse, w = vc * inverse;
  return {ap - v * ab - w * ac, {1.0 - v - w, v, w}, 6};
}

}  // namespace wireplan
