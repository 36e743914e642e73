#include "preprocess/volume/random_anatomy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace wireplan::preprocess {
namespace {

/// Least distance between the lumens of two stretches of a line that are further apart along it
/// than `apart`; far more than the tube is wide.
double least_gap(const Centerline& axis, double apart) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < axis.points.cols(); ++i) {
    for (Eigen::Index j = i + 1; j < axis.points.cols(); ++j) {
      if (axis.arc_length(j) - axis.arc_length(i) < apart) continue;
      const double gap =
          (axis.points.col(i) - axis.points.col(j)).norm() - axis.radius(i) - axis.radius(j);
      least = std::min(least, gap);
    }
  }
  return least;
}

Vec3 tangent_at(const Centerline& axis, Eigen::Index i) {
  const Eigen::Index last = axis.points.cols() - 1;
  const Eigen::Index before = std::max<Eigen::Index>(i - 4, 0), after = std::min(i + 4, last);
  return (axis.points.col(after) - axis.points.col(before)).normalized();
}

Vec3 normal_part(const Vec3& side, const Vec3& tangent) {
  return (side - side.dot(tangent) * tangent).normalized();
}

/// The tube of these columns.
PhantomTube with_columns(const PhantomTube& tube, const std::vector<Vec3>& points,
                         const std::vector<double>& radius) {
  return tube_through(tube.name, tube.kind, tube.wall_mm, points, radius);
}

/// How near the points of a vein are to an artery.
struct Nearness {
  Eigen::VectorXd missing;          // how much further off each has to be; negative: none [mm]
  std::vector<Eigen::Index> place;  // the point of the artery's axis that asks for that
};

/// Far enough is where the lumens, the artery's with its wall, overlap by no more than half the
/// radius of the thinner.
Nearness find_nearness(const PhantomTube& vein, const Centerline& artery, double wall) {
  Nearness found{Eigen::VectorXd(vein.points.cols()), {}};
  for (Eigen::Index i = 0; i < vein.points.cols(); ++i) {
    const double radius = vein.radius(i);
    const Eigen::VectorXd away = (artery.points.colwise() - vein.points.col(i)).colwise().norm();
    const Eigen::ArrayXd needed =
        artery.radius.array() + wall + radius - 0.5 * artery.radius.array().min(radius);
    Eigen::Index place = 0;
    found.missing(i) = (needed - away.array()).maxCoeff(&place);
    found.place.push_back(place);
  }
  return found;
}

/// Moves each stretch of the vein that is too near to one side of the artery, that on which it lies
/// where it is nearest. Tells whether there was one.
bool press_aside(PhantomTube& vein, const Centerline& artery, double wall) {
  const Nearness near = find_nearness(vein, artery, wall);
  const Centerline before{vein.points, vein.radius, arc_length_of(vein.points)};
  const Eigen::Index count = vein.points.cols();
  for (Eigen::Index begin = 0, end = 0; begin < count; begin = end + 1) {
    for (end = begin; end < count && near.missing(end) > 0.0;) ++end;
    if (end == begin) continue;
    Eigen::Index nearest = 0;
    near.missing.segment(begin, end - begin).maxCoeff(&nearest);
    nearest += begin;
    const Eigen::Index at = near.place[static_cast<std::size_t>(nearest)];
    const Vec3 along = tangent_at(before, nearest);
    Vec3 side = vein.points.col(nearest) - artery.points.col(at);
    side -= side.dot(along) * along;
    if (side.norm() < 1e-3) side = along.cross(tangent_at(artery, at));  // straight through it
    side = side.norm() > 0.0 ? side.normalized() : along.unitOrthogonal();
    for (Eigen::Index i = begin; i < end; ++i) {
      const Vec3 off =
          vein.points.col(i) - artery.points.col(near.place[static_cast<std::size_t>(i)]);
      const double across = off.dot(side), needed = off.norm() + near.missing(i);
      vein.points.col(i) +=
          (std::sqrt(across * across + needed * needed - off.squaredNorm()) - across) * side;
    }
  }
  return near.missing.maxCoeff() > 0.0;
}

/// Moves the organ within its slices, away from the artery's point that lies deepest in it, until
/// that is further out than the organ's surface by the artery's wall and half its radius. Tells
/// whether there was one.
bool press_aside(PhantomEllipsoid& organ, const Centerline& artery, double wall) {
  const auto round = [&](Eigen::Index i) -> Vec3 {  // half axes that the point is to lie beyond
    return organ.semi_axes.array() + wall + 0.5 * artery.radius(i);
  };
  double least = 1.0;
  Eigen::Index deepest = -1;
  for (Eigen::Index i = 0; i < artery.points.cols(); ++i) {
    const double part = (artery.points.col(i) - organ.center).cwiseQuotient(round(i)).norm();
    if (part >= least) continue;
    least = part;
    deepest = i;
  }
  if (deepest < 0) return false;
  constexpr double kFurther = 1e-6;  // so that it is not found again
  const Vec3 axes = round(deepest), off = organ.center - artery.points.col(deepest);
  Vec3 side(off.x(), off.y(), 0.0);
  side = side.norm() > 1e-3 ? side.normalized() : Vec3::UnitX();
  // |(off + by side) / axes| = 1
  const Vec3 from = off.cwiseQuotient(axes), step = side.cwiseQuotient(axes);
  const double along = from.dot(step), squared = step.squaredNorm();
  const double by =
      (std::sqrt(along * along + squared * (1.0 - from.squaredNorm())) - along) / squared;
  organ.center += (by + kFurther) * side;
  return true;
}

}  // namespace

