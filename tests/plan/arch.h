#pragma once
/// An aortic arch with two vessels on top: the left subclavian artery, that one coming from the
/// groin meets first, and the left common carotid artery, which leaves it leaning back to where a
/// catheter comes from. Beyond them the ascending aorta runs down to where the image ends.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "plan/candidates.h"
#include "simulate/insertion/way.h"
#include "tests/plan/iliacs.h"
#include "tests/shapes.h"

namespace wireplan::plan::arch {

/// Radii of the aorta: from the arch's top on they change from one to the other [mm].
struct Arch {
  double descending = 10.5, ascending = 10.5;
};

inline constexpr double kBend = 35.0;               // of the arch's axis, about the y axis
inline constexpr double kDown = 150.0, kUp = 70.0;  // of the descending and the ascending aorta
inline constexpr double kSubclavianRadius = 4.5, kSubclavianLength = 135.0;
inline constexpr double kCarotidRadius = 3.5, kCarotidLength = 70.0;
inline constexpr double kSubclavianAt = 45.0 * kRadPerDeg, kCarotidAt = 115.0 * kRadPerDeg;

/// On the aorta's axis, by an angle from the descending aorta (0) to the ascending one (pi).
inline Vec3 on_arch(double angle) { return kBend * Vec3(std::cos(angle), 0.0, std::sin(angle)); }
/// So far along a vessel from the aorta's axis.
inline Vec3 subclavian(double s) { return on_arch(kSubclavianAt) + s * Vec3(0.6, 0.0, 0.8); }
inline Vec3 carotid(double s) { return on_arch(kCarotidAt) + s * Vec3(0.28, 0.0, 0.96); }

/// How deep a point is inside the aorta's wall, which has no end here.
inline double depth_in_aorta(const Arch& shape, const Vec3& p) {
  const bool bends = p.z() > 0.0;
  const double straight = p.x() > 0.0 ? 0.0 : kPi;
  const double angle = bends ? std::atan2(p.z(), p.x()) : straight;
  const double across = (bends ? std::hypot(p.x(), p.z()) : std::abs(p.x())) - kBend;
  const double far = std::clamp(2.0 * angle / kPi - 1.0, 0.0, 1.0);
  const double wider = (shape.ascending - shape.descending) * far * far * (3.0 - 2.0 * far);
  return shape.descending + wider - std::hypot(across, p.y());
}

inline simulate::VesselModel vessel(const Arch& shape) {
  const auto soft = [](double depth) { return std::exp(depth / 0.5); };
  const double wide = std::max(shape.descending, shape.ascending) + 2.0;
  const Vec3 far = subclavian(kSubclavianLength) + Vec3(6.0, wide, 6.0);
  return simulate::VesselModel(
      shapes::level_set(
          [&](const Vec3& p) {
            const auto tube = [&](const Vec3& from, const Vec3& to, double radius) {
              return soft(shapes::depth_in_tube(p, from, to, radius));
            };
            const double end = p.z() + (p.x() > 0.0 ? kDown : kUp);
            return 0.5 *
                   std::log(soft(std::min(depth_in_aorta(shape, p), end)) +
                            tube(subclavian(0), subclavian(kSubclavianLength), kSubclavianRadius) +
                            tube(carotid(0), carotid(kCarotidLength), kCarotidRadius));
          },
          Vec3(-kBend - wide, -wide, -kDown - 1.5), far, 1.2),
      simulate::LumenOptions{.grid_spacing = 0.7});
}

/// The aorta's axis from the access to an angle of the arch, and what follows.
inline std::vector<Vec3> up_to(double angle, const std::vector<Vec3>& more) {
  std::vector<Vec3> corners = {Vec3(kBend, 0.0, 2.0 - kDown)};
  const int parts = static_cast<int>(std::ceil(angle * kBend / 1.5));
  for (int k = 0; k <= parts; ++k) corners.push_back(on_arch(angle * k / parts));
  corners.insert(corners.end(), more.begin(), more.end());
  return corners;
}
inline double arc_to(double angle) { return kDown - 2.0 + kBend * angle; }

inline Centerline line_through(const Arch& shape, const std::vector<Vec3>& corners, double radius) {
  Centerline line = shapes::line_through(corners, radius);
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    line.radius[i] = std::max(radius, depth_in_aorta(shape, line.points.col(i)));
  }
  return line;
}

/// The aorta; the subclavian artery; the carotid artery.
inline std::vector<preprocess::Branch> tree(const Arch& shape) {
  const auto branch = [&](const Vec3& from, const Vec3& to, double radius, double angle) {
    return preprocess::Branch{line_through(shape, {from, to}, radius), 0, arc_to(angle)};
  };
  return {
      {line_through(shape, up_to(kPi, {Vec3(-kBend, 0.0, 2.0 - kUp)}), 0.0), -1, 0.0},
      branch(subclavian(0), subclavian(kSubclavianLength - 1.0), kSubclavianRadius, kSubclavianAt),
      branch(carotid(0), carotid(kCarotidLength - 1.0), kCarotidRadius, kCarotidAt)};
}

inline std::shared_ptr<simulate::Way> way(const Arch& shape, std::vector<preprocess::Branch> of) {
  return std::make_shared<simulate::Way>(
      line_through(shape, up_to(kCarotidAt, {carotid(56.0)}), kCarotidRadius), std::move(of));
}

/// From the descending aorta 40 mm into the carotid artery, with a Simmons 1.
inline Study study(const Arch& shape) {
  Study study = iliacs::study();
  study.access = Vec3(kBend, 0.0, 2.0 - kDown);
  study.tangent = Vec3::UnitZ();
  study.goal.way = way(shape, tree(shape));
  study.goal.point = study.goal.way->section().center;
  study.goal.radius = study.goal.way->section().radius;
  study.insertion.length = 500.0;
  return study;
}

}  // namespace wireplan::plan::arch
