#include <gtest/gtest.h>
#include <vtkIdList.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "preprocess/centerline/centerline.h"
#include "preprocess/centerline/path_place.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// Nearest place of a path, and the least distance from its balls, segment by segment.
PathPlace place_among_all(const Vec3& p, const Centerline& path) {
  PathPlace place{.from_axis = 1e300, .from_lumen = 1e300};
  for (Eigen::Index k = 1; k < path.points.cols(); ++k) {
    const Vec3 a = path.points.col(k - 1), b = path.points.col(k);
    const double squared = (b - a).squaredNorm();
    const double t = squared > 0.0 ? std::clamp((p - a).dot(b - a) / squared, 0.0, 1.0) : 0.0;
    const double axis = (p - (1.0 - t) * a - t * b).norm();
    const double radius = (1.0 - t) * path.radius[k - 1] + t * path.radius[k];
    place.from_lumen = std::min(place.from_lumen, std::max(0.0, axis - radius));
    if (axis >= place.from_axis) continue;
    place.from_axis = axis;
    place.radius = radius;
    place.arc = (1.0 - t) * path.arc_length[k - 1] + t * path.arc_length[k];
  }
  return place;
}

// Along a path that comes back near itself, thin and wide in turns, with a point twice.
TEST(PathPlace, IsThatOfASearchThroughAllSegments) {
  constexpr int kPoints = 300;
  Centerline path{Eigen::Matrix3Xd(3, kPoints), Eigen::VectorXd(kPoints), {}};
  for (int k = 0; k < kPoints; ++k) {
    const double s = 0.05 * (k == 150 ? 149 : k);
    path.points.col(k) = Vec3(40.0 * std::cos(s), 40.0 * std::sin(s), 3.0 * s);
    path.radius[k] = k % 40 < 3 ? 25.0 : 4.0 + 3.0 * std::sin(9.0 * s);
  }
  path.arc_length = arc_length_of(path.points);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> side(-90.0, 90.0);
  for (int trial = 0; trial < 3000; ++trial) {
    const Vec3 p(side(random), side(random), side(random));
    const PathPlace found = find_place(p, path), expected = place_among_all(p, path);
    ASSERT_NEAR(found.from_axis, expected.from_axis, 1e-11);
    ASSERT_NEAR(found.from_lumen, expected.from_lumen, 1e-11);
    ASSERT_NEAR(found.arc, expected.arc, 1e-9);
    ASSERT_NEAR(found.radius, expected.radius, 1e-9);
  }
}

Vec3 start_of(const Centerline& line) { return line.points.col(0); }
Vec3 end_of(const Centerline& line) { return line.points.col(line.points.cols() - 1); }
double length_of(const Centerline& line) { return line.arc_length(line.arc_length.size() - 1); }

/// Smallest distance of a point from a polyline, and where on it: index plus fraction.
struct Place {
  double distance = 1e300, at = 0.0;
};

Place nearest_place(const Eigen::Matrix3Xd& line, const Vec3& p) {
  Place best;
  for (Eigen::Index i = 0; i + 1 < line.cols(); ++i) {
    const Vec3 a = line.col(i), edge = line.col(i + 1) - a;
    const double f = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    const double distance = (a + f * edge - p).norm();
    if (distance < best.distance) best = {.distance = distance, .at = double(i) + f};
  }
  return best;
}

double quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * double(values.size() - 1))];
}

/// What every line promises: even spacing, arc length that is one, radius that is positive.
void expect_well_formed(const Centerline& line, double sample) {
  ASSERT_GE(line.points.cols(), 2);
  ASSERT_EQ(line.radius.size(), line.points.cols());
  ASSERT_EQ(line.arc_length.size(), line.points.cols());
  EXPECT_EQ(line.arc_length(0), 0.0);
  for (Eigen::Index i = 1; i < line.points.cols(); ++i) {
    const double step = (line.points.col(i) - line.points.col(i - 1)).norm();
    // The last smoothing moves points a little along the line.
    ASSERT_NEAR(step, sample, 0.3 * sample) << "at point " << i;
    ASSERT_NEAR(line.arc_length(i) - line.arc_length(i - 1), step, 1e-9);
  }
  EXPECT_GT(line.radius.minCoeff(), 0.0);
}

