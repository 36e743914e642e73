#include "preprocess/volume/dicom_series.h"

#include <sys/mman.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gdcmReader.h"
#include "gdcmUIDs.h"
#include "itkGDCMImageIO.h"
#include "preprocess/volume/apart.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/dicom_frames.h"
#include "preprocess/volume/dicom_stack.h"
#include "preprocess/volume/itk_image.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

struct Slice {
  fs::path file;
  DicomForm form = DicomForm::kSound;
  std::size_t end = 0;           // of its pixels, where it is padded or bare
  itk::GDCMImageIO::Pointer io;  // header read
  std::string series_uid;        // to compare with, never shown
  std::string series_number, description, modality;
  std::string unit;  // of its values; empty where the file does not tell
  Grid grid;
};

using Series = std::vector<Slice>;

constexpr std::size_t kModality = 16;  // characters: a code string (PS3.5 section 6.2)

std::string dicom_value(itk::GDCMImageIO& io, const std::string& tag) {
  std::string value;
  io.GetValueFromTag(tag, value);
  return without_padding(std::move(value));
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

constexpr const char* kEndsLibrary =
    "ends the library that reads DICOM: the file is damaged, or of a kind that GDCM does not "
    "expect; "
    "export the series again, uncompressed, or take the file out if it is no slice";

/// A padded or bare file in memory as GDCM reads it: without what lies behind the pixels, with the
/// head that tells the representation.
class CleanCopy {
 public:
  CleanCopy(const fs::path& file, DicomForm form, std::size_t end)
      : file_(::memfd_create("slice", MFD_CLOEXEC)) {
    std::ifstream stream(file, std::ios::binary);
    std::string data(end, '\0');
    stream.read(data.data(), static_cast<std::streamsize>(end));
    std::ofstream(path(), std::ios::binary)
        << (form == DicomForm::kBare ? head_of(data) : "") << data;
  }
  ~CleanCopy() { ::close(file_); }
  CleanCopy(const CleanCopy&) = delete;
  CleanCopy& operator=(const CleanCopy&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  static std::string head_of(const std::string& data) {
    // A data set with value representations has the two letters of one behind its first tag.
    const bool explicit_vr = data.size() > 5 && data[4] >= 'A' && data[4] <= 'Z';
    std::string syntax = explicit_vr ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2";
    if (syntax.size() % 2 == 1) syntax += '\0';
    const auto size = static_cast<char>(syntax.size());
    const std::string element = std::string("\x02\0\x10\0UI", 6) + size + '\0' + syntax;
    return std::string(128, '\0') + "DICM" + std::string("\x02\0\0\0UL\x04\0", 8) +
           static_cast<char>(element.size()) + std::string(3, '\0') + element;
  }

  int file_;
};

/// Nothing where GDCM reads the file as it is.
std::unique_ptr<CleanCopy> copy_of(const Slice& slice) {
  if (slice.form == DicomForm::kSound) return nullptr;
  return std::make_unique<CleanCopy>(slice.file, slice.form, slice.end);
}

/// Refuses an image that GDCM does not open; what has no pixels, as a DICOMDIR or a report, is
/// passed over.
void require_no_pixels(const fs::path& file) {
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.ReadUpToTag(pixels, {}) || !reader.GetFile().GetDataSet().FindDataElement(pixels)) {
    return;
  }
  throw Error(file.string() + ": an image that GDCM does not read (transfer syntax " +
              reader.GetFile().GetHeader().GetDataSetTransferSyntax().GetString() +
              "); export the series again, uncompressed");
}

/// Who the patient is, by names and numbers, and who and when it was done: never to be shown.
std::vector<std::string> patient_of(itk::GDCMImageIO& io) {
  std::vector<std::string> values;
  for (const char* tag :
       {"0010|0010", "0010|0020", "0010|1000", "0010|1001", "0010|1005", "0010|0030", "0008|0020",
        "0008|0021", "0008|0022", "0008|0023", "0008|0050", "0020|0010", "0008|0080", "0008|0090",
        "0008|1050", "0008|1070", "0040|0253", "0040|1001"}) {
    values.push_back(dicom_value(io, tag));
  }
  return values;
}

/// Reads the header of a file; false where it holds no image.
bool read_header(Slice& slice, const fs::path& folder) {
  const auto copy = copy_of(slice);
  const std::string path = copy ? copy->path() : slice.file.string();
  slice.io = itk::GDCMImageIO::New();
  if (!slice.io->CanReadFile(path.c_str())) {
    require_no_pixels(slice.file);
    return false;
  }
  slice.io->SetFileName(path);
  slice.io->ReadImageInformation();
  slice.series_uid = dicom_value(*slice.io, "0020|000e");
  slice.series_number = dicom_value(*slice.io, "0020|0011");
  slice.description = without_identity(dicom_value(*slice.io, "0008|103e"), patient_of(*slice.io));
  slice.modality = dicom_value(*slice.io, "0008|0060");
  slice.unit = dicom_value(*slice.io, "0028|1054");
  slice.grid = header_grid(*slice.io, folder);
  return true;
}

/// The files of a folder by their names, or the one that is given.
std::vector<fs::path> files_of(const fs::path& folder) {
  if (!fs::is_directory(folder)) return {folder};
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
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
    slice.form = check_dicom(file, &slice.end);
    if (slice.form == DicomForm::kNone) continue;  // folders also hold notes and pictures
    if (slice.form == DicomForm::kDamaged) throw Error(file.string() + ": " + kDamagedDicom);
    at(file.string());
    if (!read_header(slice, folder)) continue;
    const auto home = std::find_if(all.begin(), all.end(), [&](const Series& series) {
      return same_series(series.front(), slice);
    });
    if (home == all.end()) {
      all.push_back({slice});
    } else {
      home->push_back(slice);
    }
  }
}

