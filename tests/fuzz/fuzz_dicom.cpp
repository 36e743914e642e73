// A folder of DICOM files, which stand behind one another in the input: read, and where the first
// byte is odd, described. In this process, where the program starts one.
#include <string>

#include "preprocess/volume/describe.h"
#include "tests/fuzz/in_place.h"
#include "tests/fuzz/volumes.h"

using namespace wireplan;

namespace {

void look_at(const std::uint8_t* data, std::size_t size) {
  static int files_before = 0;
  int count = 0;
  std::filesystem::path folder;
  for (const std::string_view file : fuzz::files_in(fuzz::view(data + 1, size - 1))) {
    folder = fuzz::folder().write("series/" + std::to_string(count++), file).parent_path();
  }
  for (int k = count; k < files_before; ++k) std::filesystem::remove(folder / std::to_string(k));
  files_before = count;
  try {
    if (data[0] % 2 == 0) return fuzz::expect_sound(preprocess::read_image(folder));
    const preprocess::VolumeDescription told = preprocess::describe_volume(folder);
    expects(!told.series.empty() && told.grid.has_value() == told.refused.empty());
  } catch (const Error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) fuzz::run_in_place([&] { look_at(data, size); });
  return 0;
}
