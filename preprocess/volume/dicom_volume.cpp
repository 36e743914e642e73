#include "preprocess/volume/dicom_volume.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

Mat3 axes_of(const DicomFrame& frame) {
  Mat3 axes;
  axes << frame.right, frame.down, frame.right.cross(frame.down);
  return axes;
}

/// The images of a series: frames of its one file, or its files.
class Images {
 public:
  explicit Images(const Series& series) : series_(series), frames_(is_enhanced(series)) {}

  bool are_frames() const { return frames_; }
  std::size_t count() const { return frames_ ? series_.front().frames.size() : series_.size(); }
  const DicomFrame& operator[](std::size_t k) const {
    return frames_ ? series_.front().frames[k] : series_[k].image;
  }
  /// How an error about one begins.
  std::string place_of(std::size_t k) const {
    return frames_ ? series_.front().file.string() + ": frame " + std::to_string(number_of(k) + 1) +
                         ": "
                   : series_[k].file.string() + ": ";
  }
  /// "60 frames (1 to 60)", or "60 slices (FILE, FILE and 58 more)".
  std::string shown(const std::vector<std::size_t>& some) const {
    constexpr int kShown = 2;
    std::string text;
    std::size_t told = 0;
    for (int n = 0; n < kShown && told < some.size(); ++n) {
      const std::size_t first = some[told++];
      std::size_t last = first;  // of frames that follow one another
      while (frames_ && told < some.size() && number_of(some[told]) == number_of(last) + 1) {
        last = some[told++];
      }
      text += n == 0 ? "" : ", ";
      text += frames_ ? std::to_string(number_of(first) + 1) : series_[first].file.string();
      if (last > first) text += " to " + std::to_string(number_of(last) + 1);
    }
    if (told < some.size()) text += " and " + std::to_string(some.size() - told) + " more";
    return std::to_string(some.size()) + (frames_ ? " frames (" : " slices (") + text + ")";
  }

  /// Of the images, along the normal of the first.
  std::vector<std::size_t> order() const {
    if (!frames_) return stack(origins_of(series_), series_.front().grid).order;
    Grid grid = series_.front().grid;
    std::vector<Vec3> origins;
    for (const DicomFrame& frame : series_.front().frames) origins.push_back(frame.position);
    if (!origins.empty()) grid.direction = axes_of((*this)[0]);
    return stack(origins, grid).order;
  }

 private:
  std::size_t number_of(std::size_t k) const { return series_.front().frames[k].number; }

  const Series& series_;
  bool frames_;
};

/// Values of a CT are Hounsfield units; a scanner may say that these are not, as those of two
/// energies. "US" is unspecified (PS3.3 section C.11.1.1.2).
void require_hounsfield(const std::string& unit, const std::string& modality,
                        const fs::path& file) {
  if (modality != "CT" || unit.empty() || unit == "HU" || unit == "HU_MOD" || unit == "US") return;
  throw Error(file.string() + ": a CT whose values are not in HU but, by its rescale type, " +
              unit + "; expected HU; export the series of ordinary CT numbers");
}

/// Where the frames of an enhanced file lie.
Stack stack_frames(const Slice& slice, const fs::path& folder) {
  const std::vector<DicomFrame>& frames = slice.frames;
  if (frames.empty()) {
    throw Error(folder.string() + ": a DICOM file of " + std::to_string(slice.grid.size[2]) +
                " frames that does not tell where each lies, expected an enhanced CT with place, "
                "orientation and spacing of every frame; export the series as one file per slice");
  }
  const DicomFrame& first = frames.front();
  std::vector<Vec3> origins;
  for (const DicomFrame& frame : frames) {
    require_place(Vec3(frame.along_row, frame.along_column, 1.0), frame.position, axes_of(frame),
                  folder);
    const bool like_first = (frame.right - first.right).norm() < 1e-3 &&
                            (frame.down - first.down).norm() < 1e-3 &&
                            std::abs(frame.along_row / first.along_row - 1.0) < 1e-3 &&
                            std::abs(frame.along_column / first.along_column - 1.0) < 1e-3;
    if (!like_first) {
      throw Error(folder.string() +
                  ": frames of several orientations or spacings in one DICOM file, expected one "
                  "stack; export them as series of their own");
    }
    origins.push_back(frame.position);
  }
  Grid grid = slice.grid;
  grid.spacing = Vec3(first.along_row, first.along_column, 1.0);
  grid.direction = orthonormal_direction(axes_of(first), folder);
  return stack(origins, grid);
}

