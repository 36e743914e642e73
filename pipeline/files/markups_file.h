#pragma once
/// Points where people place them: markups of 3D Slicer (.mrk.json, .fcsv of before, tables .csv
/// and .tsv of control points) and voxels of the volume, in the place of a case's numbers.
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

struct MarkupPoint {
  std::string label;
  Vec3 point = Vec3::Zero();  // LPS                                                      [mm]
};

struct Markups {
  std::vector<MarkupPoint> points;
  std::vector<std::string> unplaced;  // labels of points that have no position
};

/// The points of all lists, fiducials and curves alike; the frame is the file's own (LPS or RAS).
/// Columns of a table are those that its header names; hidden and unselected points are points too.
/// Throws `Error` where it is missing, no markups, damaged, or in another unit or frame.
Markups read_markups(const std::filesystem::path& path);

/// Puts "point_mm" in the place of each "point" of accesses and targets, and a point in that of
/// each object in "segmentation.seeds_mm". Such an object is one of
///   {"markups": FILE, "label": LABEL}   sought from `folder`; the label may be left out where the
///                                       file has one point
///   {"ijk": [I, J, K]}                  of the case's volume, counted from 0 as read_image's Grid
///                                       does, parts of voxels too; the volume is read for it
/// After a problem some other point stands in its place, so that all else can be told too.
void resolve_points(Json& file, const std::filesystem::path& folder, Problems& problems);

/// The same in a scene: of its supports, its insertion and its target, under "point" as in a case
/// or in the place of the three numbers of "point_mm"; and all points of {"markups": FILE}, in
/// their order, in the place of the "nodes_mm" of its lines.
void resolve_scene_points(Json& file, const std::filesystem::path& folder, Problems& problems);

}  // namespace wireplan::pipeline