std::string refusal_of(const Surface& surface, const Vec3& access, const Vec3& target,
                       const CenterlineOptions& options = {}) {
  try {
    find_centerline(surface, access, target, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Centerline, GoesOnBeyondTheTargetAsFarAsAsked) {
  // A bend of 90 degrees round 30 mm behind the target; the vessel ends 20 + 47 + 25 mm on.
  const Surface bend = shapes::bend_tube(4.0, 30.0, 0.5 * kPi, 60.0, 25.0, 1.5);
  const Vec3 access(0.0, 0.0, 10.0), target(0.0, 0.0, 40.0);
  const double to_target = length_of(find_centerline(bend, access, target));
  EXPECT_NEAR(to_target, 30.0, 0.3);
  for (const double beyond : {10.0, 40.0, 80.0}) {
    const Centerline line = find_centerline(bend, access, target, {.beyond_mm = beyond});
    EXPECT_NEAR(length_of(line), to_target + beyond, 0.7) << beyond;
    EXPECT_NEAR(line.radius(line.radius.size() - 1), 4.0, 0.15) << beyond;
  }
  for (const double beyond : {0.05, 0.3, 5.3}) {  // straight on, where nothing is rounded off
    const Centerline line = find_centerline(bend, access, target, {.beyond_mm = beyond});
    EXPECT_NEAR(length_of(line), to_target + beyond, 0.02) << beyond;
  }
  try {
    find_centerline(bend, access, target, {.beyond_mm = 120.0});
    FAIL() << "the vessel is not that long";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find("the vessel ends 9"), 0u) << text;
    EXPECT_NE(text.find("give a target.beyond_mm below that (120 mm was asked)"), std::string::npos)
        << text;
  }
}

/// Distance from a hairpin: limbs along z at x = +-6 from z = 0, joined by half a circle round the
/// origin's height of 60.
double from_hairpin(const Vec3& p) {
  if (p.z() > 60.0) return std::hypot(std::hypot(p.x(), p.z() - 60.0) - 6.0, p.y());
  return std::hypot(std::abs(p.x()) - 6.0, p.y());
}

TEST(Centerline, FollowsItsGuideWhereVesselsTouch) {
  // Limbs of 4 mm in radius that touch at a height of 20, 2 mm wide.
  const Surface vessel = shapes::level_set(
      [](const Vec3& p) {
        const double touch = 2.0 - std::hypot(p.y(), p.z() - 20.0);
        const double tubes = std::min(4.0 - from_hairpin(p), p.z());
        return std::max(tubes, std::min({touch, 6.0 - std::abs(p.x())}));
      },
      Vec3(-11.0, -5.0, -1.0), Vec3(11.0, 5.0, 71.0), 0.5);
  const Vec3 access(-6.0, 0.0, 8.0), target(6.0, 0.0, 8.0);
  const double round_the_top = 2.0 * 52.0 + 6.0 * kPi;
  std::vector<Vec3> guide;
  for (double z = 8.0; z < 60.0; z += 1.0) guide.emplace_back(-6.0, 0.0, z);
  for (double angle = 0.0; angle < kPi; angle += 0.15) {
    guide.emplace_back(-6.0 * std::cos(angle), 1.5, 60.0 + 6.0 * std::sin(angle));
  }
  for (double z = 60.0; z > 8.0; z -= 1.0) guide.emplace_back(6.0, 1.5, z);

  const Centerline shortest = find_centerline(vessel, access, target);
  EXPECT_LT(length_of(shortest), 50.0);
  const std::optional<Vec3> shortcut = find_departure(vessel, shortest, guide);
  ASSERT_TRUE(shortcut.has_value());
  EXPECT_LT((*shortcut - Vec3(0.0, 0.0, 20.0)).norm(), 6.0);

  const Centerline guided = find_centerline(vessel, access, target, {.guide = guide});
  EXPECT_FALSE(find_departure(vessel, guided, guide).has_value());
  EXPECT_NEAR(length_of(guided), round_the_top, 0.02 * round_the_top);
  expect_well_formed(guided, 0.5);

  // A guide that the line keeps to anyway changes nothing; one that leads through walls is told.
  std::reverse(guide.begin(), guide.end());
  EXPECT_EQ(find_centerline(vessel, access, target, {.guide = guide}).points, guided.points);
  const std::vector<Vec3> along = {access, Vec3(-6.0, 0.0, 20.0), Vec3(6.0, 0.0, 20.0), target};
  EXPECT_EQ(find_centerline(vessel, access, target, {.guide = along}).points, shortest.points);
}

double from_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm();
}