/// Which files are copies of one image at its place; empty where none are. `order` is that of their
/// places. Where all images of a folder have one UID, they lie elsewhere and are others.
std::string find_copies(const Series& series, const std::vector<std::size_t>& order) {
  constexpr double kSamePlace = 0.01;  // [mm]
  for (std::size_t n = 1; n < order.size() && order.size() == series.size(); ++n) {
    const Slice& one = series[order[n - 1]];
    const Slice& other = series[order[n]];
    if (one.instance_uid.empty() || one.instance_uid != other.instance_uid) continue;
    if ((one.grid.origin - other.grid.origin).norm() > kSamePlace) continue;
    return other.file.string() + ": the same image as " + one.file.string() +
           " (of one SOP Instance UID (0008,0018) and place), expected each image once; take one "
           "of the two files out";
  }
  return {};
}

DicomParts parts_of_images(const Images& images) {
  std::vector<const DicomPhase*> phases;
  for (std::size_t k = 0; k < images.count(); ++k) phases.push_back(&images[k].phase);
  return find_parts(phases, images.order());
}

/// Why images are of several phases; empty where they are of one.
std::string find_several(const Series& series, const Images& images, const fs::path& folder) {
  constexpr std::size_t kShown = 4;
  const DicomParts parts = parts_of_images(images);
  const std::size_t count = parts.images.size();
  if (count == 0) return {};
  std::string told = folder.string() + ": images of " + parts.what + ", expected one:";
  for (std::size_t k = 0; k < std::min(kShown, count); ++k) {
    told += (k == 0 ? " " : "; ") + images.shown(parts.images[k]);
  }
  if (count > kShown) told += "; and " + std::to_string(count - kShown) + " more";
  const std::string key = key_of(series);
  return told + "; name the one to plan on by \"series\" in the case's volume, from \"" + key +
         ".1\" for the first of these to \"" + key + "." + std::to_string(count) + "\", or " +
         (images.are_frames() ? "export the one to plan on as a series of its own"
                              : "put the files of the one to plan on into a folder of their own");
}

/// Why images are slabs that are much thicker than they are apart, as projections are; empty where
/// they are not. Slices that overlap by half are usual, and scans of 5 mm are read.
std::string find_slab(const Images& images, const Grid& grid) {
  // Of the spacing, which rounding may have made a little less; [mm]; both chosen
  constexpr double kMost = 5.0 * 1.001, kThick = 5.0;
  for (std::size_t k = 0; k < images.count(); ++k) {
    const double thickness = images[k].thickness;
    const bool derived = images[k].type.starts_with("DERIVED");
    if (thickness <= kMost * grid.spacing[2] || (!derived && thickness <= kThick)) continue;
    return images.place_of(k) + "a slab of " + one_decimal(thickness) + " mm (" + kThickness.name +
           ") in images " + one_decimal(grid.spacing[2]) +
           " mm apart, as thick averages and projections (MIP) are, expected slices; give the "
           "series that it was made "
           "of";
  }
  return {};
}

