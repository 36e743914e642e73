// Case files: any bytes are a case or an Error, and a case's parameters read back as the same case.
#include "pipeline/files/case_file.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool kInputsAreThere = [] {
    fuzz::folder().write("ct.nrrd", "");
    fuzz::folder().write("tube.stl", "");
    return true;
  }();
  expects(kInputsAreThere);
  try {
    const pipeline::Case given =
        pipeline::read_case(fuzz::folder().write("case.json", fuzz::view(data, size)));
    const pipeline::Json parameters = pipeline::case_parameters(given);
    const pipeline::Case again =
        pipeline::read_case(fuzz::folder().write("case.json", parameters.dump()));
    expects(pipeline::case_parameters(again) == parameters);
  } catch (const Error&) {
  }
  return 0;
}