TEST(Centerline, KeepsToItsGuidesVesselWhereAnotherRunsBesideIt) {
  // A bent artery of 3 mm in radius, and a wider vein that it runs into at both ends of its bend.
  const std::vector<Vec3> bent = {Vec3(0.0, 0.0, 0.0),   Vec3(0.0, 0.0, 10.0),
                                  Vec3(-8.0, 0.0, 25.0), Vec3(-8.0, 0.0, 55.0),
                                  Vec3(0.0, 0.0, 70.0),  Vec3(0.0, 0.0, 80.0)};
  const Surface vessel = shapes::level_set(
      [&](const Vec3& p) {
        double inside = 4.5 - from_segment(p, Vec3(2.0, 0.0, 12.0), Vec3(2.0, 0.0, 68.0));
        for (std::size_t k = 0; k + 1 < bent.size(); ++k) {
          inside = std::max(inside, 3.0 - from_segment(p, bent[k], bent[k + 1]));
        }
        return inside;
      },
      Vec3(-12.0, -6.0, -4.0), Vec3(8.0, 6.0, 84.0), 0.5);
  const Vec3 access = bent.front(), target = bent.back();
  const auto at_middle = [](const Centerline& line) {
    Eigen::Index nearest = 0;
    (line.points.row(2).array() - 40.0).abs().minCoeff(&nearest);
    return line.points(0, nearest);
  };

  const Centerline shortest = find_centerline(vessel, access, target);
  EXPECT_NEAR(at_middle(shortest), 2.0, 0.3);
  ASSERT_TRUE(find_departure(vessel, shortest, bent).has_value());

  const Centerline guided = find_centerline(vessel, access, target, {.guide = bent});
  EXPECT_NEAR(at_middle(guided), -8.0, 0.3);
  EXPECT_FALSE(find_departure(vessel, guided, bent).has_value());
  expect_well_formed(guided, 0.5);
}

TEST(Centerline, TakesTheShortestWayWhereTheGuidesIsClosed) {
  // The same limbs, the touch and no way round the top.
  const Surface vessel = shapes::level_set(
      [](const Vec3& p) {
        const double touch = 2.0 - std::hypot(p.y(), p.z() - 20.0);
        const double tubes = std::min({4.0 - from_hairpin(p), p.z(), 50.0 - p.z()});
        return std::max(tubes, std::min({touch, 6.0 - std::abs(p.x())}));
      },
      Vec3(-11.0, -5.0, -1.0), Vec3(11.0, 5.0, 51.0), 0.5);
  const Vec3 access(-6.0, 0.0, 8.0), target(6.0, 0.0, 8.0);
  std::vector<Vec3> guide;
  for (double z = 8.0; z < 50.0; z += 1.0) guide.emplace_back(-6.0, 0.0, z);
  for (double z = 49.0; z > 8.0; z -= 1.0) guide.emplace_back(6.0, 0.0, z);
  const Centerline line = find_centerline(vessel, access, target, {.guide = guide});
  EXPECT_LT(length_of(line), 50.0);
  EXPECT_TRUE(find_departure(vessel, line, guide).has_value());
}