/// Whether values can be nothing else than HU: many are air's, and few are as bright as tissue is
/// that is stored without its usual intercept of -1024.
bool looks_hounsfield(const Series& series, const fs::path& folder, const At& at) {
  constexpr float kAir = -1000.0F, kSpread = 100.0F, kBright = 700.0F;  // [HU]
  constexpr double kLeastAir = 0.01, kMostBright = 0.2;                 // of the voxels; chosen
  double count = 0.0, air = 0.0, bright = 0.0;
  std::vector<float> values;
  for (const Slice& slice : series) {
    at(slice.file.string());
    values.clear();
    append_slice(slice, folder, values);
    count += static_cast<double>(values.size());
    for (const float value : values) {
      air += std::abs(value - kAir) <= kSpread ? 1.0 : 0.0;
      bright += value > kBright ? 1.0 : 0.0;
    }
  }
  return air >= kLeastAir * count && bright <= kMostBright * count;
}

/// Why the values of a CT are not known to be HU, as it does not tell how they are scaled, or not
/// of each image; empty where they are.
std::string find_unscaled(const Series& series, const Images& images, const fs::path& folder,
                          const At& at) {
  if (series.front().modality != "CT") return {};
  std::string lacks;  // all of them
  for (const bool slope : {false, true}) {
    const std::string name = slope ? kSlope.name : kIntercept.name;
    std::size_t without = 0, first = 0;
    for (std::size_t k = images.count(); k-- > 0;) {
      const DicomScale& scale = images[k].scale;
      if (slope ? scale.has_slope : scale.has_intercept) continue;
      ++without;
      first = k;
    }
    if (without > 0 && without < images.count()) {
      return images.place_of(first) + "lacks " + name + ", as " + std::to_string(without) + " of " +
             std::to_string(images.count()) +
             " images do, so that their values are not known in HU; export the series again";
    }
    if (without > 0) lacks += (lacks.empty() ? "" : " and ") + name;
  }
  if (lacks.empty() || looks_hounsfield(series, folder, at)) return {};
  return images.place_of(0) + "a CT whose images lack " + lacks +
         ", and whose stored values are not seen to be HU (no air near -1000); export the series "
         "again with them";
}

}  // namespace

void keep_part(Series& series, std::size_t part, const std::string& wanted,
               const fs::path& folder) {
  const Images images(series);
  const DicomParts parts = parts_of_images(images);
  if (part < 1 || part > parts.images.size()) {
    throw Error(folder.string() + ": \"series\" is \"" + wanted + "\", expected " +
                (parts.images.empty() ? "no part (its images are of one acquisition); leave \".\" "
                                        "and what is behind it out"
                                      : "a part from 1 to " + std::to_string(parts.images.size()) +
                                            " behind the point"));
  }
  const auto keep = [&](auto& all) {
    std::remove_reference_t<decltype(all)> kept;
    for (const std::size_t k : parts.images[part - 1]) kept.push_back(std::move(all[k]));
    all = std::move(kept);
  };
  images.are_frames() ? keep(series.front().frames) : keep(series);
}

Stack stack_series(const Series& series, const fs::path& folder, const At& at) {
  const Slice& first = series.front();
  const Images images(series);
  for (std::size_t k = 0; k < images.count(); ++k) {
    require_hounsfield(images[k].scale.unit, first.modality,
                       images.are_frames() ? first.file : series[k].file);
  }
  const std::string several = find_several(series, images, folder);
  if (images.are_frames() && !several.empty()) {  // which may have no common grid
    return {.order = {}, .grid = first.grid, .problem = several};
  }
  Stack stacked =
      images.are_frames() ? stack_frames(first, folder) : stack(origins_of(series), first.grid);
  const std::string uneven = stacked.problem;
  stacked.problem = find_copies(series, stacked.order);
  if (stacked.problem.empty()) stacked.problem = several;
  if (stacked.problem.empty() && !uneven.empty()) {
    const std::vector<std::size_t>& some = stacked.images;
    stacked.problem = some.size() == 1 ? images.place_of(some.front()) : folder.string() + ": ";
    stacked.problem += uneven + (some.size() > 1 ? "; it is at " + images.shown(some) : "");
  }
  if (stacked.problem.empty()) stacked.problem = find_slab(images, stacked.grid);
  if (stacked.problem.empty()) stacked.problem = find_unscaled(series, images, folder, at);
  return stacked;
}

}  // namespace wireplan::preprocess
