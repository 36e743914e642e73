#include "preprocess/volume/dicom_series.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "preprocess/volume/apart.h"
#include "preprocess/volume/dicom_choice.h"
#include "preprocess/volume/dicom_slice.h"
#include "preprocess/volume/dicom_stack.h"
#include "preprocess/volume/itk_image.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDamagedDicom =
    "a DICOM file that is damaged or cut short; copy or export the series again, or take the file "
    "out if it is no slice";

constexpr const char* kEndsLibrary =
    "ends the library that reads DICOM: the file is damaged, or of a kind that GDCM does not "
    "expect; "
    "export the series again, uncompressed, or take the file out if it is no slice";

/// Values of a CT are Hounsfield units; a scanner may say that these are not, as those of two
/// energies. "US" is unspecified (PS3.3 section C.11.1.1.2).
void require_hounsfield(const std::string& unit, const std::string& modality,
                        const fs::path& file) {
  if (modality != "CT" || unit.empty() || unit == "HU" || unit == "HU_MOD" || unit == "US") return;
  throw Error(file.string() + ": a CT whose values are not in HU but, by its rescale type, " +
              unit + "; expected HU; export the series of ordinary CT numbers");
}

/// The files of a folder by their names, or the one that is given.
std::vector<fs::path> files_of(const fs::path& folder) {
  if (!fs::is_directory(folder)) return {folder};
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Headers of all DICOM images in the folder, by series, in the order of their file names, up to
/// one that throws.
void find_series(const fs::path& folder, const At& at, std::vector<Series>& all) {
  for (const fs::path& file : files_of(folder)) {
    Slice slice;
    slice.file = file;
    slice.look = look_at_dicom(file);
    const DicomForm form = slice.look.form;
    if (form == DicomForm::kNone) continue;  // folders also hold notes and pictures
    if (form == DicomForm::kDamaged) throw Error(file.string() + ": " + kDamagedDicom);
    at(file.string());
    if (read_slice_header(slice)) add_slice(std::move(slice), all);
  }
}

void send_grid(const Send& send, const Grid& grid) {
  send(grid.size.data(), sizeof grid.size);
  send(grid.spacing.data(), sizeof(double) * 3);
  send(grid.origin.data(), sizeof(double) * 3);
  send(grid.direction.data(), sizeof(double) * 9);
}

Grid receive_grid(const Receive& receive) {
  Grid grid;
  receive(grid.size.data(), sizeof grid.size);
  receive(grid.spacing.data(), sizeof(double) * 3);
  receive(grid.origin.data(), sizeof(double) * 3);
  receive(grid.direction.data(), sizeof(double) * 9);
  return grid;
}

/// The rescale type of the images: of several, the one that is no HU; empty where none is told.
std::string unit_of(const Series& series) {
  std::string unit;
  const auto look = [&](const std::string& told) {
    if (unit.empty() || unit == "HU") unit = told.empty() ? unit : told;
  };
  for (const Slice& slice : series) {
    look(slice.unit);
    for (const DicomFrame& frame : slice.frames) look(frame.unit);
  }
  return unit;
}

/// Where the frames of an enhanced file lie.
Stack stack_frames(const Slice& slice, const fs::path& folder) {
  const std::vector<DicomFrame>& frames = slice.frames;
  if (frames.size() != static_cast<std::size_t>(slice.grid.size[2])) {
    throw Error(folder.string() + ": a DICOM file of " + std::to_string(slice.grid.size[2]) +
                " frames that does not tell where each lies, expected an enhanced CT with place, "
                "orientation and spacing of every frame; export the series as one file per slice");
  }
  const DicomFrame& first = frames.front();
  std::vector<Vec3> origins;
  const auto axes_of = [](const DicomFrame& frame) {
    Mat3 axes;
    axes << frame.right, frame.down, frame.right.cross(frame.down);
    return axes;
  };
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
    require_hounsfield(frame.unit, slice.modality, slice.file);
    origins.push_back(frame.position);
  }
  Grid grid = slice.grid;
  grid.spacing = Vec3(first.along_row, first.along_column, 1.0);
  grid.direction = orthonormal_direction(axes_of(first), folder);
  return stack(origins, grid);
}