std::vector<Vec3> origins_of(const Series& series) {
  std::vector<Vec3> origins;
  for (const Slice& slice : series) origins.push_back(slice.grid.origin);
  return origins;
}

/// Not a scout of one to three images.
bool has_volume_shape(const Series& series) {
  constexpr std::size_t kLeast = 5;
  if (series.size() == 1) return series.front().grid.size[2] >= static_cast<int>(kLeast);
  return series.size() >= kLeast && stack(origins_of(series), series.front().grid).problem.empty();
}

Error several_series(const fs::path& folder, const std::string& wanted, std::vector<Series> all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Series& a, const Series& b) { return a.size() > b.size(); });
  std::ostringstream text;
  text << folder.string() << ": " << all.size() << " DICOM series, ";
  if (wanted.empty()) {
    text << "expected one:";
  } else {
    text << "expected one of the number or description \"" << wanted << "\":";
  }
  for (const Series& series : all) {
    const Slice& first = series.front();
    text << " number " << (first.series_number.empty() ? "unknown" : first.series_number);
    if (!first.description.empty()) text << " (" << first.description << ")";
    text << " has " << series.size() << (series.size() == 1 ? " image of " : " images of ")
         << first.grid.size[0] << " x " << first.grid.size[1] << " pixels";
    if (series.size() > 1) {
      const Stack stacked = stack(origins_of(series), first.grid);
      text << ", " << stacked.grid.spacing[2] << " mm apart";
    }
    text << ";";
  }
  text << " name the one to plan on by \"series\" in the case's volume, or put it into a folder of "
          "its own";
  return Error(text.str());
}

/// The series to read, of those that are wanted: the only one, or the one that alone has a volume's
/// shape; the end where there is none.
std::vector<Series>::iterator find_chosen(std::vector<Series>& all, const std::string& wanted) {
  const auto only = [&](const auto& fits) {
    const auto found = std::find_if(all.begin(), all.end(), fits);
    return std::count_if(all.begin(), all.end(), fits) == 1 ? found : all.end();
  };
  const auto is_wanted = [&](const Series& series) {
    const Slice& first = series.front();
    return wanted.empty() || first.series_number == wanted || first.description == wanted;
  };
  const auto found = only(is_wanted);
  if (found != all.end()) return found;
  return only([&](const Series& series) { return is_wanted(series) && has_volume_shape(series); });
}

Series choose_series(const fs::path& folder, const std::string& wanted, std::vector<Series> all) {
  if (all.empty()) {
    throw Error(folder.string() +
                ": a folder without DICOM images (folders inside it are not searched); " +
                kFormats);
  }
  const auto found = find_chosen(all, wanted);
  if (found == all.end()) throw several_series(folder, wanted, std::move(all));
  return std::move(*found);
}