double DrawnScan::arterial_hu() const { return kBloodHu + contrast_hu * (1.0 - 0.5 * fall); }

PhantomTube& DrawnAnatomy::tube(const std::string& name) {
  const auto found = std::find_if(tubes.begin(), tubes.end(),
                                  [&](const PhantomTube& one) { return one.name == name; });
  expects(found != tubes.end());
  return *found;
}

PhantomTube tube_through(const std::string& name, PhantomTubeKind kind, double wall_mm,
                         const std::vector<Vec3>& points, const std::vector<double>& radius) {
  expects(points.size() == radius.size());
  PhantomTube tube{
      .name = name, .kind = kind, .hu = 0.0, .wall_mm = wall_mm, .points = {}, .radius = {}};
  tube.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    tube.points.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  tube.radius = Eigen::VectorXd::Map(radius.data(), static_cast<Eigen::Index>(radius.size()));
  return tube;
}

PhantomTube with_points_every(const PhantomTube& tube, double spacing) {
  const Centerline axis = phantom_axis(tube);
  const Eigen::Index last = axis.points.cols() - 1;
  const auto pieces = static_cast<Eigen::Index>(std::ceil(axis.arc_length(last) / spacing));
  std::vector<Vec3> points;
  std::vector<double> radius;
  for (Eigen::Index k = 0; k <= pieces; ++k) {
    const Eigen::Index i = k * last / pieces;
    points.emplace_back(axis.points.col(i));
    radius.push_back(axis.radius(i));
  }
  PhantomTube dense = with_columns(tube, points, radius);
  dense.hu = tube.hu;
  return dense;
}

PhantomTube vein_beside(const std::string& name, const PhantomTube& artery, double from, double to,
                        const Vec3& side, double radius, double gap) {
  const Centerline axis = phantom_axis(artery);
  const auto last = static_cast<double>(axis.points.cols() - 1);
  constexpr int kPieces = 10;
  std::vector<Vec3> points;
  for (int k = 0; k <= kPieces; ++k) {
    const auto i = static_cast<Eigen::Index>(last * (from + (to - from) * k / kPieces));
    const double away = axis.radius(i) + artery.wall_mm + gap + radius;
    points.emplace_back(axis.points.col(i) + away * normal_part(side, tangent_at(axis, i)));
  }
  return tube_through(name, PhantomTubeKind::kVein, 0.4, points,
                      std::vector<double>(points.size(), radius));
}

void add_vein(PhantomTube vein, double level, const DrawnScan& scan, Draws& draws,
              DrawnAnatomy& body) {
  const double own = std::clamp(level + draws.between(-0.1, 0.1), 0.5, 0.95);
  vein.hu = draws.between(40.0, 70.0);
  body.tubes.push_back(std::move(vein));
  body.level.resize(body.tubes.size(), 0.0);
  if (scan.veins) body.level.back() = own;
}

void press_aside(DrawnAnatomy& body) {
  constexpr double kSpacing = 2.5;  // of points of what was moved                      [mm]
  constexpr int kRounds = 12;       // away from one artery may be toward another
  std::vector<std::pair<Centerline, double>> arteries;  // axis and wall
  for (const PhantomTube& tube : body.tubes) {
    if (tube.kind == PhantomTubeKind::kArtery || tube.kind == PhantomTubeKind::kThrombus) {
      arteries.emplace_back(phantom_axis(tube), tube.wall_mm);
    }
  }
  const auto press = [&](auto& vein_or_gland) {
    bool moved = false;
    for (const auto& [axis, wall] : arteries) {
      moved = press_aside(vein_or_gland, axis, wall) || moved;
    }
    return moved;
  };
  for (PhantomTube& tube : body.tubes) {
    if (tube.kind != PhantomTubeKind::kVein) continue;
    for (int round = 0; round < kRounds && press(tube); ++round) {
      tube = with_points_every(tube, kSpacing);
    }
  }
  for (PhantomEllipsoid& organ : body.organs) {
    for (int round = 0; organ.name == kThyroid && round < kRounds && press(organ);) ++round;
  }
}

