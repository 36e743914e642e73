#include "preprocess/volume/dicom_series.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gdcmReader.h"
#include "itkGDCMImageIO.h"
#include "preprocess/volume/apart.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/itk_image.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

struct Slice {
  itk::GDCMImageIO::Pointer io;  // header read
  std::string series_uid;        // to compare with, never shown
  std::string series_number;
  Grid grid;
};

using Series = std::vector<Slice>;

std::string dicom_value(itk::GDCMImageIO& io, const std::string& tag) {
  std::string value;
  io.GetValueFromTag(tag, value);
  while (!value.empty() && (value.back() == ' ' || value.back() == '\0')) {
    value.pop_back();
  }
  return value;
}

/// True where two images can be slices of one volume.
bool same_series(const Slice& a, const Slice& b) {
  return a.series_uid == b.series_uid && a.grid.size == b.grid.size &&
         a.grid.spacing.head<2>().isApprox(b.grid.spacing.head<2>(), 1e-3) &&
         (a.grid.direction - b.grid.direction).cwiseAbs().maxCoeff() < 1e-3;
}

constexpr const char* kDamagedDicom =
    "a DICOM file that is damaged or cut short; copy or export the series again, or take the file "
    "out if it is no slice";

/// Headers of all DICOM images in the folder, by series, in the order of their file names.
std::vector<Series> find_series(const fs::path& folder, const At& at) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());

  std::vector<Series> all;
  for (const fs::path& file : files) {
    const DicomForm form = check_dicom(file);
    if (form == DicomForm::kNone) continue;  // folders also hold notes and pictures
    if (form == DicomForm::kDamaged) {
      throw Error(file.string() + ": " + kDamagedDicom);
    }
    at(file.string());
    Slice slice{.io = itk::GDCMImageIO::New(), .series_uid = {}, .series_number = {}, .grid = {}};
    if (!slice.io->CanReadFile(file.c_str())) {
      continue;  // such as DICOMDIR and reports
    }
    slice.io->SetFileName(file.string());
    slice.io->ReadImageInformation();
    slice.series_uid = dicom_value(*slice.io, "0020|000e");
    slice.series_number = dicom_value(*slice.io, "0020|0011");
    slice.grid = header_grid(*slice.io, folder);
    const auto home = std::find_if(all.begin(), all.end(), [&](const Series& series) {
      return same_series(series.front(), slice);
    });
    if (home == all.end()) {
      all.push_back({slice});
    } else {
      home->push_back(slice);
    }
  }
  return all;
}

Error several_series(const fs::path& folder, std::vector<Series> all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Series& a, const Series& b) { return a.size() > b.size(); });
  std::ostringstream text;
  text << folder.string() << ": " << all.size() << " DICOM series, expected one:";
  for (const Series& series : all) {
    const Slice& first = series.front();
    text << " number " << (first.series_number.empty() ? "unknown" : first.series_number) << " has "
         << series.size() << (series.size() == 1 ? " image of " : " images of ")
         << first.grid.size[0] << " x " << first.grid.size[1] << " pixels;";
  }
  text << " put the one to plan on into a folder of its own";
  return Error(text.str());
}

/// Checks that the sorted positions [mm] along the normal form a regular stack. Scanners round
/// positions, so a slice may lie a tenth of the step away from its place.
void require_even(const std::vector<double>& positions, const fs::path& folder) {
  const std::size_t gaps = positions.size() - 1;
  const double step = (positions.back() - positions.front()) / static_cast<double>(gaps);
  bool even = step > 0.0;
  for (std::size_t k = 0; k <= gaps; ++k) {
    const double place = positions.front() + static_cast<double>(k) * step;
    even = even && std::abs(positions[k] - place) <= 0.1 * step;
  }
  if (even) {
    return;
  }

  // name the gap that differs most from the usual one
  std::vector<double> sizes(gaps);
  for (std::size_t k = 0; k < gaps; ++k) {
    sizes[k] = positions[k + 1] - positions[k];
  }
  std::vector<double> sorted = sizes;
  std::nth_element(sorted.begin(), sorted.begin() + gaps / 2, sorted.end());
  const double usual = sorted[gaps / 2];
  const auto odd = std::max_element(sizes.begin(), sizes.end(), [&](double a, double b) {
    return std::abs(a - usual) < std::abs(b - usual);
  });
  const std::size_t k = static_cast<std::size_t>(odd - sizes.begin());
  std::ostringstream text;
  text << folder.string() << ": uneven slices: the ones at " << positions[k] << " and "
       << positions[k + 1] << " mm along the normal are " << *odd << " mm apart, the others "
       << usual << " mm; ";
  if (*odd < 0.5 * usual || usual <= 0.0) {
    text << "images lie at the same place: keep one phase or reconstruction in the folder";
  } else {
    text << "export the series again, with all its slices, or resample it";
  }
  throw Error(text.str());
}

