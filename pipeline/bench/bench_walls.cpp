#include "pipeline/bench/bench_walls.h"

#include <vtkDecimatePro.h>
#include <vtkNew.h>
#include <vtkPoints.h>

#include <Eigen/Geometry>
#include <cmath>

#include "preprocess/centerline/centerline.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/vtk_mesh.h"
#include "preprocess/volume/phantom.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {
namespace {

struct Station {
  Vec3 center;
  double radius;
};

/// Rings of triangles round the stations, square to the mean direction there, with a fan at either
/// end.
Surface skin_over(const std::vector<Station>& stations, int sides) {
  const int rings = static_cast<int>(stations.size());
  Surface surface;
  surface.vertices.resize(3, rings * sides + 2);
  surface.triangles.resize(3, 2 * rings * sides);
  Vec3 u = Vec3::UnitX();
  for (int r = 0; r < rings; ++r) {
    const Vec3 before = stations[std::max(0, r - 1)].center, here = stations[r].center;
    const Vec3 after = stations[std::min(rings - 1, r + 1)].center;
    const Vec3 tangent =
        ((here - before).stableNormalized() + (after - here).stableNormalized()).normalized();
    u = (u - u.dot(tangent) * tangent).normalized();
    const Vec3 v = tangent.cross(u);
    for (int k = 0; k < sides; ++k) {
      const double angle = 2.0 * kPi * k / sides;
      surface.vertices.col(r * sides + k) =
          here + stations[r].radius * (std::cos(angle) * u + std::sin(angle) * v);
    }
  }
  const int start = rings * sides, end = start + 1;
  surface.vertices.col(start) = stations.front().center;
  surface.vertices.col(end) = stations.back().center;
  int next = 0;
  for (int k = 0; k < sides; ++k) {
    const int j = (k + 1) % sides, last = (rings - 1) * sides;
    surface.triangles.col(next++) = Eigen::Vector3i(start, j, k);
    surface.triangles.col(next++) = Eigen::Vector3i(end, last + k, last + j);
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = r * sides, b = a + sides;
      surface.triangles.col(next++) = Eigen::Vector3i(a + k, a + j, b + k);
      surface.triangles.col(next++) = Eigen::Vector3i(a + j, b + j, b + k);
    }
  }
  return surface;
}

std::vector<Station> straight_stations(double spacing) {
  std::vector<Station> stations;
  const int count = static_cast<int>(std::lround(60.0 / spacing));
  for (int k = 0; k <= count; ++k) stations.push_back({Vec3(0.0, 0.0, k * spacing), 4.0});
  return stations;
}

Surface narrow_tube() {
  std::vector<Station> stations = straight_stations(1.0);
  for (Station& station : stations) station.radius = 0.4;
  return skin_over(stations, 12);
}

Surface stenosis() {
  std::vector<Station> stations = straight_stations(1.0);
  for (Station& station : stations) {
    const double from_middle = (station.center.z() - 25.0) / 4.0;
    station.radius = 4.0 - 3.7 * std::exp(-from_middle * from_middle);
  }
  return skin_over(stations, 16);
}

Surface elbow() {
  std::vector<Station> stations;
  for (int k = 0; k <= 10; ++k) stations.push_back({Vec3(0.0, 0.0, 2.0 * k), 4.0});
  stations.push_back({Vec3(0.0, 0.0, 25.0), 4.0 * std::sqrt(2.0)});
  for (int k = 0; k <= 14; ++k) stations.push_back({Vec3(5.0 + 2.0 * k, 0.0, 25.0), 4.0});
  return skin_over(stations, 16);
}

Surface folds() {
  std::vector<Station> stations = straight_stations(0.7);
  for (std::size_t k = 12; k < stations.size(); ++k) stations[k].radius = k % 2 == 0 ? 4.0 : 2.2;
  return skin_over(stations, 16);
}

Surface slivers() {
  // 60 sides of 0.4 mm, in rows of 6 mm with rows of 0.01 mm between.
  std::vector<Station> stations;
  for (int k = 0; k <= 10; ++k) {
    stations.push_back({Vec3(0.0, 0.0, 6.0 * k), 4.0});
    stations.push_back({Vec3(0.0, 0.0, 6.0 * k + 0.01), 4.0});
  }
  return skin_over(stations, 60);
}

Surface cone() {
  std::vector<Station> stations = straight_stations(1.0);
  for (Station& station : stations) station.radius = 4.0 - 3.99 * station.center.z() / 60.0;
  return skin_over(stations, 16);
}

/// A part of a tube's middle: straight, or an arc toward a side that is square to its start.
struct Piece {
  double length;             //                                                        [mm]
  double bend_radius = 0.0;  // 0: straight                                            [mm]
  Vec3 toward = Vec3::Zero();
};

