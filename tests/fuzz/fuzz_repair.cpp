// Repair of surfaces, over the inputs of `surface`: what can be read is repaired, and passes or
// fails the check that every surface of a case goes through. A thousandth of a second and more
// each.
#include <array>

#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"surface.stl", "surface.ply", "surface.obj", "surface.vtp"};
  if (size == 0) return 0;
  try {
    const auto [surface, mends, dropped] = preprocess::read_surface(
        fuzz::folder().write(kNames[data[0] % kNames.size()], fuzz::view(data + 1, size - 1)), "mm",
        "LPS");
    preprocess::check_surface(surface);
    preprocess::tell_mends(mends);
  } catch (const Error&) {
  }
  return 0;
}
