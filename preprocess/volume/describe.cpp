#include "preprocess/volume/describe.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <map>

#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/dicom_series.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// How many voxels have each value; empty where some are no whole numbers or there are many of
/// them.
std::map<int, std::size_t> count_values(const std::vector<float>& values) {
  constexpr std::size_t kMost = 256;
  constexpr float kLargest = 1e6F;
  std::map<int, std::size_t> counts;
  auto last = counts.end();
  for (const float value : values) {
    if (!(value >= 0.0F && value <= kLargest) || value != std::floor(value)) return {};
    const int number = static_cast<int>(value);
    if (last == counts.end() || last->first != number) last = counts.try_emplace(number, 0).first;
    ++last->second;
    if (counts.size() > kMost) return {};
  }
  return counts;
}

/// Labels lie in patches: most voxels are as the one before. Grey values are noisy.
bool lies_in_patches(const std::vector<float>& values) {
  constexpr double kLeast = 0.8;  // chosen, not measured
  std::size_t equal = 0;
  for (std::size_t k = 1; k < values.size(); ++k) equal += values[k] == values[k - 1] ? 1 : 0;
  return static_cast<double>(equal) >= kLeast * static_cast<double>(values.size() - 1);
}

void describe_values(const Image& image, VolumeDescription& told) {
  const auto [least, largest] = std::minmax_element(image.values.begin(), image.values.end());
  told.least = static_cast<double>(*least);
  told.largest = static_cast<double>(*largest);
  if (!told.series.empty()) return;  // DICOM images are measured
  const std::map<int, std::size_t> counts = count_values(image.values);
  told.holds_labels = !counts.empty() && lies_in_patches(image.values);
  if (!told.holds_labels) return;
  for (const auto& [value, voxels] : counts) {
    LabelDescription label{.value = value, .name = {}, .voxels = voxels};
    const auto named = told.header.label_names.find(value);
    if (named != told.header.label_names.end()) label.name = named->second;
    for (const NamedSegment& segment : told.header.segments) {
      if (segment.value == value) label.name = segment.name;
    }
    told.labels.push_back(label);
  }
  for (const NamedSegment& segment : told.header.segments) {
    if (counts.count(segment.value) > 0) continue;
    told.labels.push_back({.value = segment.value, .name = segment.name, .voxels = 0});
  }
}

/// The message with "file 5 of 60" in the place of the names of a folder's files, which may be a
/// patient's.
std::string without_file_names(std::string message, const fs::path& folder) {
  if (message.find(folder.string()) == std::string::npos || !fs::is_directory(folder)) {
    return message;
  }
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) names.push_back(entry.path().string());
  }
  std::sort(names.begin(), names.end());
  for (std::size_t k = names.size(); k-- > 0;) {  // "im10" before "im1"
    const std::string number =
        "file " + std::to_string(k + 1) + " of " + std::to_string(names.size());
    for (std::size_t at = 0; (at = message.find(names[k], at)) != std::string::npos;) {
      message.replace(at, names[k].size(), number);
    }
  }
  return message;
}

}  // namespace

VolumeDescription describe_volume(const fs::path& path) {
  VolumeDescription told;
  std::optional<Image> image;
  std::optional<Error> refused;
  try {
    image = read_told(path, "", told.header);
  } catch (const DiskError&) {
    throw;  // the file is not to blame
  } catch (const Error& error) {
    refused = error;
  }
  if (told.header.format == "DICOM") {
    told.series = describe_dicom(path);
    for (SeriesDescription& series : told.series) {
      series.problem = without_file_names(series.problem, path);
    }
  }
  if (refused) {
    const bool told_header = !told.series.empty() || told.header.size[0] > 0;
    const std::string text = without_file_names(refused->what(), path);
    if (!told_header) throw Error(text);
    told.refused = without_path(text, path);
    return told;
  }
  told.grid = image->grid;
  told.modality = image->modality;
  told.remarks = image->remarks;
  describe_values(*image, told);
  return told;
}

}  // namespace wireplan::preprocess