TEST(Centerline, HasTheLumensRadiusNearCaps) {
  const Surface tube = shapes::straight_tube(12.0, 100.0, 3.0);
  const Centerline line = find_centerline(tube, Vec3(0.0, 0.0, 3.5), Vec3(0.0, 2.0, 95.0));
  for (Eigen::Index i = 0; i < line.radius.size(); ++i) {
    EXPECT_NEAR(line.radius(i), 12.0, 0.4) << line.points.col(i).transpose();
  }
}

TEST(Centerline, OfAStraightTubeIsItsAxisFromFootToFoot) {
  const Surface tube = shapes::straight_tube(5.0, 100.0, 1.5);
  const Centerline line = find_centerline(tube, {1.0, 2.0, 5.0}, {0.0, -3.0, 95.0});
  expect_well_formed(line, 0.5);
  // The facets are not symmetric about the axis to better than their sagitta, 0.06 mm.
  EXPECT_LT(line.points.topRows(2).colwise().norm().maxCoeff(), 0.06);
  EXPECT_NEAR(start_of(line).z(), 5.0, 0.1);
  EXPECT_NEAR(end_of(line).z(), 95.0, 0.1);
  EXPECT_NEAR(length_of(line), 90.0, 0.1);
  // The inscribed sphere of the faceted tube lies between its apothem (21 sides) and the circle.
  EXPECT_GT(line.radius.minCoeff(), 5.0 * std::cos(kPi / 21.0) - 0.03);
  EXPECT_LT(line.radius.maxCoeff(), 5.0);
}

TEST(Centerline, OfABendIsTheCircleOfItsAxis) {
  for (const double edge : {1.5, 3.0}) {
    SCOPED_TRACE(edge);
    const Surface tube = shapes::bend_tube(5.0, 40.0, kPi, 20.0, 20.0, edge);
    const Centerline line = find_centerline(tube, {0.0, 1.0, 5.0}, {80.0, 0.0, 5.0});
    expect_well_formed(line, 0.5);
    const Eigen::Matrix3Xd axis = shapes::bend_axis(40.0, kPi, 20.0, 20.0, 0.1);
    double sum = 0.0;
    for (const auto& p : line.points.colwise()) sum += nearest_place(axis, p).distance;
    EXPECT_LT(sum / double(line.points.cols()), 0.1);
    const double length = 2.0 * 15.0 + kPi * 40.0;
    EXPECT_NEAR(length_of(line), length, 0.003 * length);
    EXPECT_NEAR(quantile({line.radius.begin(), line.radius.end()}, 0.5), 5.0, 0.08 * edge);
  }
}

TEST(Centerline, OfATaperingTubeCarriesTheRadiusOfTheCone) {
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, 81);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(81, 0.0, 80.0);
  const Surface tube = shapes::tube(axis, Eigen::VectorXd::LinSpaced(81, 6.0, 2.0), 32);
  const Centerline line = find_centerline(tube, {0.0, 0.0, 8.0}, {0.0, 0.5, 76.0});
  expect_well_formed(line, 0.5);
  EXPECT_LT(line.points.topRows(2).colwise().norm().maxCoeff(), 0.06);
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    const double cone = (6.0 - line.points(2, i) / 20.0) * std::cos(std::atan(0.05));
    ASSERT_NEAR(line.radius(i), cone, 0.01 * cone);  // 32 sides: the apothem is 0.5 % less
  }
}

