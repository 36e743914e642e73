#pragma once
/// What the readers of volumes share about ITK's ImageIO objects; for the .cpp files here.
#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "itkImageIOBase.h"
#include "preprocess/text.h"
#include "preprocess/volume/describe.h"

namespace wireplan::preprocess {

inline constexpr const char* kFormats =
    "expected a folder with one DICOM series, or a file .nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd";

/// Runs a call into ITK. Whatever it throws becomes an Error that starts with the path and says
/// `problem`; ITK's own text is left out, since it may quote a header and with it a patient.
template <typename Call>
auto call_itk(const std::filesystem::path& path, const std::string& problem, Call call) {
  try {
    return call();
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    throw Error(path.string() + ": " + problem);
  }
}

/// What is wrong where a header of this format reads but the voxels do not.
std::string damaged(const std::string& format);

/// Of a field of a header that holds what no volume has, with what is expected.
Error wrong_field(const std::string& field, const std::string& value, const std::string& expected,
                  const std::filesystem::path& path);

/// Of a file that does not begin as the format that its ending names. `beginning` is the first of
/// its bytes, unpacked; `seen` says what is wrong with them where they are of no other known kind.
Error not_of_format(const std::string& format, const std::string& beginning,
                    const std::string& seen, const std::filesystem::path& path);

/// The first bytes of a file.
std::string beginning_of(const std::filesystem::path& path);

/// Refuses sizes of a header that no volume has, told by the header's own names.
void require_size(std::int64_t size, const std::string& field, const std::filesystem::path& path);

/// The message of an Error about that path, without the path at its beginning.
std::string without_path(const std::string& message, const std::filesystem::path& path);

/// Refuses text of a header that cannot be printed; `what` it is.
void require_utf8(const std::string& text, const std::string& what,
                  const std::filesystem::path& path);

std::string one_decimal(double value);  // with one digit behind the point

/// How far the axes are from right angles, at most.
double shear_degrees(const Mat3& axes);

/// The rotation (or reflection) nearest to what the header says, so that Grid may rely on
/// orthonormal columns. Headers round to a few digits; more than 1e-3 off is a sheared image.
Mat3 orthonormal_direction(const Mat3& direction, const std::filesystem::path& path);

/// What no volume of one value per voxel has.
void require_volume(const Grid& grid, const std::filesystem::path& path);
Error several_values(unsigned count, const std::filesystem::path& path);
Error several_volumes(std::int64_t count, const std::filesystem::path& path);
Error slices_as_times(std::int64_t count, const std::filesystem::path& path);
Error unknown_values(const std::filesystem::path& path);

/// Size and placement from a header that has been read; axes beyond the third are ignored.
Grid header_grid(const itk::ImageIOBase& io, const std::filesystem::path& path,
                 double mm_per_unit = 1.0);

/// Refuses a grid whose spacing or origin [mm] is no number, not positive or far from any patient.
void require_place(const Vec3& spacing, const Vec3& origin, const Mat3& direction,
                   const std::filesystem::path& path);

/// Of a header without the size of its voxels; `keys` would tell it.
Error lacks_spacing(const std::string& keys, const std::string& remedy,
                    const std::filesystem::path& path);

/// Whether two spacings are the same but for rounding: within 1 % of the second.
bool is_same_spacing(double a, double b);

/// Refuses a volume that is over 3 m or under 1 mm across, as of a wrong unit; `keys` of the header
/// say so.
void require_extent(const std::array<int, 3>& size, const Vec3& spacing, const std::string& keys,
                    const std::filesystem::path& path);

/// The remark on a volume whose header does not tell where it lies, since it `lacks` that.
std::string placed_nowhere(const std::string& lacks, const std::string& frame);

/// How many values a header promises, as its sizes say, be they sound or not.
double count_values(const itk::ImageIOBase& io);

/// Deflate packs 1032 to 1 at most.
inline constexpr double kMostDeflated = 1040.0;

/// Refuses voxels of `needed` bytes where so many are stored, each for `most_packed` of them: room
/// is taken only for what a file can hold, whatever a damaged header promises.
void require_room(double needed, double stored, double most_packed, const std::string& format,
                  const std::filesystem::path& path);

/// The size of the file beside a header that holds its voxels [bytes].
double size_beside(const std::filesystem::path& header, const std::string& name);

/// Of a header whose voxels lie in several files; `ending` is that of a format that has them in
/// one.
Error voxels_in_list(const std::filesystem::path& path, const std::string& ending);

/// Sizes, spacing and type of voxels as they stand in a header, sound or not.
void tell_header(const itk::ImageIOBase& io, VolumeHeader& told);

/// wireplan takes one value per voxel and one volume per file.
void require_scalar_volume(const itk::ImageIOBase& io, const Grid& grid,
                           const std::filesystem::path& path);

/// Reads the voxels of the file whose header `io` has read and appends them.
void append_voxels(itk::ImageIOBase& io, const std::filesystem::path& path,
                   std::vector<float>& values);

/// Appends the numbers of the type that `io` has read of its header.
void append_numbers(const itk::ImageIOBase& io, const std::vector<char>& bytes,
                    const std::filesystem::path& path, std::vector<float>& values);

/// Each value times the slope plus the intercept.
void scale_values(double slope, double intercept, std::vector<float>& values);

}  // namespace wireplan::preprocess