/// Sorts the slices along their normal and gives the grid that they form.
Grid stack(Series& slices, const fs::path& folder) {
  if (slices.size() < 2) {
    throw Error(folder.string() + ": one DICOM slice, expected a series of at least 2");
  }
  const Vec3 normal = slices.front().grid.direction.col(2);
  const auto position = [&](const Slice& slice) { return normal.dot(slice.grid.origin); };
  std::stable_sort(slices.begin(), slices.end(),
                   [&](const Slice& a, const Slice& b) { return position(a) < position(b); });
  std::vector<double> positions(slices.size());
  std::transform(slices.begin(), slices.end(), positions.begin(), position);
  require_even(positions, folder);

  Grid grid = slices.front().grid;
  const Vec3 rise = slices.back().grid.origin - grid.origin;
  const double drift = (rise - normal * normal.dot(rise)).norm();
  if (drift > 0.5 * grid.spacing.head<2>().minCoeff()) {
    std::ostringstream text;
    text << folder.string() << ": the slices are shifted by " << drift
         << " mm in their plane from first to last (tilted gantry); resample the series to an "
            "upright grid";
    throw Error(text.str());
  }
  grid.size[2] = static_cast<int>(slices.size());
  grid.spacing[2] = normal.dot(rise) / static_cast<double>(slices.size() - 1);
  return grid;
}

/// True where the fragments of compressed pixels that start at `at` are all there (DICOM part 5,
/// A.4: items of tag FFFE,E000 and a length, closed by the tag FFFE,E0DD).
bool fragments_are_whole(std::ifstream& file, std::uintmax_t at, std::uintmax_t size) {
  while (at + 8 <= size) {
    std::array<unsigned char, 8> item{};  // little endian
    file.seekg(static_cast<std::streamoff>(at));
    file.read(reinterpret_cast<char*>(item.data()), item.size());
    if (item[2] == 0xDD) {
      return true;
    }
    at += 8 + item[4] + 256ULL * (item[5] + 256ULL * (item[6] + 256ULL * item[7]));
  }
  return false;
}

/// GDCM fills up pixels that are cut short with zeros, so their size is compared with the file's.
void require_whole_dicom(itk::GDCMImageIO& io) {
  const fs::path path = io.GetFileName();
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  const bool found = reader.ReadUpToTag(pixels, {pixels});
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  if (syntax == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian) {
    return;  // positions are those of the inflated file, and zlib notices
  }

  // what lies between where the pixels start and the end of the file
  const std::uintmax_t at = reader.GetStreamCurrentPosition(), size = fs::file_size(path);
  bool whole = found && at >= 4 && at <= size;
  if (whole && syntax.IsEncapsulated()) {
    std::ifstream file(path, std::ios::binary);
    whole = fragments_are_whole(file, at, size);
  } else if (whole) {
    const double bits = std::strtod(dicom_value(io, "0028|0100").c_str(), nullptr);
    whole = static_cast<double>(size - at) >=
            bits / 8.0 * static_cast<double>(io.GetImageSizeInPixels());
  }
  if (!whole) {
    throw Error(path.string() + ": " + damaged("DICOM"));
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

/// Sends the grid of the folder's series, then its values slice by slice.
void send_dicom_folder(const fs::path& folder, const Send& send, const At& at) {
  at(folder.string());
  std::vector<Series> all = find_series(folder, at);
  if (all.empty()) {
    throw Error(folder.string() +
                ": a folder without DICOM images (folders inside it are not searched); " +
                kFormats);
  }
  if (all.size() > 1) {
    throw several_series(folder, std::move(all));
  }
  Series& slices = all.front();
  at(slices.front().io->GetFileName());
  if (slices.size() == 1 && slices.front().grid.size[2] > 1) {  // all frames in one file
    require_whole_dicom(*slices.front().io);
    const Image image = read_volume(*slices.front().io, folder);
    send_grid(send, image.grid);
    return send(image.values.data(), image.values.size() * sizeof(float));
  }
  const Grid grid = stack(slices, folder);
  require_scalar_volume(*slices.front().io, grid, folder);
  send_grid(send, grid);
  std::vector<float> values;
  for (const Slice& slice : slices) {
    at(slice.io->GetFileName());
    require_whole_dicom(*slice.io);
    values.clear();
    append_voxels(*slice.io, folder, values);
    if (values.size() * slices.size() != grid.voxels()) {
      throw Error(folder.string() + ": files of several frames each, expected one slice per file");
    }
    send(values.data(), values.size() * sizeof(float));
  }
}

}  // namespace

/// In a process of its own, since distributions build GDCM with assertions, and those end the
/// process on some values that a damaged header holds.
Image read_dicom_folder(const fs::path& folder) {
  Image image;
  run_apart(
      [&](const Send& send, const At& at) {
        call_itk(folder, damaged("DICOM"), [&] { send_dicom_folder(folder, send, at); });
      },
      [&](const Receive& receive) {
        image.grid = receive_grid(receive);
        image.values.reserve(image.grid.voxels());
        const std::size_t slice =
            image.grid.voxels() / static_cast<std::size_t>(image.grid.size[2]);
        while (image.values.size() < image.grid.voxels()) {
          const std::size_t before = image.values.size();
          image.values.resize(before + slice);
          receive(image.values.data() + before, slice * sizeof(float));
        }
      },
      kDamagedDicom);
  return image;
}

}  // namespace wireplan::preprocess
