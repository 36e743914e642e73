// Surfaces as they are read: the first byte chooses the format, the rest is the file.
#include <array>

#include "preprocess/surface/surface.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"surface.stl", "surface.ply", "surface.obj", "surface.vtp"};
  if (size == 0) return 0;
  try {
    const Surface surface = preprocess::read_triangles(
        fuzz::folder().write(kNames[data[0] % kNames.size()], fuzz::view(data + 1, size - 1)), "mm",
        "LPS");
    expects(surface.vertices.allFinite() && surface.triangles.cols() > 0 &&
            surface.triangles.minCoeff() >= 0 &&
            surface.triangles.maxCoeff() < surface.vertices.cols());
  } catch (const Error&) {
  }
  return 0;
}
