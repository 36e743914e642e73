#include "simulate/wire/writhe.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace wireplan::simulate {
namespace {

/// Area of the unit sphere from which two edges are seen to cross, signed by how.
double crossing_area(const Vec3& a, const Vec3& a_end, const Vec3& b, const Vec3& b_end) {
  const std::array<Vec3, 4> way = {b - a, b_end - a, b_end - a_end, b - a_end};
  std::array<Vec3, 4> normal;
  for (std::size_t k = 0; k < 4; ++k) {
    normal[k] = way[k].cross(way[(k + 1) % 4]);
    const double size = normal[k].norm();
    if (!(size > 0.0)) return 0.0;  // in one plane
    normal[k] /= size;
  }
  double area = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    area += std::asin(std::clamp(normal[k].dot(normal[(k + 1) % 4]), -1.0, 1.0));
  }
  return std::copysign(area, (b_end - b).cross(a_end - a).dot(b - a));
}

}  // namespace

double find_writhe(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i + 3 < nodes.cols(); ++i) {
    for (Eigen::Index j = i + 2; j + 1 < nodes.cols(); ++j) {
      sum += crossing_area(nodes.col(i), nodes.col(i + 1), nodes.col(j), nodes.col(j + 1));
    }
  }
  return sum;  // 2/(4 pi) of a turn each, in radians
}

}  // namespace wireplan::simulate
