#include "pipeline/report/inspect.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "pipeline/files/labels_file.h"
#include "pipeline/files/text.h"
#include "preprocess/surface/surface_describe.h"
#include "preprocess/text.h"
#include "preprocess/volume/describe.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/labels.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRead =
    "expected a folder of DICOM files, a volume (.nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd) or a "
    "surface (.stl, .ply, .obj, .vtp)";
constexpr double kMm3PerMl = 1000.0;

Json told_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

std::string ending_of(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  return name.ends_with(".nii.gz") ? ".nii.gz" : fs::path(name).extension().string();
}

bool is_surface(const std::string& ending) {
  static const std::set<std::string> kEndings = {".stl", ".ply", ".obj", ".vtp"};
  return kEndings.count(ending) > 0;
}

bool is_volume(const std::string& ending) {
  static const std::set<std::string> kEndings = {".nii",  ".nii.gz", ".nrrd",
                                                 ".nhdr", ".mha",    ".mhd"};
  return kEndings.count(ending) > 0;
}

/// Volumes that are not read; their reader says why.
bool is_other_volume(const std::string& ending) {
  return ending == ".hdr" || ending == ".img" || ending == ".gz";
}

// ---- Volumes -----------------------------------------------------------------------------------

/// Which way an axis mostly runs: left, right, posterior, anterior, superior, inferior.
char letter_of_axis(const Vec3& axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return std::array{"RL", "AP", "IS"}[static_cast<std::size_t>(largest)][axis[largest] > 0 ? 1 : 0];
}

std::string orientation_of(const Mat3& direction) {
  static const std::map<char, std::string> kSlices = {
      {'S', "axial slices from feet to head"},     {'I', "axial slices from head to feet"},
      {'A', "coronal slices from back to front"},  {'P', "coronal slices from front to back"},
      {'L', "sagittal slices from right to left"}, {'R', "sagittal slices from left to right"}};
  static const std::map<char, std::string> kToward = {
      {'S', "the head"}, {'I', "the feet"},           {'A', "the front"},
      {'P', "the back"}, {'L', "the patient's left"}, {'R', "the patient's right"}};
  std::string text = kSlices.at(letter_of_axis(direction.col(2))) + ", rows to " +
                     kToward.at(letter_of_axis(direction.col(0))) + ", columns to " +
                     kToward.at(letter_of_axis(direction.col(1)));
  const double straightest = direction.cwiseAbs().colwise().maxCoeff().minCoeff();
  const double turned = std::acos(std::min(1.0, straightest)) / kRadPerDeg;
  if (turned >= 1.0) text += format(", oblique by %.0f degrees", turned);
  return text;
}

Json placement_json(const preprocess::Grid& grid) {
  Json placed = {{"size", grid.size}, {"spacing_mm", to_json(grid.spacing)}};
  placed["origin_mm"] = to_json(grid.origin);
  std::string axes;
  for (Eigen::Index k = 0; k < 3; ++k) {
    axes += letter_of_axis(grid.direction.col(k));
    placed["directions"].push_back(to_json(Vec3(grid.direction.col(k))));
  }
  placed["axes"] = axes;
  placed["orientation"] = orientation_of(grid.direction);
  return placed;
}

Json series_json(const preprocess::SeriesDescription& series) {
  const preprocess::Grid& grid = series.grid;
  Json told = {{"number", told_or_null(series.number)},
               {"key", series.key},
               {"description", told_or_null(series.description)},
               {"modality", told_or_null(series.modality)},
               {"value_unit", told_or_null(series.unit)},
               {"transfer_syntax", {{"name", series.syntax}, {"uid", series.syntax_uid}}},
               {"files", series.files},
               {"images", series.images},
               {"columns", grid.size[0]},
               {"rows", grid.size[1]}};
  told["pixel_spacing_mm"] = nullptr;
  if (series.spaced) told["pixel_spacing_mm"] = Json::array({grid.spacing[0], grid.spacing[1]});
  told["slice_spacing_mm"] = series.placed ? Json(grid.spacing[2]) : Json(nullptr);
  told["orientation"] = orientation_of(grid.direction);
  told["read"] = series.read;
  if (!series.problem.empty()) told["problem"] = series.problem;
  return told;
}

Json class_row(int value, const std::string& name, std::size_t voxels, double mm3) {
  return {{"value", value},
          {"name", told_or_null(name)},
          {"voxels", voxels},
          {"volume_ml", mm3 / kMm3PerMl}};
}

Json classes_json(const std::vector<preprocess::ListedClass>& classes) {
  Json rows = Json::array();
  const bool layered =
      std::any_of(classes.begin(), classes.end(),
                  [](const preprocess::ListedClass& one) { return one.layer > 0; });
  for (const preprocess::ListedClass& one : classes) {
    rows.push_back(class_row(one.value, one.name, one.voxels, one.volume_mm3));
    if (layered) rows.back()["layer"] = one.layer;
  }
  return rows;
}

/// A file of several layers, which is no volume but may be labels; null where it is none.
Json layers_json(const fs::path& path) {
  try {
    return classes_json(preprocess::list_labels(path, {}).classes);
  } catch (const DiskError&) {
    throw;
  } catch (const Error&) {
    return nullptr;
  }
}

/// A folder with one file per class; null where it is none.
Json label_folder_json(const fs::path& folder) {
  preprocess::LabelListing listing;
  try {
    listing = preprocess::list_labels(folder, {});
  } catch (const DiskError&) {
    throw;
  } catch (const Error&) {
    return nullptr;
  }
  if (listing.classes.empty()) return nullptr;
  Json told = {{"kind", "labels"}, {"format", "folder"}, {"labels", classes_json(listing.classes)}};
  if (listing.others > 0) told["other_volumes"] = listing.others;
  if (!listing.remarks.empty()) told["remarks"] = listing.remarks;
  return told;
}