TEST(Centerline, ThinTubeIsFoundByHalvingTheGrid) {
  const Surface tube = shapes::straight_tube(0.6, 30.0, 0.4);
  const Centerline line =
      find_centerline(tube, {0.1, 0.0, 1.0}, {0.0, 0.0, 29.0}, {.grid_mm = 2.0});
  expect_well_formed(line, 0.5);
  EXPECT_LT(line.points.topRows(2).colwise().norm().maxCoeff(), 0.03);
  EXPECT_NEAR(length_of(line), 28.0, 0.1);
}

TEST(Centerline, GoesRoundAHairpinWhoseLegsNearlyTouch) {
  // The legs are 0.4 mm apart: less than the grid.
  const Surface tube = shapes::bend_tube(5.0, 5.2, kPi, 40.0, 40.0, 1.5);
  const Centerline line =
      find_centerline(tube, {0.0, 0.0, 6.0}, {10.4, 0.0, 6.0}, {.grid_mm = 1.0});
  // The middle of so sharp a bend may cut its corner, but not the wall between the legs.
  EXPECT_GT(length_of(line), 2.0 * 34.0);
  EXPECT_LT(length_of(line), 2.0 * 34.0 + kPi * 5.2 + 0.5);
  EXPECT_GT(line.points.row(2).maxCoeff(), 40.0);
}

TEST(Centerline, FlatWallsSquareToTheGridAreNotCrossed) {
  const Surface boxes =
      shapes::joined(shapes::box({0, 0, 0}, {4, 4, 4}), shapes::box({5, 0, 0}, {9, 4, 4}));
  const std::string message = refusal_of(boxes, {2, 2, 2}, {7, 2, 2}, {.grid_mm = 1.0});
  EXPECT_NE(message.find("not connected"), std::string::npos) << message;
}

TEST(Centerline, OfAShortWayIsAsShort) {
  const Surface tube = shapes::straight_tube(5.0, 60.0, 2.0);
  const Centerline line = find_centerline(tube, {0.0, 1.0, 30.0}, {0.0, -1.0, 33.0});
  expect_well_formed(line, 0.5);
  EXPECT_NEAR(length_of(line), 3.0, 0.2);
  EXPECT_NEAR(start_tangent(line, 3.0).z(), 1.0, 0.01);
}

TEST(Centerline, ErrorTellsThatAccessAndTargetAreOnePlace) {
  const Surface tube = shapes::straight_tube(5.0, 60.0, 2.0);
  const std::string message = refusal_of(tube, {0.0, 0.0, 30.0}, {0.0, 0.0, 30.0});
  EXPECT_NE(message.find("same place along the vessel"), std::string::npos) << message;
}

TEST(Centerline, IsTheSameTwice) {
  const Surface tube = shapes::bend_tube(4.0, 20.0, 1.0, 10.0, 10.0, 2.0);
  const Vec3 access(0.0, 0.0, 3.0), target(8.0, 0.0, 25.0);
  const Centerline a = find_centerline(tube, access, target);
  const Centerline b = find_centerline(tube, access, target);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.radius, b.radius);
}

TEST(Centerline, ErrorNamesTheEndThatLiesOutsideAndItsDistance) {
  const Surface tube = shapes::straight_tube(5.0, 60.0, 2.0);
  const std::string access = refusal_of(tube, {0.0, 0.0, -7.0}, {0.0, 0.0, 50.0});
  EXPECT_NE(access.find("access (0.0, 0.0, -7.0) mm lies outside"), std::string::npos) << access;
  EXPECT_NE(access.find("7 mm from the wall"), std::string::npos) << access;
  const std::string target = refusal_of(tube, {0.0, 0.0, 5.0}, {0.0, 0.0, 64.0});
  EXPECT_NE(target.find("target (0.0, 0.0, 64.0) mm lies outside"), std::string::npos) << target;
}

