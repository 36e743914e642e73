#include "preprocess/volume/dicom_series.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "preprocess/volume/apart.h"
#include "preprocess/volume/dicom_choice.h"
#include "preprocess/volume/dicom_slice.h"
#include "preprocess/volume/dicom_volume.h"
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
    look(slice.image.scale.unit);
    for (const DicomFrame& frame : slice.frames) look(frame.scale.unit);
  }
  return unit;
}

/// The frames of an enhanced file that are in the stack, in the order of their places.
std::vector<float> read_frames(const Slice& slice, const Stack& stacked, const fs::path& folder) {
  std::vector<float> values, sorted;
  append_slice(slice, folder, values);
  const std::size_t size = values.size() / static_cast<std::size_t>(slice.grid.size[2]);
  sorted.reserve(size * stacked.order.size());
  for (const std::size_t k : stacked.order) {
    const auto frame = values.begin() + static_cast<std::ptrdiff_t>(slice.frames[k].number * size);
    sorted.insert(sorted.end(), frame, frame + static_cast<std::ptrdiff_t>(size));
  }
  return sorted;
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
    throw Error(path.string() + ": " + kind_of(look_at_dicom(path)).name + " without an image; " +
                kFormats);
  }
  // "#1f3a90c2.2" is the second part of a series.
  const std::size_t point = wanted.starts_with("#") ? wanted.find('.') : std::string::npos;
  Series slices = choose_series(path, wanted.substr(0, point), std::move(all));
  if (point != std::string::npos) {
    const int part = std::atoi(wanted.c_str() + point + 1);
    keep_part(slices, static_cast<std::size_t>(std::max(0, part)), wanted, path);
  }
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
  const Stack stacked = stack_series(slices, path, at);
  if (!stacked.problem.empty()) throw Error(stacked.problem);
  require_scalar_volume(*first.io, stacked.grid, path);
  send_header(send, stacked.grid, first.modality, unit_of(slices));
  if (is_enhanced(slices)) {
    const std::vector<float> values = read_frames(first, stacked, path);
    return send(values.data(), values.size() * sizeof(float));
  }
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
                                  const fs::path& folder, const At& at) {
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
    const Stack stacked = stack_series(series, folder, at);
    told.placed = is_enhanced(series) || told.files > 1;
    told.grid = stacked.grid;
    told.problem = without_path(stacked.problem, folder);
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
            SeriesDescription one = describe_series(*series, all, path, at);
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
