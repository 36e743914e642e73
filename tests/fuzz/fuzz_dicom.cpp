// DICOM: the halves of the input are the two slices of a folder. They are looked through here too:
// what happens in the process that reads them is not seen by the fuzzer.
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/image.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes = fuzz::view(data, size);
  fuzz::folder().write("series/1.dcm", bytes.substr(0, size / 2));
  const auto second = fuzz::folder().write("series/2.dcm", bytes.substr(size / 2));
  preprocess::check_dicom(second);
  try {
    preprocess::read_image(second.parent_path());
  } catch (const Error&) {
  }
  return 0;
}
