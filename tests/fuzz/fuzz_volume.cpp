// Volumes: the first byte chooses the format, the rest is the file, header and voxels; of DICOM its
// halves are the two slices of a folder.
#include <array>

#include "preprocess/image.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"volume.nrrd", "volume.nii", "volume.mha"};
  if (size == 0) return 0;
  const std::string_view bytes = fuzz::view(data + 1, size - 1);
  const std::size_t format = data[0] % (kNames.size() + 1);
  std::filesystem::path path;
  if (format < kNames.size()) {
    path = fuzz::folder().write(kNames[format], bytes);
  } else {
    fuzz::folder().write("series/1.dcm", bytes.substr(0, bytes.size() / 2));
    path = fuzz::folder().write("series/2.dcm", bytes.substr(bytes.size() / 2)).parent_path();
  }
  try {
    const preprocess::Image image = preprocess::read_image(path);
    expects(image.values.size() == image.grid.voxels());
  } catch (const Error&) {
  }
  return 0;
}
