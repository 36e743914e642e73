#include "preprocess/vessel.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace wireplan {
namespace {

std::array<Vec3, 3> corners_of(const Surface& surface, Eigen::Index k) {
  const Eigen::Vector3i t = surface.triangles.col(k);
  return {surface.vertices.col(t[0]), surface.vertices.col(t[1]), surface.vertices.col(t[2])};
}

Vec3 twice_area(const std::array<Vec3, 3>& p) { return (p[1] - p[0]).cross(p[2] - p[0]); }

}  // namespace

Eigen::VectorXd arc_length_of(const Eigen::Matrix3Xd& points) {
  Eigen::VectorXd arc = Eigen::VectorXd::Zero(points.cols());
  for (Eigen::Index k = 1; k < points.cols(); ++k) {
    arc[k] = arc[k - 1] + (points.col(k) - points.col(k - 1)).norm();
  }
  return arc;
}

Vec3 unit_normal(const Surface& surface, Eigen::Index k) {
  return twice_area(corners_of(surface, k)).normalized();
}

Eigen::Matrix3Xd angle_weighted_normals(const Surface& surface) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, surface.vertices.cols());
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    const std::array<Vec3, 3> p = corners_of(surface, k);
    const Vec3 normal = twice_area(p).normalized();
    for (int c = 0; c < 3; ++c) {
      const Vec3 u = p[(c + 1) % 3] - p[c], v = p[(c + 2) % 3] - p[c];
      normals.col(surface.triangles(c, k)) += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
    }
  }
  return normals;
}

Eigen::Matrix3Xd area_weighted_normals(const Surface& surface) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, surface.vertices.cols());
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    const Vec3 area = twice_area(corners_of(surface, k));
    for (const int v : surface.triangles.col(k)) normals.col(v) += area;
  }
  normals.colwise().normalize();
  return normals;
}

}  // namespace wireplan
