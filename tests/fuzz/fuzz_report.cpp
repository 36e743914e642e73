// Reports that a user hands in: any bytes are a report that can be told in a line, or an Error.
#include "pipeline/report/report.h"
#include "pipeline/report/verdict_json.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    pipeline::describe_best(
        pipeline::read_report(fuzz::folder().write("report.json", fuzz::view(data, size))));
  } catch (const Error&) {
  }
  return 0;
}