/// Values of a CT are Hounsfield units; a scanner may say that these are not, as those of two
/// energies. "US" is unspecified (PS3.3 section C.11.1.1.2).
void require_hounsfield(const std::string& unit, const std::string& modality,
                        const fs::path& folder) {
  if (modality != "CT" || unit.empty() || unit == "HU" || unit == "HU_MOD" || unit == "US") return;
  throw Error(folder.string() + ": a CT whose values are not in HU but, by its rescale type, " +
              unit + "; expected HU; export the series of ordinary CT numbers");
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
void require_whole_dicom(itk::GDCMImageIO& io, const fs::path& file) {
  const fs::path path = io.GetFileName();
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  const bool found = reader.ReadUpToTag(pixels, {pixels});
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  const std::uintmax_t size = fs::file_size(path);
  const double values = count_values(io);
  if (syntax == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian) {
    // positions are those of the inflated file, and zlib notices
    return require_room(values, static_cast<double>(size), kMostDeflated, "DICOM", file);
  }

  // what lies between where the pixels start and the end of the file
  constexpr double kMostPacked = 3e4;  // by JPEG 2000 and JPEG-LS where all is one value; chosen
  const std::uintmax_t at = reader.GetStreamCurrentPosition();
  bool whole = found && at >= 4 && at <= size;
  const double stored = whole ? static_cast<double>(size - at) : 0.0;
  if (whole && syntax.IsEncapsulated()) {
    std::ifstream stream(path, std::ios::binary);
    whole = fragments_are_whole(stream, at, size) && values <= kMostPacked * stored;
  } else if (whole) {
    const double bits = std::strtod(dicom_value(io, "0028|0100").c_str(), nullptr);
    whole = stored >= (bits > 0.0 ? bits : 8.0) / 8.0 * values;
  }
  if (!whole) {
    throw Error(file.string() + ": " + damaged("DICOM"));
  }
}

/// How the pixels of a file are packed.
struct Packing {
  std::string name, uid;
  bool packed = false;
};
Packing packing_of(const fs::path& file) {
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.ReadUpToTag(pixels, {pixels})) return {};
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  gdcm::UIDs names;
  const bool known = names.SetFromUID(syntax.GetString());
  return {known ? names.GetName() : "an unknown syntax", syntax.GetString(),
          syntax.IsEncapsulated()};
}

