#pragma once
/// Vessel <-> artifact files, lossless (64 bit, VTK XML with raw appended data compressed by zlib,
/// no dates: the same values give the same bytes), readable by 3D Slicer and ParaView. Every file
/// carries the field data SPACE = LPS. Functions throw `Error` naming the file where it cannot be
/// written, is missing, damaged or holds something else.
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

void write_surface(const Surface& surface, const std::filesystem::path& path);  // .vtp
Surface read_surface_artifact(const std::filesystem::path& path);

/// .vtp polyline with point arrays `radius_mm` and `arc_length_mm`.
void write_centerline(const Centerline& line, const std::filesystem::path& path);
Centerline read_centerline(const std::filesystem::path& path);

/// Several lines in one .vtp, with the same arrays and the cell array `branch`, their number.
void write_centerlines(const std::vector<Centerline>& lines, const std::filesystem::path& path);
std::vector<Centerline> read_centerlines(const std::filesystem::path& path);

/// Values that a viewer shows on the points or cells of a file, under a name.
struct NamedArray {
  std::string name;
  std::vector<double> values;  // one per point or cell
};

/// .vtu of tetrahedra, one per triangle of the surface: points are the surface's vertices, then the
/// apexes; cell array `height_mm` and those given, field data `young_modulus_mpa` and
/// `poisson_ratio`.
void write_wall(const Surface& surface, const Wall& wall, const std::filesystem::path& path,
                const std::vector<NamedArray>& arrays = {});
Wall read_wall(const std::filesystem::path& path);

/// One of the cell arrays that write_wall was given: a value per triangle.
std::vector<double> read_wall_array(const std::filesystem::path& path, const std::string& name);

/// A polyline with named point arrays, for wires: .vtp.
void write_polyline(const Eigen::Matrix3Xd& points, const std::vector<NamedArray>& arrays,
                    const std::filesystem::path& path);

/// ParaView collection (.pvd) of the files, one per time value; the files are named relative to the
/// collection's folder.
void write_time_series(const std::vector<std::filesystem::path>& files,
                       const std::vector<double>& times, const std::filesystem::path& path);

}  // namespace wireplan::preprocess
