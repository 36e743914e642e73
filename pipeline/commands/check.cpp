#include "pipeline/commands/check.h"

#include "pipeline/files/text.h"
#include "pipeline/stages/makers.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "preprocess/volume/image.h"

namespace wireplan::pipeline {
namespace {

// Within the cell of some voxel.
bool contains(const preprocess::Grid& grid, const Vec3& point) {
  const Vec3 ijk = grid.ijk_from_lps(point);
  const Eigen::Array3d size(grid.size[0], grid.size[1], grid.size[2]);
  return (ijk.array() >= -0.5).all() && (ijk.array() < size - 0.5).all();
}

void check_volume(const Case& given, Problems& problems, std::vector<std::string>& told) {
  if (!preprocess::reads_volumes()) {
    problems.add("volume.path", given.volume->given, "a surface: this wireplan has no imaging",
                 "configure with -DWIREPLAN_IMAGING=ON");
    return;
  }
  const preprocess::Image image = preprocess::read_image(given.volume->path, given.volume->series);
  if (given.labels) told = check_labels(given, &image);  // of which points may be given
  const preprocess::Grid& grid = image.grid;
  const auto expect_inside = [&](const std::string& key, const Vec3& point) {
    if (!contains(grid, point)) {
      problems.add(key, to_json(point).dump(), "a point inside the volume",
                   "points are in mm, patient LPS; given in RAS?");
    }
  };
  for (const auto& [key, point] : end_points(given)) expect_inside(key, point);
  for (std::size_t k = 0; k < given.segmentation.seeds.size(); ++k) {
    expect_inside("segmentation.seeds_mm[" + std::to_string(k) + "]", given.segmentation.seeds[k]);
  }
  for (const std::string& line : warn_of_values(image)) told.push_back("mind: " + line);
}

/// A target in the free ball round an access is reached before a wire is pushed.
void expect_apart(Case given, const Surface& surface, Problems& problems) {
  for (given.access = 0; given.access < given.accesses.size(); ++given.access) {
    const Vec3 access = given.accesses[given.access].point;
    const preprocess::InsideAnswer at = preprocess::locate_point(surface, access);
    for (given.target = 0; at.inside && given.target < given.targets.size(); ++given.target) {
      const TargetInput& target = given.targets[given.target];
      if (target.beyond_mm > 0.0 || (target.point - access).norm() >= at.distance) continue;
      problems.add(target_point_key(given), to_json(target.point).dump(),
                   "a point further from " + access_point_key(given) + " than the wall is, " +
                       format("%.1f mm", at.distance),
                   "a wire would be there before it is pushed");
    }
  }
}

std::vector<std::string> check_surface_file(const Case& given, Problems& problems) {
  const SurfaceInput& input = *given.surface_input;
  const preprocess::RepairedSurface repaired =
      preprocess::read_sound_surface(input.path, input.unit, input.frame);
  const Surface& surface = repaired.surface;
  const auto expect_inside = [&](const std::string& key, const Vec3& point) {
    if (!preprocess::locate_point(surface, point).inside) {
      const std::string of_piece = preprocess::tell_dropped(repaired.dropped, surface, point);
      problems.add(key, to_json(point).dump(), "a point inside the surface",
                   of_piece.empty() ? "wrong surface.unit or surface.frame?" : "it " + of_piece);
    }
  };
  for (const auto& [key, point] : end_points(given)) expect_inside(key, point);
  expect_apart(given, surface, problems);
  std::vector<std::string> told = preprocess::tell_mends(repaired.mends);
  for (std::string& line : told) line = "mended: " + line;
  return told;
}

}  // namespace

std::vector<std::string> check_input(const Case& given) {
  Problems problems(given.file.string());
  std::vector<std::string> told;
  if (given.volume) check_volume(given, problems, told);
  if (given.labels && !given.volume) told = check_labels(given, nullptr);
  if (given.surface_input) told = check_surface_file(given, problems);
  problems.throw_if_any();
  return told;
}

}  // namespace wireplan::pipeline
