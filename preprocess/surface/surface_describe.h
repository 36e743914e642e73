#pragma once
/// What a file of triangles holds, for people who ask which unit and frame it is in.
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/surface/openings.h"

namespace wireplan::preprocess {

struct SurfaceDescription {
  int triangles = 0, pieces = 0, closed_pieces = 0;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // as the numbers stand in the file
  double usual_radius = 0.0;  // of a tube of this volume and area, in the file's unit; 0: open
  std::string frame;          // as told_frame
  std::vector<std::string> fitting_units;  // in which it has a vessel's size: "mm"
  // As a case reads it, in the first of these (mm where there is none) and its frame (LPS).
  std::vector<std::string> mends;  // as tell_mends
  std::vector<Opening> openings;   //                                                      [mm]
  std::string refused;             // why a case does not read it, without the path; empty: it does
};

inline constexpr std::array<const char*, 3> kLengthUnits = {"mm", "cm", "m"};

/// Throws `Error`, as read_triangles does, where it holds no triangles.
SurfaceDescription describe_surface(const std::filesystem::path& path);

}  // namespace wireplan::preprocess
