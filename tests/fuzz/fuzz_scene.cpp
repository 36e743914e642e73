// Scene files: any bytes are a scene or an Error.
#include "pipeline/files/scene_file.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path kSurface = fuzz::folder().write("tube.stl", "");
  try {
    pipeline::read_scene(fuzz::folder().write("scene.json", fuzz::view(data, size)));
  } catch (const Error&) {
  }
  return 0;
}