TEST(Centerline, ErrorTellsHowFarTheSearchCameInSeparateTubes) {
  Surface other = shapes::straight_tube(3.0, 60.0, 2.0);
  other.vertices.row(0).array() += 12.0;
  const Surface both = shapes::joined(shapes::straight_tube(5.0, 60.0, 2.0), other);
  const std::string message = refusal_of(both, {0.0, 0.0, 5.0}, {12.0, 0.0, 50.0});
  EXPECT_NE(message.find("target (12.0, 0.0, 50.0) mm is not connected to access (0.0, 0.0, 5.0)"),
            std::string::npos)
      << message;
  // The wall of the first tube is 7 mm away from the target; the search ends close to it.
  const std::string before = "mm, is ";
  const auto at = message.find(before);
  ASSERT_NE(at, std::string::npos) << message;
  const double gap = std::stod(message.substr(at + before.size()));
  EXPECT_GE(gap, 7.0);
  EXPECT_LT(gap, 8.5);
  EXPECT_NE(message.find("band of the segmentation cuts the vessel there, or"), std::string::npos)
      << message;
}

TEST(CenterlineTree, OfATubeIsOneLineToEachEnd) {
  const Surface tube = shapes::straight_tube(4.0, 80.0, 1.5);
  const std::vector<Branch> tree = find_tree(tube, {0.0, 1.0, 20.0});
  ASSERT_EQ(tree.size(), 2u);  // the far end, then the near one
  EXPECT_EQ(tree[0].parent, -1);
  EXPECT_EQ(tree[1].parent, 0);
  // In the middle up to the caps, not into their corners, and to within 0.2 radii and a sample.
  EXPECT_LT((end_of(tree[0].line) - Vec3(0, 0, 80)).norm(), 1.3);
  EXPECT_LT((end_of(tree[1].line) - Vec3(0, 0, 0)).norm(), 1.3);
  for (const Branch& branch : tree) {
    for (const auto& p : branch.line.points.colwise()) ASSERT_LT(p.head<2>().norm(), 0.15);
  }
}

TEST(StartTangent, IsTheMeanDirectionOverTheSpan) {
  Centerline line;
  line.points.resize(3, 4);
  line.points.transpose() << 0, 0, 0, 0, 0, 1, 0, 0, 2, 1, 0, 2;
  line.radius = Eigen::VectorXd::Ones(4);
  line.arc_length = Eigen::Vector4d(0, 1, 2, 3);
  const double rounding = 1e-12;
  EXPECT_LT((start_tangent(line, 0.5) - Vec3::UnitZ()).norm(), rounding);
  EXPECT_LT((start_tangent(line, 2.5) - Vec3(0.5, 0, 2).normalized()).norm(), rounding);
  EXPECT_LT((start_tangent(line, 9.0) - Vec3(1, 0, 2).normalized()).norm(), rounding);
}

// ------------------------------------------------------------------------------- real vessels

/// Path of real data, or an empty one where it is not there.
fs::path real_data(const std::string& name) {
  const char* variable = std::getenv("WIREPLAN_DATA");
  const fs::path folder =
      variable ? fs::path(variable) : fs::path(WIREPLAN_SOURCE_DIR) / "../shared/data";
  return fs::exists(folder / name) ? folder / name : fs::path();
}

