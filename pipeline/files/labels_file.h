#pragma once
/// The key `labels` of a case, a segmentation that somebody else made, and tables of label names;
/// and the key `mask`, of what becomes of these or of a volume.
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "pipeline/files/json_reader.h"
#include "preprocess/segment/mask_shape.h"
#include "preprocess/volume/labels.h"

namespace wireplan::pipeline {

/// As VolumeInput: paths resolved, and as the case file gives them.
struct LabelsInput {
  std::filesystem::path path;  // a file, or a folder with one file per class
  std::string given;
  std::string table_given;  // empty where the case names no table
  preprocess::LabelChoice choice;
};

/// Names of values, from nnU-Net's dataset.json, another JSON object of names and values (either
/// way round), or lines of text with a value and a name: CSV, 3D Slicer's colour tables, ITK-SNAP's
/// label descriptions. A first line that names columns ("name,r,g,b,value") chooses them; without
/// one value and name begin the line. Throws `Error` where it is none of these, or a value has two
/// names.
std::map<int, std::string> read_label_table(const std::filesystem::path& path);

struct FoundTable {
  std::map<int, std::string> names;
  std::string problem;  // a line for each file that may be meant as the table and is none; empty
                        // where one was read
};

/// The table beside a file of labels: of its name, ending in .json, .csv, .tsv, .txt or .ctbl, or a
/// dataset.json in its folder or the one above; the first of them that is one. Behind one that is
/// broken none is looked for: its names may be others.
FoundTable find_label_table(const std::filesystem::path& labels);

/// Reads the labels of a case. What is wrong with a table beside them is told with what is wrong
/// with the names, or in the remarks where none were asked for.
preprocess::LabelVolume read_labels(const LabelsInput& labels,
                                    const preprocess::Grid* onto = nullptr);

/// Reads {"path", "values", "names", "table"}; paths are sought from `folder`.
LabelsInput read_labels_input(JsonReader reader, const std::filesystem::path& folder);

/// Puts "point_mm" in the place of "branch" and where in it, "beyond_ostium_mm" or "end", of
/// accesses and targets. The labels that the case names are read for it, from `folder`. What has no
/// place, which is told, gets one apart from all others.
void resolve_branches(Json& file, const std::filesystem::path& folder, Problems& problems);

/// As the file has them.
Json labels_json(const LabelsInput& labels);

/// Reads "mask" {"most_handles", "most_faces"}: how complicated a mask may be. A surface as input
/// has none.
preprocess::MaskLimits read_mask_limits(JsonReader& root, bool from_surface);
Json mask_limits_json(const preprocess::MaskLimits& limits);

}  // namespace wireplan::pipeline