constexpr double kCapDistance = 5.0;  // of a tube's path from its ends                 [mm]

/// At this arc length, from the origin along +z.
Vec3 point_along(const std::vector<Piece>& pieces, double arc) {
  Vec3 point = Vec3::Zero(), tangent = Vec3::UnitZ();
  for (const Piece& piece : pieces) {
    const double part = std::min(arc, piece.length);
    if (piece.bend_radius == 0.0) {
      point += part * tangent;
    } else {
      const double angle = part / piece.bend_radius;
      point +=
          piece.bend_radius * (std::sin(angle) * tangent + (1.0 - std::cos(angle)) * piece.toward);
      tangent = std::cos(angle) * tangent + std::sin(angle) * piece.toward;
    }
    arc -= part;
  }
  return point;
}

Vessel tube_along(const std::vector<Piece>& pieces, double radius, int rings, int sides) {
  double length = 0.0;
  for (const Piece& piece : pieces) length += piece.length;
  std::vector<Station> stations;
  for (int r = 0; r < rings; ++r) {
    stations.push_back({point_along(pieces, length * r / (rings - 1)), radius});
  }
  Vessel vessel;
  vessel.surface = skin_over(stations, sides);

  // The path keeps off the caps.
  const double path_length = length - 2.0 * kCapDistance;
  const int points = static_cast<int>(std::ceil(2.0 * path_length));
  vessel.path.points.resize(3, points);
  vessel.path.radius = Eigen::VectorXd::Constant(points, radius);
  vessel.path.arc_length = Eigen::VectorXd::LinSpaced(points, 0.0, path_length);
  for (int k = 0; k < points; ++k) {
    vessel.path.points.col(k) = point_along(pieces, kCapDistance + vessel.path.arc_length[k]);
  }
  vessel.wall = preprocess::extrude_wall(vessel.surface, {}).wall;
  return vessel;
}

preprocess::PhantomTube artery(const std::vector<Vec3>& points, const std::vector<double>& radius) {
  expects(points.size() == radius.size());
  preprocess::PhantomTube tube;
  tube.points.resize(3, static_cast<Eigen::Index>(points.size()));
  tube.radius.resize(static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    tube.points.col(static_cast<Eigen::Index>(k)) = points[k];
    tube.radius[static_cast<Eigen::Index>(k)] = radius[k];
  }
  return tube;
}

preprocess::PhantomSpec empty_phantom(const Vec3& low, const Vec3& high, double spacing) {
  preprocess::PhantomSpec spec;
  for (int k = 0; k < 3; ++k) {
    spec.grid.size[static_cast<std::size_t>(k)] =
        static_cast<int>(std::ceil((high[k] - low[k]) / spacing)) + 1;
  }
  spec.grid.spacing = Vec3::Constant(spacing);
  spec.grid.origin = low;
  spec.body_semi_axes = Vec3(200.0, 200.0, 1000.0);
  spec.supersampling = 1;  // nobody reads the image, its truth alone
  return spec;
}

}  // namespace

Vessel make_arterial_tree(double edge_length) {
  preprocess::PhantomSpec spec =
      empty_phantom(Vec3(-85.0, -52.0, -145.0), Vec3(85.0, 40.0, 165.0), 0.6 * edge_length);
  spec.tubes = {
      artery({{3, 9, 175}, {4, 7, 120}, {9, 5, 75}, {16, -1, 40}, {8, -2, 10}, {4, -1, -4}},
             {10, 10, 9, 10, 9, 8}),
      artery({{2, -1, 2},
              {-15, 2, -27},
              {-37, 20, -57},
              {-52, 16, -80},
              {-56, -8, -100},
              {-66, -28, -122},
              {-72, -38, -145},
              {-73, -42, -165}},
             {6, 5.3, 4.8, 4.4, 4.2, 4.2, 4.4, 4.4}),
      artery({{6, -1, 2},
              {22, 7, -25},
              {41, 22, -57},
              {56, 14, -78},
              {61, -12, -102},
              {69, -30, -126},
              {74, -40, -165}},
             {6, 5.3, 4.8, 4.4, 4.2, 4.2, 4.4}),
      artery({{5, 6, 90}, {-17, 15, 87}, {-54, 24, 75}}, {3.1, 2.9, 2.8}),
      artery({{7, 5, 86}, {30, 15, 84}, {60, 24, 78}}, {3.1, 2.9, 2.8}),
  };
  Vessel vessel;
  vessel.surface = preprocess::surface_from_mask(preprocess::make_phantom(spec).lumen,
                                                 {.edge_length_mm = edge_length});
  vessel.path = preprocess::find_centerline(vessel.surface, Vec3(-71.0, -36.0, -140.0),
                                            Vec3(3.0, 9.0, 160.0));
  vessel.wall = preprocess::extrude_wall(vessel.surface, {}).wall;
  return vessel;
}

