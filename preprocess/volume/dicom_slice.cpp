#include "preprocess/volume/dicom_slice.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string_view>

#include "gdcmAttribute.h"
#include "gdcmReader.h"
#include "gdcmTransferSyntax.h"
#include "gdcmUIDs.h"
#include "preprocess/volume/apart.h"
#include "preprocess/volume/identity.h"
#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExplicit = "1.2.840.10008.1.2.1";
constexpr const char* kImplicit = "1.2.840.10008.1.2";
constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";

/// Whether GDCM knows the transfer syntax.
bool is_known(const DicomLook& look) {
  return look.syntax.empty() ||
         gdcm::TransferSyntax::GetTSType(look.syntax.c_str()) != gdcm::TransferSyntax::TS_END;
}

/// A file in memory as GDCM reads it: without what lies behind the pixels, with its patches and
/// with the head that tells the representation.
class CleanCopy {
 public:
  /// Under that transfer syntax, or under its own where that is empty.
  CleanCopy(const fs::path& file, const DicomLook& look, const std::string& syntax)
      : file_(::memfd_create("slice", MFD_CLOEXEC)) {
    std::ifstream stream(file, std::ios::binary);
    std::string data(look.end, '\0');
    stream.read(data.data(), static_cast<std::streamsize>(look.end));
    for (const DicomPatch& patch : look.patches) {
      if (patch.at + patch.bytes.size() > data.size()) continue;
      data.replace(patch.at, patch.bytes.size(), patch.bytes);
    }
    const std::string told = syntax.empty() ? look.syntax : syntax;
    const std::string known = !told.empty() ? told : look.explicit_vr ? kExplicit : kImplicit;
    const bool own_head = look.form != DicomForm::kBare && syntax.empty();
    std::ofstream(path(), std::ios::binary)
        << (own_head ? data : head_of(known) + data.substr(look.begin));
  }
  ~CleanCopy() { ::close(file_); }
  CleanCopy(const CleanCopy&) = delete;
  CleanCopy& operator=(const CleanCopy&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  static std::string head_of(std::string syntax) {
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
  const DicomLook& look = slice.look;
  if (!is_known(look)) return std::make_unique<CleanCopy>(slice.file, look, kExplicit);
  if (look.form == DicomForm::kSound && look.patches.empty()) return nullptr;
  return std::make_unique<CleanCopy>(slice.file, look, "");
}

std::string path_of(const Slice& slice, const std::unique_ptr<CleanCopy>& copy) {
  return copy ? copy->path() : slice.file.string();
}

/// Who the patient is, by names and numbers, and who and when it was done: never to be shown.
std::vector<std::string> patient_of(const gdcm::DataSet& data) {
  std::vector<std::string> values;
  for (const gdcm::Tag& tag :
       {gdcm::Tag(0x10, 0x10), gdcm::Tag(0x10, 0x20), gdcm::Tag(0x10, 0x1000),
        gdcm::Tag(0x10, 0x1001), gdcm::Tag(0x10, 0x1005), gdcm::Tag(0x10, 0x30),
        gdcm::Tag(0x08, 0x20), gdcm::Tag(0x08, 0x21), gdcm::Tag(0x08, 0x22), gdcm::Tag(0x08, 0x23),
        gdcm::Tag(0x08, 0x50), gdcm::Tag(0x20, 0x10), gdcm::Tag(0x08, 0x80), gdcm::Tag(0x08, 0x90),
        gdcm::Tag(0x08, 0x1050), gdcm::Tag(0x08, 0x1070), gdcm::Tag(0x40, 0x253),
        gdcm::Tag(0x40, 0x1001)}) {
    values.push_back(dicom_text(data, tag));
  }
  return values;
}

/// A count of rows, columns or values of a pixel.
template <std::uint16_t kElement>
int read_count(const gdcm::DataSet& data) {
  gdcm::Attribute<0x0028, kElement> attribute;
  if (!data.FindDataElement(attribute.GetTag()) ||
      data.GetDataElement(attribute.GetTag()).IsEmpty()) {
    return 1;
  }
  attribute.SetFromDataElement(data.GetDataElement(attribute.GetTag()));
  return static_cast<int>(attribute.GetValue());
}

/// Where an image lies, as its own elements tell.
Grid told_grid(const DicomFrame& image) {
  Grid grid;
  grid.origin = image.position;
  grid.direction << image.right, image.down, image.right.cross(image.down);
  grid.spacing = Vec3(image.along_row, image.along_column, 1.0);
  return grid;
}

/// The UID, or nothing where it is none: a damaged header may hold anything.
std::string shown_uid(const std::string& uid) {
  constexpr std::size_t kLongest = 64;  // characters (PS3.5 section 9.1)
  const bool sound =
      uid.size() <= kLongest && uid.find_first_not_of("0123456789.") == std::string::npos;
  return sound ? uid : std::string();
}

std::string not_read(const std::string& syntax) {
  const std::string uid = shown_uid(syntax);
  return "an image that GDCM does not read (transfer syntax " + (uid.empty() ? "not told" : uid) +
         "); export the series again, uncompressed";
}

/// The word by which an image type says that images are projections through a slab or pictures of
/// a volume; empty where it does not.
std::string projection_of(std::string type) {
  constexpr std::array<std::string_view, 12> kWords = {
      "MAXIP",     "MINIP",  "MINMIP",       "MPVR",          "PROJECTION", "PROJECTED",
      "RENDERING", "RENDER", "VOLUMERENDER", "SURFACERENDER", "VRT",        "CURVEDMPR"};
  std::transform(type.begin(), type.end(), type.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  for (const bool joined : {false, true}) {  // "MIP_THIN" and "MAX_IP"
    std::string words = type;
    if (joined) words.erase(std::remove(words.begin(), words.end(), '_'), words.end());
    std::replace_if(
        words.begin(), words.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, ' ');
    std::istringstream parts(words);
    for (std::string part; parts >> part;) {
      const bool known = std::find(kWords.begin(), kWords.end(), part) != kWords.end();
      if (known || part.starts_with("MIP")) return part.starts_with("MIP") ? "MIP" : part;
    }
  }
  return {};
}

/// Of what kind an image is that is no slice, nor frames, of a scan; empty where it is of one.
std::string other_kind(const Slice& slice, const gdcm::DataSet& data) {
  if (is_segmentation(dicom_text(data, {0x08, 0x16})) || slice.modality == "SEG") {
    return kSegmentation + std::string(" is not read; export it as NIfTI or NRRD");
  }
  const int samples = read_count<0x02>(data);
  const bool palette = dicom_text(data, {0x28, 0x04}).starts_with("PALETTE");
  if (samples > 1 || palette) {
    return "a colour image (" +
           (palette ? std::string("Photometric Interpretation (0028,0004) is PALETTE COLOR")
                    : "Samples per Pixel (0028,0002) is " + std::to_string(samples)) +
           "), as pictures of a screen are, expected one grey value per pixel; give the series of "
           "slices";
  }
  std::string projection = projection_of(slice.image.type);
  for (const DicomFrame& frame : slice.frames) {
    if (projection.empty()) projection = projection_of(frame.type);
  }
  if (projection.empty()) return {};
  return "a projection or a picture of a volume (its image type says " + projection +
         "), expected slices; give the series that it was made of";
}

/// Frames of CT and MR (PS3.4 section B.5), also of such files put together later.
bool is_scan(const std::string& sop_class, const std::string& modality) {
  constexpr std::array<std::string_view, 6> kScans = {"2", "2.1", "2.2", "4", "4.1", "4.4"};
  const std::string images = "1.2.840.10008.5.1.4.1.1.";
  if (!sop_class.starts_with(images)) return modality == "CT" || modality == "MR";
  return std::find(kScans.begin(), kScans.end(), sop_class.substr(images.size())) != kScans.end();
}

bool is_ct(const std::string& sop_class) {
  constexpr std::array<std::string_view, 3> kClasses = {
      "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.2.1", "1.2.840.10008.5.1.4.1.1.2.2"};
  return std::find(kClasses.begin(), kClasses.end(), sop_class) != kClasses.end();
}

/// Why a file whose decimals are not what is expected is not read; empty where they are.
std::string find_wrong_value(const Slice& slice, const std::vector<std::string>& patient) {
  const auto tell = [&](const WrongValue& wrong, const std::string& where) {
    constexpr std::size_t kMost = 64;
    std::string value = without_identity(wrong.value.substr(0, kMost), patient);
    std::replace_if(
        value.begin(), value.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return "its " + wrong.name + where + " is " +
           (value.empty() ? "not shown" : "\"" + value + "\"") + ", expected " + wrong.expected +
           "; export the series again";
  };
  if (!slice.image.wrong.name.empty()) return tell(slice.image.wrong, "");
  for (std::size_t k = 0; k < slice.frames.size(); ++k) {
    const WrongValue& wrong = slice.frames[k].wrong;
    if (!wrong.name.empty()) return tell(wrong, " of frame " + std::to_string(k + 1));
  }
  return {};
}

/// Why a file tells more or fewer places than it has frames; empty where it does not.
std::string find_miscount(const Slice& slice, int images) {
  const std::size_t places = slice.frames.size();
  if (places == 0 || places == static_cast<std::size_t>(images)) return {};
  return "its Number of Frames (0028,0008) is " + std::to_string(images) +
         ", but it tells the places of " + std::to_string(places) +
         " (Per-frame Functional Groups Sequence (5200,9230)), expected one for each; export the "
         "series again";
}

/// Why a file whose header is read cannot lie in a volume; empty where it can.
std::string find_refusal(const Slice& slice, bool inverse) {
  if (!is_known(slice.look)) return not_read(slice.look.syntax);
  if (inverse && slice.look.syntax == kDeflated) {
    return "its photometric interpretation is MONOCHROME1, and it is deflated: the library would "
           "turn its values upside down; export the series again, uncompressed";
  }
  for (std::size_t k = 0; k < slice.frames.size(); ++k) {
    if (slice.frames[k].lacks.empty()) continue;
    return "a DICOM file of " + std::to_string(slice.frames.size()) +
           " frames that does not tell where each lies (frame " + std::to_string(k + 1) +
           " lacks " + slice.frames[k].lacks +
           "), expected an enhanced CT with place, orientation and spacing of every frame; export "
           "the series as one file per slice";
  }
  if (slice.image.lacks.empty()) return slice.io ? "" : not_read(slice.look.syntax);
  return "a slice that lacks " + slice.image.lacks +
         ", without which its place and size in mm are not known; export the series again with "
         "it, or take the file out if it is no slice";
}

/// Fills in what the elements tell, with why images of its kind are not read.
void read_elements(Slice& slice, const gdcm::DataSet& data) {
  slice.series_uid = dicom_text(data, {0x20, 0x0e});
  slice.instance_uid = dicom_text(data, {0x08, 0x18});
  slice.series_number = dicom_text(data, {0x20, 0x11});
  const std::vector<std::string> patient = patient_of(data);
  slice.shown_number = without_date(without_identity(slice.series_number, patient));
  slice.description = without_identity(dicom_text(data, {0x08, 0x103e}), patient);
  const std::string sop_class = dicom_text(data, {0x08, 0x16});
  slice.modality = dicom_text(data, {0x08, 0x60});
  if (slice.modality.empty() && is_ct(sop_class)) slice.modality = "CT";
  slice.image = read_dicom_file(data);
  slice.localizer = slice.image.type.find("LOCALIZER") != std::string::npos;
  slice.frames = read_dicom_frames(data, slice.image);
  if (slice.frames.size() == 1) slice.image = slice.frames.front();

  // Its frames tell where they lie, or are asked for it.
  const double count = std::strtod(dicom_text(data, {0x28, 0x08}).c_str(), nullptr);
  const int images = count >= 1.0 && count < 1e6 ? static_cast<int>(count) : 1;
  if (images > 1 || !slice.frames.empty()) slice.image.lacks.clear();
  slice.grid = told_grid(slice.image);
  slice.grid.size = {read_count<0x11>(data), read_count<0x10>(data), images};
  slice.refused = other_kind(slice, data);
  slice.aside = !slice.refused.empty() || (images > 1 && !is_scan(sop_class, slice.modality));
  if (slice.refused.empty()) slice.refused = find_wrong_value(slice, patient);
  if (slice.refused.empty()) slice.refused = find_miscount(slice, images);
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

/// How many a pixel takes.
double bits_of(itk::GDCMImageIO& io) {
  std::string bits;
  io.GetValueFromTag("0028|0100", bits);
  return std::strtod(bits.c_str(), nullptr);
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
    const double bits = bits_of(io);
    whole = stored >= (bits > 0.0 ? bits : 8.0) / 8.0 * values;
  }
  if (!whole) {
    throw Error(file.string() + ": " + damaged("DICOM"));
  }
}

/// Reads the header by ITK; no `io` where it does not take it.
void ask_itk(Slice& slice, const std::string& path) {
  const itk::GDCMImageIO::Pointer io = itk::GDCMImageIO::New();
  try {
    if (!io->CanReadFile(path.c_str())) return;
    io->SetFileName(path);
    io->ReadImageInformation();
    // The step from image to image is that of their places: ITK's is negative where frames run
    // down.
    io->SetSpacing(2, 1.0);
    slice.grid = header_grid(*io, slice.file);
    slice.io = io;
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    // Its elements are whole: of a kind that the library does not expect.
  }
}

/// Gives each frame its own scale: GDCM scales all as the first, and by its groups alone. What is
/// stored are integers.
void scale_frames(const Slice& slice, std::size_t first, std::vector<float>& values) {
  const double slope = slice.io->GetRescaleSlope(), intercept = slice.io->GetRescaleIntercept();
  const std::size_t size = (values.size() - first) / static_cast<std::size_t>(slice.grid.size[2]);
  for (const DicomFrame& frame : slice.frames) {
    const DicomScale& scale = frame.scale;
    if (scale.slope == slope && scale.intercept == intercept) continue;
    const std::size_t from = first + frame.number * size;
    for (std::size_t n = from; n < from + size; ++n) {
      const double stored = std::round((static_cast<double>(values[n]) - intercept) / slope);
      values[n] = static_cast<float>(scale.slope * stored + scale.intercept);
    }
  }
}

}  // namespace

bool read_slice_header(Slice& slice) {
  const DicomLook& look = slice.look;
  if (!look.pixels) {
    if (!look.image) return false;
    throw Error(slice.file.string() +
                ": an image without its pixels; copy or export the series again, or take the file "
                "out if it is no slice");
  }
  if (!look.followed) {  // GDCM would take any four bytes for a length, and ask for as much memory
    slice.refused = not_read(look.syntax);
    return true;
  }
  const auto copy = copy_of(slice);
  const std::string path = path_of(slice, copy);
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  if (!reader.ReadUpToTag(pixels, {pixels})) {
    slice.refused = not_read(look.syntax);
    return true;
  }
  const gdcm::DataSet& data = reader.GetFile().GetDataSet();
  const bool deflated = look.syntax == kDeflated;
  if (deflated && !data.FindDataElement(gdcm::Tag(0x28, 0x10))) return false;
  read_elements(slice, data);

  // ITK is not asked where it would make up a place, or end the program for want of one.
  const auto is_placed = [](const DicomFrame& frame) { return frame.lacks.empty(); };
  if (slice.refused.empty() && is_known(look) && is_placed(slice.image) &&
      std::all_of(slice.frames.begin(), slice.frames.end(), is_placed)) {
    ask_itk(slice, path);
  }
  const bool inverse = dicom_text(data, {0x28, 0x04}) == "MONOCHROME1";
  if (slice.refused.empty()) slice.refused = find_refusal(slice, inverse);
  return true;
}

Packing packing_of(const Slice& slice) {
  const auto copy = copy_of(slice);
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  const std::string path = path_of(slice, copy);
  reader.SetFileName(path.c_str());
  if (!is_known(slice.look)) return {"an unknown syntax", shown_uid(slice.look.syntax), true};
  if (!reader.ReadUpToTag(pixels, {pixels})) return {};
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  gdcm::UIDs names;
  const bool known = names.SetFromUID(syntax.GetString());
  return {known ? names.GetName() : "an unknown syntax", syntax.GetString(),
          syntax.IsEncapsulated()};
}

void append_slice(const Slice& slice, const fs::path& folder, std::vector<float>& values) {
  const auto copy = copy_of(slice);
  if (copy) slice.io->SetFileName(copy->path());
  require_whole_dicom(*slice.io, slice.file);
  const LastWords decoder;
  const std::size_t before = values.size();
  try {
    append_voxels(*slice.io, folder, values);
    scale_frames(slice, before, values);
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    const Packing packing = packing_of(slice);
    if (!packing.packed) throw;
    throw Error(slice.file.string() + ": its pixels are packed as " + packing.name + " (" +
                packing.uid + "), but GDCM does not unpack them" + decoder.text() +
                ": their bytes are damaged, or of a kind that it does not know; copy the file "
                "again, or export the series uncompressed");
  }
}

}  // namespace wireplan::preprocess