/// All frames of an enhanced file, in the order of their places, each with its own scale.
Image read_frames(Slice& slice, const fs::path& folder) {
  const std::vector<DicomFrame>& frames = slice.frames;
  const Stack stacked = stack_frames(slice, folder);
  if (!stacked.problem.empty()) throw Error(folder.string() + ": " + stacked.problem);

  // GDCM scales all frames as the first; what is stored are integers.
  require_scalar_volume(*slice.io, stacked.grid, folder);
  std::vector<float> values;
  append_slice(slice, folder, values);
  const double slope = slice.io->GetRescaleSlope(), intercept = slice.io->GetRescaleIntercept();
  const std::size_t size = values.size() / frames.size();
  Image image{.grid = stacked.grid,
              .values = {},
              .modality = slice.modality,
              .unit = unit_of(Series{slice})};
  image.values.reserve(values.size());
  for (const std::size_t k : stacked.order) {
    const DicomFrame& frame = frames[k];
    const bool scaled_so = frame.slope == slope && frame.intercept == intercept;
    for (std::size_t n = k * size; n < (k + 1) * size; ++n) {
      const double stored = std::round((static_cast<double>(values[n]) - intercept) / slope);
      image.values.push_back(
          scaled_so ? values[n] : static_cast<float>(frame.slope * stored + frame.intercept));
    }
  }
  return image;
}

void send_text(const Send& send, const std::string& text) {
  const std::size_t size = text.size();
  send(&size, sizeof size);
  send(text.data(), size);
}

std::string receive_text(const Receive& receive) {
  std::size_t size = 0;
  receive(&size, sizeof size);
  std::string text(size, '\0');
  receive(text.data(), size);
  return text;
}

void send_header(const Send& send, const Grid& grid, const std::string& modality,
                 const std::string& unit) {
  send_grid(send, grid);
  send_text(send, modality);
  send_text(send, unit);
}

/// The series to read, of the folder or of the one file.
Series find_wanted(const fs::path& path, const std::string& wanted, const At& at) {
  std::vector<Series> all;
  find_series(path, at, all);
  if (all.empty() && !fs::is_directory(path)) {
    throw Error(path.string() + ": a DICOM file without an image; " + kFormats);
  }
  Series slices = choose_series(path, wanted, std::move(all));
  if (!fs::is_directory(path) && !is_enhanced(slices)) {
    throw Error(path.string() +
                ": a single DICOM file; give the folder that holds the whole series");
  }
  return slices;
}

/// Sends the grid of the series and what made it, then its values slice by slice.
void send_dicom(const fs::path& path, const std::string& wanted, const Send& send, const At& at) {
  at(path.string());
  Series slices = find_wanted(path, wanted, at);
  Slice& first = slices.front();
  at(first.file.string());
  for (const Slice& slice : slices) require_hounsfield(slice.unit, slice.modality, slice.file);
  if (is_enhanced(slices)) {
    const Image image = read_frames(first, path);
    send_header(send, image.grid, image.modality, image.unit);
    return send(image.values.data(), image.values.size() * sizeof(float));
  }
  const Stack stacked = stack(origins_of(slices), first.grid);
  if (!stacked.problem.empty()) throw Error(path.string() + ": " + stacked.problem);
  require_scalar_volume(*first.io, stacked.grid, path);
  send_header(send, stacked.grid, first.modality, unit_of(slices));
  std::vector<float> values;
  for (const std::size_t k : stacked.order) {
    const Slice& slice = slices[k];
    at(slice.file.string());
    values.clear();
    append_slice(slice, path, values);
    if (values.size() * slices.size() != stacked.grid.voxels()) {
      throw Error(slice.file.string() + ": " + damaged("DICOM"));
    }
    send(values.data(), values.size() * sizeof(float));
  }
}

// ---- What is seen of a folder ------------------------------------------------------------------

