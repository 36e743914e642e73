// MetaImage, with its voxels behind the header or beside it in voxels.raw.
#include "tests/fuzz/volumes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  wireplan::fuzz::read_volume("volume.mha", data, size);
  return 0;
}
