// The lines of `wireplan inspect`, from its JSON.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/files/text.h"
#include "pipeline/report/inspect.h"
#include "preprocess/segment/segment.h"
#include "preprocess/volume/describe.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kBy = " x ";

/// A length or coordinate for people: without exponent or a rest of rounding.
std::string shown(double value) {
  constexpr double kRounding = 1e-7, kManyDigits = 1e4;
  if (std::abs(value) < kRounding) return "0";
  return format(std::abs(value) < kManyDigits ? "%.5g" : "%.0f", value);
}

std::string joined_numbers(const Json& values, const char* between) {
  std::string text;
  for (const Json& value : values) {
    if (!text.empty()) text += between;
    text += shown(value.get<double>());
  }
  return text;
}

std::string counted(int count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// What a line is about, and what it says.
using Lines = std::vector<std::pair<std::string, std::string>>;

std::string text_or(const Json& value, const char* otherwise) {
  return value.is_string() ? value.get<std::string>() : otherwise;
}

/// Whether neither its number nor its description tells a series from the others.
bool needs_key(const Json& series, const Json& all) {
  if (series["number"].is_null() && series["description"].is_null()) return true;
  return std::any_of(all.begin(), all.end(), [&](const Json& other) {
    return other["key"] != series["key"] && other["number"] == series["number"] &&
           other["description"] == series["description"];
  });
}

std::string series_text(const Json& series, const Json& all) {
  std::string text = "  series " + text_or(series["number"], "without number");
  if (series["description"].is_string()) {
    text += " \"" + series["description"].get<std::string>() + "\"";
  }
  if (needs_key(series, all)) {
    text += " (\"" + series["key"].get<std::string>() + "\" in a case)";
  }
  text += ", " + text_or(series["modality"], "modality unknown") +
          (series["read"].get<bool>() ? ": the one that wireplan reads\n" : ": not read\n");
  const int files = series["files"].get<int>(), images = series["images"].get<int>();
  text += "    images       " + counted(images, files == images ? "slice" : "frame") + " in " +
          counted(files, "file") + ", " + std::to_string(series["columns"].get<int>()) + kBy +
          std::to_string(series["rows"].get<int>()) + " pixels of " +
          (series["pixel_spacing_mm"].is_array()
               ? joined_numbers(series["pixel_spacing_mm"], kBy) + " mm"
               : "unknown size") +
          (series["slice_spacing_mm"].is_number()
               ? format(", %.5g mm apart", series["slice_spacing_mm"].get<double>())
               : "") +
          "\n";
  text += "    orientation  " + series["orientation"].get<std::string>() + "\n";
  if (series["value_unit"].is_string()) {
    text += "    values       in " + series["value_unit"].get<std::string>() + "\n";
  }
  const Json& syntax = series["transfer_syntax"];
  text += "    packed as    " + syntax["name"].get<std::string>() + " (" +
          syntax["uid"].get<std::string>() + ")\n";
  if (series.contains("problem")) {
    text += "    no volume    " + series["problem"].get<std::string>() + "\n";
  }
  return text;
}

Lines volume_lines(const Json& told) {
  Lines lines;
  const Json& volume = told["volume"];
  std::string size = joined_numbers(volume["size"], kBy) + " voxels";
  if (volume.contains("spacing_mm")) {
    std::array<double, 3> extent{};
    for (std::size_t k = 0; k < 3; ++k) {
      extent[k] = volume["size"][k].get<double>() * volume["spacing_mm"][k].get<double>();
    }
    size += " of " + joined_numbers(volume["spacing_mm"], kBy) + " mm (" +
            format("%.0f x %.0f x %.0f mm)", extent[0], extent[1], extent[2]);
  }
  lines.emplace_back(told["kind"] == "dicom" ? "volume" : "size", size);
  if (volume.contains("axes") && told["kind"] != "dicom") {  // each series tells its own
    lines.emplace_back("orientation", volume["orientation"].get<std::string>() + " (axes " +
                                          volume["axes"].get<std::string>() + ")");
  }
  if (volume.contains("origin_mm")) {
    lines.emplace_back("origin", "(" + joined_numbers(volume["origin_mm"], ", ") + ") mm, LPS");
  }
  if (told.contains("header")) {
    const Json& header = told["header"];
    const double mm = header["mm_per_unit"].get<double>();
    std::string unit = header["length_unit"].is_string()
                           ? "lengths in " + header["length_unit"].get<std::string>()
                           : "no unit of length, taken as mm";
    if (mm != 1.0) unit += format(", made mm by %g", mm);
    if (header.contains("placed_by")) {
      unit += "; placed by its " + header["placed_by"].get<std::string>();
    }
    lines.emplace_back("header", unit);
    if (header["stored_as"].is_string()) lines.emplace_back("stored as", header["stored_as"]);
  }
  if (volume.contains("values")) {
    const bool image = told["kind"] == "image";
    const std::string modality = text_or(volume["modality"], "");
    const auto least = volume["values"][0].get<double>(),
               largest = volume["values"][1].get<double>();
    lines.emplace_back(
        "values",
        format("%.6g to %.6g", least, largest) +
            (modality == "CT"    ? " HU"
             : !modality.empty() ? ", no Hounsfield units: its modality is " + modality
             : !image            ? ""
             : preprocess::looks_hounsfield(least, largest)
                 ? ", which a case takes as HU (no modality is told)"
                 : ", which a case takes as no Hounsfield units (no modality is told, and "
                   "no air below zero)"));
  }
  return lines;
}

std::string labels_text(const Json& labels) {
  std::vector<std::vector<std::string>> rows = {{"  label", "name", "voxels", "ml"}};
  for (const Json& label : labels) {
    const std::string layer = label.contains("layer") ? " in layer " + label["layer"].dump() : "";
    rows.push_back({"  " + label["value"].dump() + layer, text_or(label["name"], "-"),
                    std::to_string(label["voxels"].get<std::size_t>()),
                    format("%.3f", label["volume_ml"].get<double>())});
  }
  return labels.empty() ? "  no voxel has a label\n" : format_table(rows);
}

Lines surface_lines(const Json& surface) {
  Lines lines;
  const int pieces = surface["pieces"].get<int>(), closed = surface["closed_pieces"].get<int>();
  lines.emplace_back("triangles", std::to_string(surface["triangles"].get<int>()) + " in " +
                                      counted(pieces, "piece") +
                                      (pieces == 1  ? (closed == 1 ? ", closed" : ", open")
                                       : closed > 0 ? ", closed: " + std::to_string(closed)
                                                    : ", none closed"));
  lines.emplace_back("extent", "from (" + joined_numbers(surface["low"], ", ") + ") to (" +
                                   joined_numbers(surface["high"], ", ") +
                                   ") in the file's unit, which it does not tell");
  const std::array<std::pair<const char*, double>, 3> units = {
      {{"mm", 1.0}, {"cm", 10.0}, {"m", 1000.0}}};
  for (const auto& [unit, mm] : units) {
    Json extent = Json::array();
    for (std::size_t k = 0; k < 3; ++k) {
      extent.push_back(mm * (surface["high"][k].get<double>() - surface["low"][k].get<double>()));
    }
    std::string text = joined_numbers(extent, kBy) + " mm";
    if (surface["usual_radius"].is_number()) {
      const double radius = mm * surface["usual_radius"].get<double>();
      text += format(radius < 100.0 ? ", radius about %.3g mm" : ", radius about %.0f mm", radius);
    }
    const Json& fitting = surface["fitting_units"];
    if (std::find(fitting.begin(), fitting.end(), unit) != fitting.end()) {
      text += ": plausible for a vessel";
    }
    lines.emplace_back("as " + std::string(unit), text);
  }
  lines.emplace_back("frame", surface["frame"].is_string()
                                  ? "the file says " + surface["frame"].get<std::string>()
                                  : "not told; the case says LPS or RAS");
  if (surface.contains("read_as")) {
    const Json& as = surface["read_as"];
    for (const Json& mend : surface["mended"]) lines.emplace_back("mended", mend);
    const Json& openings = surface["openings"];
    const std::string how = "as " + as["unit"].get<std::string>() + " and " +
                            as["frame"].get<std::string>() + ", told in mm and LPS";
    lines.emplace_back("openings", openings.empty()
                                       ? "none found"
                                       : std::to_string(openings.size()) + " (read " + how + ")");
    for (const Json& opening : openings) {
      lines.emplace_back("", "radius " + format("%.3g", opening["radius_mm"].get<double>()) +
                                 " at (" + joined_numbers(opening["center_mm"], ", ") + ")");
    }
  }
  return lines;
}

/// Why a case refuses it; empty where it does not.
std::string refusal_text(const Json& told) {
  if (!told.contains("refused")) return {};
  const bool segments = told.contains("segments");
  const char* start = segments           ? "as its volume a case refuses it: "
                      : is_refused(told) ? "a case refuses it: "
                                         : "a case refuses it as long as it names no series: ";
  return start + told["refused"].get<std::string>() +
         (segments ? "; its segments may be a case's labels" : "") + "\n";
}

std::string columns(const Lines& lines) {
  std::string text;
  for (const auto& [about, says] : lines) {
    text += format("  %-12s ", about.c_str());
    text += says;
    text += "\n";
  }
  return text;
}

}  // namespace

