// Volumes in one file: the first byte chooses the format, the rest is the file, header and voxels.
#include <array>

#include "preprocess/volume/image.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"volume.nrrd", "volume.nii", "volume.mha"};
  if (size == 0) return 0;
  try {
    const preprocess::Image image = preprocess::read_image(
        fuzz::folder().write(kNames[data[0] % kNames.size()], fuzz::view(data + 1, size - 1)));
    expects(image.values.size() == image.grid.voxels());
  } catch (const Error&) {
  }
  return 0;
}