Vessel make_branched_aorta() {
  constexpr double kEdge = 1.2, kLevel = 60.0;  // [mm]
  preprocess::PhantomSpec spec =
      empty_phantom(Vec3(-11.0, -11.0, 0.0), Vec3(46.0, 11.0, 130.0), 0.6 * kEdge);
  spec.tubes = {artery({{0, 0, -20}, {0, 0, 150}}, {9, 9}),
                artery({{0, 0, kLevel}, {60, 0, kLevel}}, {3, 3})};
  Vessel vessel;
  vessel.surface = preprocess::surface_from_mask(preprocess::make_phantom(spec).lumen,
                                                 {.edge_length_mm = kEdge});
  vessel.path =
      preprocess::find_centerline(vessel.surface, Vec3(0.0, 0.0, 5.0), Vec3(35.0, 0.0, kLevel));
  return vessel;
}

namespace {

Vessel two_bends(double before, double behind, double radius, int rings) {
  const double quarter = 0.5 * kPi * 60.0;
  return tube_along({{.length = before},
                     {.length = quarter, .bend_radius = 60.0, .toward = Vec3::UnitX()},
                     {.length = 20.0},
                     {.length = quarter, .bend_radius = 60.0, .toward = Vec3::UnitY()},
                     {.length = behind}},
                    radius, rings, 24);
}

}  // namespace

Vessel make_s_tube() { return two_bends(40.0, 80.0, 5.0, 84); }

Vessel make_long_s_tube() { return two_bends(200.0, 260.0, 6.0, 170); }

Vessel make_paper_tube() {
  const double quarter = 0.5 * kPi * 30.0;
  Vessel vessel = tube_along({{.length = 8.0},
                              {.length = quarter, .bend_radius = 30.0, .toward = Vec3::UnitX()},
                              {.length = 57.0 - quarter}},
                             3.0, 29, 20);
  vessel.wall.young_modulus = 1.0;
  return vessel;
}

Surface decimate(const Surface& surface, int triangles) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& vertex : surface.vertices.colwise()) points->InsertNextPoint(vertex.data());
  vtkNew<vtkCellArray> cells;
  for (const auto& corner : surface.triangles.colwise()) {
    cells->InsertNextCell({corner[0], corner[1], corner[2]});
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  // VTK does not look whether the triangles that it leaves cut each other: then a few more of them.
  constexpr double kMore = 1.02;
  for (double wanted = triangles + 0.5;; wanted *= kMore) {
    vtkNew<vtkDecimatePro> filter;
    filter->SetInputData(data);
    filter->SetTargetReduction(1.0 - wanted / static_cast<double>(cells->GetNumberOfCells()));
    filter->PreserveTopologyOn();
    filter->SplittingOff();
    filter->Update();
    Surface decimated = preprocess::surface_from(filter->GetOutput());
    const preprocess::SurfaceCheck check = preprocess::check_surface(decimated);
    if (preprocess::is_sound(check) ||
        wanted * kMore > static_cast<double>(cells->GetNumberOfCells())) {
      preprocess::require_sound(check, "the decimated surface");
      return decimated;
    }
  }
}

std::vector<BenchWall> make_bench_walls() {
  return {{"narrow", "a tube of radius 0.4 mm, narrower than the wire", narrow_tube(), 0.4},
          {"stenosis", "a tube of radius 4 mm that narrows to 0.3 mm", stenosis()},
          {"elbow", "a tube with a sharp corner of 90 degrees", elbow()},
          {"folds", "a tube whose radius jumps between 4 and 2.2 mm every 0.7 mm", folds()},
          {"slivers", "a tube of triangles 0.4 mm wide, 6 mm and 0.01 mm long", slivers()},
          {"cone", "a cone from radius 4 mm to 0.01 mm", cone()}};
}

bool is_inside(const Surface& surface, const Vec3& point) {
  double sum = 0.0;  // of solid angles; 4 pi inside
  for (const auto& corner : surface.triangles.colwise()) {
    const Vec3 a = surface.vertices.col(corner[0]) - point;
    const Vec3 b = surface.vertices.col(corner[1]) - point;
    const Vec3 c = surface.vertices.col(corner[2]) - point;
    const double x = a.norm(), y = b.norm(), z = c.norm();
    sum +=
        2.0 * std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return sum > 2.0 * kPi;
}

}  // namespace wireplan::pipeline
