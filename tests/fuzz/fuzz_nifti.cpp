// NIfTI of both versions, compressed or not.
#include "tests/fuzz/volumes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  wireplan::fuzz::read_volume("volume.nii", data, size);
  return 0;
}