bool is_refused(const Json& told) {
  if (!told.contains("refused")) return false;
  const std::string why = told["refused"];
  const Json series = told.value("series", Json::array());
  return why.find(preprocess::kSeveralSeries) == std::string::npos ||
         std::all_of(series.begin(), series.end(),
                     [](const Json& one) { return one.contains("problem"); });
}

std::string inspect_text(const Json& told) {
  const std::string kind = told["kind"];
  const Json series = told.value("series", Json::array());
  std::string text = told["path"].get<std::string>() + ": " + told["format"].get<std::string>();
  text += kind == "dicom"              ? ", " + std::to_string(series.size()) + " series\n"
          : told["format"] == "folder" ? " of labels, one file per class\n"
          : kind == "labels"           ? ", a volume of labels\n"
          : kind == "image"            ? ", a volume\n"
                                       : " surface\n";
  text += refusal_text(told);  // before all that it holds
  for (const Json& one : series) text += series_text(one, series);
  if (told.contains("volume")) text += columns(volume_lines(told));
  if (told.contains("labels")) text += labels_text(told["labels"]);
  if (told.contains("other_volumes")) {
    text +=
        columns({{"other volumes", told["other_volumes"].dump() + ", which are no single class"}});
  }
  if (told.contains("segments")) {
    for (const Json& segment : told["segments"]) {
      text += columns({{"segment", std::to_string(segment["value"].get<int>()) + " in layer " +
                                       std::to_string(segment["layer"].get<int>()) + ": " +
                                       segment["name"].get<std::string>()}});
    }
  }
  for (const Json& remark : told.value("remarks", Json::array()))
    text += columns({{"note", remark}});
  if (told.contains("surface")) text += columns(surface_lines(told["surface"]));
  return text;
}

}  // namespace wireplan::pipeline