SeriesDescription describe_series(const Series& series, const std::vector<Series>& all,
                                  const fs::path& folder) {
  const Slice& first = series.front();
  const Packing packing = packing_of(first);
  SeriesDescription told{.number = first.shown_number,
                         .key = key_of(series),
                         .modality = first.modality,
                         .description = first.description,
                         .unit = unit_of(series),
                         .syntax = packing.name,
                         .syntax_uid = packing.uid,
                         .files = static_cast<int>(series.size()),
                         .grid = first.grid,
                         .problem = {}};
  for (const Slice& slice : series) told.images += slice.grid.size[2];
  try {
    for (const Slice& slice : series) {
      if (!slice.refused.empty()) throw Error(slice.file.string() + ": " + slice.refused);
    }
    told.spaced = true;
    if (const std::string mixture = find_mixture(series, all); !mixture.empty()) {
      throw Error(mixture);
    }
    const bool frames = is_enhanced(series);
    const Stack stacked =
        frames ? stack_frames(first, folder) : stack(origins_of(series), first.grid);
    told.placed = frames || told.files > 1;
    told.grid = stacked.grid;
    told.problem = stacked.problem;
    for (const Slice& slice : series) require_hounsfield(slice.unit, slice.modality, slice.file);
  } catch (const Error& error) {
    told.problem = without_path(error.what(), folder);
  }
  return told;
}

/// Calls `text` and `plain` with the fields of a description, to send or to receive them.
template <typename Told, typename Text, typename Plain>
void for_each_field(Told& told, Text text, Plain plain) {
  for (auto* field : {&told.number, &told.key, &told.modality, &told.description, &told.unit,
                      &told.syntax, &told.syntax_uid, &told.problem}) {
    text(*field);
  }
  plain(told.files);
  plain(told.images);
  plain(told.placed);
  plain(told.spaced);
  plain(told.read);
}

}  // namespace

std::vector<SeriesDescription> describe_dicom(const fs::path& path) {
  std::vector<SeriesDescription> told;
  run_apart(
      [&](const Send& send, const At& at) {
        call_itk(path, damaged("DICOM"), [&] {
          std::vector<Series> all;
          try {
            find_series(path, at, all);
          } catch (const Error&) {
            // read_image tells it; what was found until then is described
          }
          const auto found = find_chosen(all, "");
          const bool whole = fs::is_directory(path) || (found != all.end() && is_enhanced(*found));
          const auto read = whole ? found : all.end();
          const std::size_t count = all.size();
          send(&count, sizeof count);
          for (auto series = all.begin(); series != all.end(); ++series) {
            SeriesDescription one = describe_series(*series, all, path);
            one.read = series == read && one.problem.empty();
            for_each_field(
                one, [&](const std::string& field) { send_text(send, field); },
                [&](const auto& field) { send(&field, sizeof field); });
            send_grid(send, one.grid);
          }
        });
      },
      [&](const Receive& receive) {
        std::size_t count = 0;
        receive(&count, sizeof count);
        while (told.size() < count) {
          SeriesDescription& one = told.emplace_back();
          for_each_field(
              one, [&](std::string& field) { field = receive_text(receive); },
              [&](auto& field) { receive(&field, sizeof field); });
          one.grid = receive_grid(receive);
        }
      },
      kEndsLibrary);
  return told;
}

/// In a process of its own, since distributions build GDCM with assertions, and those end the
/// process on some values that a damaged header holds.
Image read_dicom(const fs::path& path, const std::string& series) {
  Image image;
  run_apart(
      [&](const Send& send, const At& at) {
        call_itk(path, damaged("DICOM"), [&] { send_dicom(path, series, send, at); });
      },
      [&](const Receive& receive) {
        image.grid = receive_grid(receive);
        image.modality = receive_text(receive);
        image.unit = receive_text(receive);
        image.values.reserve(image.grid.voxels());
        const std::size_t slice =
            image.grid.voxels() / static_cast<std::size_t>(image.grid.size[2]);
        while (image.values.size() < image.grid.voxels()) {
          const std::size_t before = image.values.size();
          image.values.resize(before + slice);
          receive(image.values.data() + before, slice * sizeof(float));
        }
      },
      kEndsLibrary);
  return image;
}

}  // namespace wireplan::preprocess