/// Reads the pixels of a slice, or of all its frames, and appends their values.
void append_slice(const Slice& slice, const fs::path& folder, std::vector<float>& values) {
  const auto copy = copy_of(slice);
  if (copy) slice.io->SetFileName(copy->path());
  require_whole_dicom(*slice.io, slice.file);
  const LastWords decoder;
  try {
    append_voxels(*slice.io, folder, values);
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    const Packing packing = packing_of(slice.io->GetFileName());
    if (!packing.packed) throw;
    throw Error(slice.file.string() + ": its pixels are packed as " + packing.name + " (" +
                packing.uid + ") and are all there, but GDCM does not unpack them" +
                decoder.text() + "; export the series again, uncompressed");
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

/// Where the frames of an enhanced file lie.
Stack stack_frames(const Slice& slice, const std::vector<DicomFrame>& frames,
                   const fs::path& folder) {
  const auto is_placed = [](const DicomFrame& frame) { return frame.placed; };
  if (frames.size() != static_cast<std::size_t>(slice.grid.size[2]) ||
      !std::all_of(frames.begin(), frames.end(), is_placed)) {
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
    require_hounsfield(frame.unit, slice.modality, folder);
    origins.push_back(frame.position);
  }
  Grid grid = slice.grid;
  grid.spacing = Vec3(first.along_row, first.along_column, 1.0);
  grid.direction = orthonormal_direction(axes_of(first), folder);
  return stack(origins, grid);
}

/// All frames of an enhanced file, in the order of their places, each with its own scale.
Image read_frames(Slice& slice, const fs::path& folder) {
  const std::vector<DicomFrame> frames = read_dicom_frames(slice.file);
  const Stack stacked = stack_frames(slice, frames, folder);
  if (!stacked.problem.empty()) throw Error(folder.string() + ": " + stacked.problem);

  // GDCM scales all frames as the first; what is stored are integers.
  require_scalar_volume(*slice.io, stacked.grid, folder);
  std::vector<float> values;
  append_slice(slice, folder, values);
  const double slope = slice.io->GetRescaleSlope(), intercept = slice.io->GetRescaleIntercept();
  const std::size_t size = values.size() / frames.size();
  Image image{.grid = stacked.grid, .values = {}, .modality = slice.modality};
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

void send_header(const Send& send, const Grid& grid, std::string modality) {
  send_grid(send, grid);
  modality.resize(kModality);
  send(modality.data(), modality.size());
}

/// Sends the grid of the folder's series and what made it, then its values slice by slice.
void send_dicom_folder(const fs::path& folder, const std::string& wanted, const Send& send,
                       const At& at) {
  at(folder.string());
  std::vector<Series> all;
  find_series(folder, at, all);
  Series slices = choose_series(folder, wanted, std::move(all));
  Slice& first = slices.front();
  at(first.file.string());
  require_hounsfield(first.unit, first.modality, folder);
  if (slices.size() == 1 && first.grid.size[2] > 1) {  // all frames in one file
    const Image image = read_frames(first, folder);
    send_header(send, image.grid, image.modality);
    return send(image.values.data(), image.values.size() * sizeof(float));
  }
  const Stack stacked = stack(origins_of(slices), first.grid);
  if (!stacked.problem.empty()) throw Error(folder.string() + ": " + stacked.problem);
  require_scalar_volume(*first.io, stacked.grid, folder);
  send_header(send, stacked.grid, first.modality);
  std::vector<float> values;
  for (const std::size_t k : stacked.order) {
    const Slice& slice = slices[k];
    at(slice.file.string());
    values.clear();
    append_slice(slice, folder, values);
    if (values.size() * slices.size() != stacked.grid.voxels()) {
      throw Error(folder.string() + ": files of several frames each, expected one slice per file");
    }
    send(values.data(), values.size() * sizeof(float));
  }
}

// ---- What is seen of a folder ------------------------------------------------------------------

SeriesDescription describe_series(const Series& series, const fs::path& folder) {
  const Slice& first = series.front();
  const auto copy = copy_of(first);
  const Packing packing = packing_of(copy ? copy->path() : first.file.string());
  SeriesDescription told{.number = first.series_number,
                         .modality = first.modality,
                         .description = first.description,
                         .unit = first.unit,
                         .syntax = packing.name,
                         .syntax_uid = packing.uid,
                         .files = static_cast<int>(series.size()),
                         .grid = first.grid,
                         .problem = {}};
  for (const Slice& slice : series) told.images += slice.grid.size[2];
  try {
    const bool frames = told.files == 1 && told.images > 1;
    const Stack stacked = frames ? stack_frames(first, read_dicom_frames(first.file), folder)
                                 : stack(origins_of(series), first.grid);
    told.placed = frames || told.files > 1;
    told.grid = stacked.grid;
    told.problem = stacked.problem;
    require_hounsfield(first.unit, first.modality, folder);
  } catch (const Error& error) {
    told.problem = without_path(error.what(), folder);
  }
  return told;
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

/// Calls `text` and `plain` with the fields of a description, to send or to receive them.
template <typename Told, typename Text, typename Plain>
void for_each_field(Told& told, Text text, Plain plain) {
  for (auto* field : {&told.number, &told.modality, &told.description, &told.unit, &told.syntax,
                      &told.syntax_uid, &told.problem}) {
    text(*field);
  }
  plain(told.files);
  plain(told.images);
  plain(told.placed);
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
          const auto read = fs::is_directory(path) ? find_chosen(all, "") : all.end();
          const std::size_t count = all.size();
          send(&count, sizeof count);
          for (auto series = all.begin(); series != all.end(); ++series) {
            SeriesDescription one = describe_series(*series, path);
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
Image read_dicom_folder(const fs::path& folder, const std::string& series) {
  Image image;
  run_apart(
      [&](const Send& send, const At& at) {
        call_itk(folder, damaged("DICOM"), [&] { send_dicom_folder(folder, series, send, at); });
      },
      [&](const Receive& receive) {
        image.grid = receive_grid(receive);
        std::array<char, kModality + 1> modality{};
        receive(modality.data(), kModality);
        image.modality = modality.data();
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