Json volume_json(const preprocess::VolumeDescription& given, const fs::path& path) {
  const preprocess::VolumeHeader& header = given.header;
  std::vector<std::string> remarks = given.remarks;
  Json told = {{"kind", given.holds_labels ? "labels" : "image"}, {"format", header.format}};
  if (header.format == "DICOM") {
    told["kind"] = "dicom";
    for (const auto& series : given.series) told["series"].push_back(series_json(series));
  } else {
    told["header"] = {{"stored_as", told_or_null(header.stored_as)},
                      {"length_unit", told_or_null(header.length_unit)},
                      {"mm_per_unit", header.mm_per_unit}};
    if (!header.placed_by.empty()) told["header"]["placed_by"] = header.placed_by;
  }
  if (given.grid) {
    told["volume"] = placement_json(*given.grid);
    told["volume"]["modality"] = told_or_null(given.modality);
    told["volume"]["values"] = {given.least, given.largest};
  } else if (header.size[0] > 0) {
    told["volume"] = {{"size", header.size}};
    if (header.spacing.allFinite() && header.spacing.minCoeff() > 0.0) {
      told["volume"]["spacing_mm"] = to_json(header.spacing);
    }
  }
  if (given.holds_labels) {
    const double voxel = given.grid->spacing.prod();
    const bool names_itself = !header.segments.empty() || !header.label_names.empty();
    const FoundTable found = names_itself ? FoundTable{} : find_label_table(path);
    const std::map<int, std::string>& table = found.names;
    if (!found.problem.empty()) remarks.push_back("its labels have no names: " + found.problem);
    told["labels"] = Json::array();
    for (const preprocess::LabelDescription& label : given.labels) {
      if (label.value == 0) continue;  // what is around
      told["labels"].push_back(
          class_row(label.value, table.contains(label.value) ? table.at(label.value) : label.name,
                    label.voxels, voxel * static_cast<double>(label.voxels)));
    }
  } else if (!header.segments.empty()) {
    if (Json rows = layers_json(path); !rows.is_null()) {
      told["kind"] = "labels";
      told["labels"] = std::move(rows);
      return told;
    }
    for (const preprocess::NamedSegment& segment : header.segments) {
      told["segments"].push_back(
          {{"value", segment.value}, {"layer", segment.layer}, {"name", segment.name}});
    }
  }
  if (!remarks.empty()) told["remarks"] = remarks;
  if (!given.refused.empty()) told["refused"] = given.refused;
  return told;
}

// ---- Surfaces ----------------------------------------------------------------------------------

Json surface_json(const preprocess::SurfaceDescription& given, const std::string& ending) {
  Json told = {{"kind", "surface"}, {"format", ending.substr(1)}};
  std::transform(ending.begin() + 1, ending.end(), told["format"].get_ref<std::string&>().begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  Json surface = {
      {"triangles", given.triangles},
      {"pieces", given.pieces},
      {"closed_pieces", given.closed_pieces},
      {"low", to_json(given.low)},
      {"high", to_json(given.high)},
      {"usual_radius", given.usual_radius > 0.0 ? Json(given.usual_radius) : Json(nullptr)},
      {"frame", told_or_null(given.frame)},
      {"fitting_units", given.fitting_units}};
  if (given.refused.empty()) {
    surface["read_as"] = {
        {"unit", given.fitting_units.empty() ? "mm" : given.fitting_units.front()},
        {"frame", given.frame.empty() ? "LPS" : given.frame}};
    surface["mended"] = given.mends;
    surface["openings"] = Json::array();
    for (const preprocess::Opening& opening : given.openings) {
      surface["openings"].push_back(
          {{"center_mm", to_json(opening.center)}, {"radius_mm", opening.radius}});
    }
  }
  told["surface"] = std::move(surface);
  if (!given.refused.empty()) told["refused"] = given.refused;
  return told;
}

/// What a folder without DICOM images holds, for its error: no names, which may be a patient's.
std::string other_files(const fs::path& folder) {
  std::map<std::string, int> counts;
  int folders = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string ending = ending_of(entry.path());
    if (entry.is_directory()) ++folders;
    if (entry.is_regular_file() && (is_volume(ending) || is_surface(ending))) ++counts[ending];
  }
  std::string text;
  for (const auto& [ending, count] : counts) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + ending;
  }
  if (!text.empty()) return "; it holds other files that are read one by one: " + text;
  return folders > 0 ? "; it holds " + std::to_string(folders) + " folders, give one of them" : "";
}

}  // namespace

Json inspect(const fs::path& path) {
  if (!fs::exists(path)) throw Error(path.string() + ": no such file or folder; " + kRead);
  const std::string ending = ending_of(path);
  const bool folder = fs::is_directory(path);
  Json body;
  if (!folder && is_surface(ending)) {
    body = surface_json(preprocess::describe_surface(path), ending);
  } else if (folder || is_volume(ending) || is_other_volume(ending) ||
             preprocess::check_dicom(path) != preprocess::DicomForm::kNone) {
    try {
      body = volume_json(preprocess::describe_volume(path), path);
    } catch (const DiskError&) {
      throw;
    } catch (const Error& error) {
      if (folder) body = label_folder_json(path);
      if (body.is_null()) throw Error(error.what() + (folder ? other_files(path) : std::string()));
    }
  } else {
    throw Error(path.string() + ": not a file that wireplan reads; " + kRead);
  }
  Json told = {{"schema", kInspectSchema}, {"path", path.string()}};
  told.update(body);
  return told;
}

}  // namespace wireplan::pipeline