void add_bends(PhantomTube& tube, double amplitude, double waves, const Vec3& across) {
  tube = with_points_every(tube, 5.0);
  const Eigen::Index last = tube.points.cols() - 1;
  const Eigen::Matrix3Xd straight = tube.points;
  for (Eigen::Index i = 1; i < last; ++i) {
    const double u = static_cast<double>(i) / static_cast<double>(last);
    const Vec3 tangent = (straight.col(i + 1) - straight.col(i - 1)).normalized();
    const double hold = std::min({1.0, 4.0 * u, 4.0 * (1.0 - u)});  // quiet at both ends
    tube.points.col(i) +=
        hold * amplitude * std::sin(2.0 * kPi * waves * u) * normal_part(across, tangent);
  }
}

void add_kissing_loop(PhantomTube& tube, const Vec3& side, double gap) {
  const PhantomTube straight = with_points_every(tube, 4.0);
  const Centerline axis = phantom_axis(straight);
  const Eigen::Index middle = axis.points.cols() / 2;
  const Vec3 base = axis.points.col(middle), along = tangent_at(axis, middle);
  const Vec3 out = normal_part(side, along);
  const double radius = axis.radius(middle), loop = std::max(9.0, 2.4 * radius);
  constexpr double kNeck = 7.0, kLimb = 5.0;  // where limbs begin to touch, and how long     [mm]
  double half = radius + 0.5 * gap;           // of the distance of the limbs' axes at the neck
  for (int round = 0; round < 20; ++round) {
    std::vector<Vec3> points;
    std::vector<double> radii;
    const auto add = [&](double w, double u) {
      points.emplace_back(base + w * along + u * out);
      radii.push_back(radius);
    };
    const double room = loop + 8.0;  // along the tube, which the loop takes
    const auto keep = [&](bool before) {
      for (Eigen::Index i = 0; i < straight.points.cols(); ++i) {
        const double w = (straight.points.col(i) - base).dot(along);
        const double whole = axis.arc_length(axis.arc_length.size() - 1);
        const double arc =
            whole * static_cast<double>(i) / static_cast<double>(straight.points.cols() - 1);
        const bool is_before = arc < 0.5 * whole;
        if (is_before != before || std::abs(w) < room) continue;
        points.emplace_back(straight.points.col(i));
        radii.push_back(straight.radius(i));
      }
    };
    keep(true);
    const double height = kNeck + kLimb + std::sqrt(loop * loop - half * half);
    add(-half - 5.0, 1.5);
    add(-half, kNeck);
    add(-half, kNeck + kLimb);
    for (const double angle : {-140.0, -95.0, -48.0, 0.0, 48.0, 95.0, 140.0}) {
      add(loop * std::sin(angle * kRadPerDeg), height + loop * std::cos(angle * kRadPerDeg));
    }
    add(half, kNeck + kLimb);
    add(half, kNeck);
    add(half + 5.0, 1.5);
    keep(false);
    tube = with_points_every(with_columns(straight, points, radii), 2.5);
    const double found = least_gap(phantom_axis(tube), 6.0 * radius);
    if (std::abs(found - gap) < 0.02) break;
    half += 0.5 * (gap - found);
  }
}

void add_stenosis(PhantomTube& tube, double at, double half_length, double share) {
  tube = with_points_every(tube, 2.5);
  const Centerline axis = phantom_axis(tube);
  const double whole = axis.arc_length(axis.arc_length.size() - 1);
  for (Eigen::Index i = 0; i < tube.points.cols(); ++i) {
    const double arc = whole * static_cast<double>(i) / static_cast<double>(tube.points.cols() - 1);
    const double u = (arc - at * whole) / half_length;
    if (std::abs(u) >= 1.0) continue;
    const double narrow = std::pow(std::cos(0.5 * kPi * u), 2);
    tube.radius(i) *= 1.0 - (1.0 - share) * narrow;
  }
}

void bend_all(DrawnAnatomy& anatomy, Draws& draws) {
  struct Wave {
    double amplitude, length, phase;
  };
  const auto wave = [&](double most) {
    const double amplitude = draws.between(0.0, most), length = draws.between(130.0, 320.0);
    return Wave{amplitude, length, draws.between(0.0, 2.0 * kPi)};
  };
  const Wave lateral_1 = wave(9.0), lateral_2 = wave(5.0), depth = wave(5.0);
  const auto at = [](const Wave& w, double z) {
    return w.amplitude * std::sin(2.0 * kPi * z / w.length + w.phase);
  };
  const auto move = [&](const Vec3& p) -> Vec3 {
    return p + Vec3(at(lateral_1, p.z()) + at(lateral_2, p.z()), at(depth, p.z()), 0.0);
  };
  for (PhantomTube& tube : anatomy.tubes) {
    for (Eigen::Index i = 0; i < tube.points.cols(); ++i) {
      tube.points.col(i) = move(tube.points.col(i));
    }
  }
  for (PhantomEllipsoid& organ : anatomy.organs) organ.center = move(organ.center);
  for (PhantomVertebra& one : anatomy.vertebrae) one.center = move(one.center);
}

}  // namespace wireplan::preprocess