/// Control points of a 3D Slicer curve.
Eigen::Matrix3Xd read_curve(const fs::path& path) {
  std::ifstream file(path);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  std::vector<Vec3> points;
  const std::string key = "\"position\": [";
  for (auto at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    std::istringstream numbers(text.substr(at + key.size(), 200));
    Vec3 p;
    char comma = 0;
    numbers >> p.x() >> comma >> p.y() >> comma >> p.z();
    points.push_back(p);
  }
  Eigen::Matrix3Xd curve(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    curve.col(static_cast<Eigen::Index>(i)) = points[i];
  return curve;
}

TEST(RealCenterline, IliacToCarotidFollowsTheDrawnCurves) {
  const fs::path folder = real_data("surface-arch-to-cerebral");
  if (folder.empty()) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
  const Surface arch =
      read_surface(folder / "vessel_architecture_collision.obj", "mm", "LPS").surface;
  const Centerline line = find_centerline(arch, {-33.6, 66.5, 9.5}, {-601.3, -3.9, 4.7});

  // Through iliac, aorta and carotid: their drawn curves lie along the line, not always in the
  // middle, so up to about half a radius off. The wider way round by the vertebral artery does not.
  const fs::path curves = folder / "Centrelines_comb";
  double drawn = 0.0;
  for (const auto& [name, far] : {std::pair{"Centerline curve (3).mrk.json", 6.0},
                                  std::pair{"Centerline curve (2).mrk.json", 7.0},
                                  std::pair{"Centerline curve - RCCA.mrk.json", 3.0}}) {
    SCOPED_TRACE(name);
    const Eigen::Matrix3Xd curve = read_curve(curves / name);
    ASSERT_GT(curve.cols(), 10);
    std::vector<double> distances;
    for (const auto& p : curve.colwise()) {
      distances.push_back(nearest_place(line.points, p).distance);
    }
    EXPECT_LT(quantile(distances, 0.95), far);
    drawn += (curve.rightCols(curve.cols() - 1) - curve.leftCols(curve.cols() - 1))
                 .colwise()
                 .norm()
                 .sum();
  }
  // The three leave out the arch between descending aorta and carotid, some 60 to 80 mm.
  EXPECT_GT(length_of(line), drawn + 40.0);
  EXPECT_LT(length_of(line), drawn + 90.0);
  EXPECT_LT((end_of(line) - Vec3(-601.3, -3.9, 4.7)).norm(), 4.0);
}

TEST(RealCenterline, TreeOfTheCoronaryFindsItsSixOutlets) {
  const fs::path path = real_data("surface-coronary-left/m1_fluid.stl");
  if (path.empty()) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
  const Surface coronary = read_surface(path, "mm", "LPS").surface;
  const Vec3 access = Vec3(27.7, -40.4, 101.1) + 2.0 * Vec3(0.67, 0.21, -0.71);
  const std::vector<Branch> tree = find_tree(coronary, access);
  // The four outlets that its README places, each the end of one branch.
  for (const Vec3& outlet : {Vec3(-4.0, 28.6, 74.9), Vec3(-10.5, 21.7, 69.3),
                             Vec3(-34.3, -2.0, 66.6), Vec3(5.9, 32.4, 133.7)}) {
    const auto ends_there = [&](const Branch& branch) {
      return (end_of(branch.line) - outlet).norm() < 0.8;  // about an outlet's radius
    };
    EXPECT_EQ(std::count_if(tree.begin(), tree.end(), ends_there), 1) << outlet.transpose();
  }
  EXPECT_GE(tree.size(), 6u);
  EXPECT_LE(tree.size(), 9u);
}

TEST(RealCenterline, PassesTheTightCoronaryStenosis) {
  const fs::path path = real_data("surface-coronary-left/m1_fluid.stl");
  if (path.empty()) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
  const Surface coronary = read_surface(path, "mm", "LPS").surface;
  const Vec3 access = Vec3(27.7, -40.4, 101.1) + 2.0 * Vec3(0.67, 0.21, -0.71);

  // The target is the middle of an outlet cap: 1 mm inward from the cap's facet nearest to it.
  const Vec3 outlet(5.9, 32.4, 133.7);
  double least = 1e300;
  Vec3 inward = Vec3::Zero();
  for (const auto& t : coronary.triangles.colwise()) {
    const Vec3 a = coronary.vertices.col(t(0)), b = coronary.vertices.col(t(1)),
               c = coronary.vertices.col(t(2));
    const double distance = ((a + b + c) / 3.0 - outlet).norm();
    if (distance >= least) continue;
    least = distance;
    inward = (c - a).cross(b - a).normalized();
  }
  const Vec3 target = outlet + inward;

  const Centerline line = find_centerline(coronary, access, target);
  EXPECT_LT((start_of(line) - access).norm(), 0.5);
  EXPECT_LT((end_of(line) - target).norm(), 0.3);
  EXPECT_LT(line.radius.minCoeff(), 0.4);  // the stenosis is narrower than all outlets (0.57 mm)
  for (Eigen::Index i = 0; i < line.points.cols(); i += 5) {
    ASSERT_TRUE(locate_point(coronary, line.points.col(i)).inside) << "point " << i;
  }
}

TEST(RealCenterline, AgreesWithTheReferenceOfVmtk) {
  const fs::path folder = real_data("mra-aorta-iliac-vmtk");
  if (folder.empty()) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
  const Surface given = read_surface(folder / "aorta-surface.vtp", "mm", "LPS").surface;
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName((folder / "aorta-centerline.vtp").c_str());
  reader->Update();
  vtkPolyData* reference = reader->GetOutput();
  vtkDataArray* radius = reference->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  ASSERT_TRUE(radius);
  ASSERT_EQ(reference->GetNumberOfCells(), 2);

  // On the surface that theirs was made from, and on a coarse one, where vmtk finds no line.
  const Surface coarse = remesh(given, 1.5);
  EXPECT_NEAR(static_cast<double>(coarse.triangles.cols()), 5600.0, 200.0);
  for (const Surface& aorta : {given, coarse}) {
    SCOPED_TRACE(aorta.triangles.cols());
    // Both lines together, without 10 mm at their ends, where the caps decide.
    std::vector<double> distances, radius_errors;
    for (vtkIdType cell = 0; cell < 2; ++cell) {
      vtkNew<vtkIdList> ids;
      reference->GetCellPoints(cell, ids);
      Eigen::Matrix3Xd theirs(3, ids->GetNumberOfIds());
      for (vtkIdType i = 0; i < ids->GetNumberOfIds(); ++i) {
        reference->GetPoint(ids->GetId(i), theirs.col(i).data());
      }
      const Eigen::Index n = theirs.cols();
      const Centerline ours = find_centerline(aorta, theirs.col(n - 1), theirs.col(0));
      double from = 1e300, to = -1e300, ours_from = 1e300, ours_to = 0.0;
      for (Eigen::Index i = 0; i < ours.points.cols(); ++i) {
        const double s = ours.arc_length(i);
        if (s < 10.0 || s > length_of(ours) - 10.0) continue;
        const Place place = nearest_place(theirs, ours.points.col(i));
        const auto k = static_cast<vtkIdType>(place.at);
        const double f = place.at - double(k);
        const double r = (1.0 - f) * radius->GetTuple1(ids->GetId(k)) +
                         f * radius->GetTuple1(ids->GetId(std::min<vtkIdType>(k + 1, n - 1)));
        distances.push_back(place.distance);
        radius_errors.push_back(std::abs(ours.radius(i) / r - 1.0));
        from = std::min(from, place.at);
        to = std::max(to, place.at);
        ours_from = std::min(ours_from, s);
        ours_to = std::max(ours_to, s);
      }

      // Length over the same part of both.
      double length = 0.0;
      for (Eigen::Index i = 0; i + 1 < n; ++i) {
        const double part =
            std::clamp(to - double(i), 0.0, 1.0) - std::clamp(from - double(i), 0.0, 1.0);
        length += part * (theirs.col(i + 1) - theirs.col(i)).norm();
      }
      EXPECT_NEAR(ours_to - ours_from, length, 0.01 * length);
    }
    ASSERT_GT(distances.size(), 200u);
    // The tail of the distances lies in the bifurcation, where the two draw the branch off the
    // parent's axis differently and ours has the larger inscribed radius.
    EXPECT_LT(quantile(distances, 0.5), 0.06);
    EXPECT_LT(quantile(distances, 0.95), 0.6);
    EXPECT_LT(quantile(radius_errors, 0.95), 0.05);
  }
}

}  // namespace
}  // namespace wireplan::preprocess
