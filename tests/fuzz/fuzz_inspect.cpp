// `wireplan inspect` on a file: the first byte chooses its ending, the rest is the file. DICOM is
// read in this process.
#include <array>
#include <cmath>

#include "pipeline/report/inspect.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/in_place.h"

using namespace wireplan;

namespace {

constexpr std::array kNames = {"file.nii", "file.nrrd", "file.mha", "file.stl",
                               "file.ply", "file.obj",  "file.vtp", "file.dcm"};

/// As JSON has no other numbers.
void expect_finite(const pipeline::Json& value) {
  if (value.is_number_float()) expects(std::isfinite(value.get<double>()));
  if (!value.is_structured()) return;
  for (const pipeline::Json& element : value) expect_finite(element);
}

void look_at(const std::uint8_t* data, std::size_t size) {
  const char* name = kNames[data[0] % kNames.size()];
  try {
    const pipeline::Json told =
        pipeline::inspect(fuzz::folder().write(name, fuzz::view(data + 1, size - 1)));
    expect_finite(told);
    told.dump(2, ' ', false, pipeline::Json::error_handler_t::replace);
    expects(!pipeline::inspect_text(told).empty());
  } catch (const Error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path kTable =
      fuzz::folder().write("file.csv", "1,aorta\n2,renal left\n");  // names of the labels
  if (size > 0) fuzz::run_in_place([&] { look_at(data, size); });
  return 0;
}
