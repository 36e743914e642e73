// Tables of label names: the first byte chooses the ending, the rest is the file.
#include <array>

#include "pipeline/files/labels_file.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"dataset.json", "table.csv", "table.txt", "table.ctbl"};
  if (size == 0) return 0;
  try {
    const auto table = pipeline::read_label_table(
        fuzz::folder().write(kNames[data[0] % kNames.size()], fuzz::view(data + 1, size - 1)));
    expects(!table.empty() && table.begin()->first >= 0 && table.rbegin()->first <= 1000000);
    for (const auto& [value, name] : table) {
      expects(pipeline::Json::parse(pipeline::Json(name).dump()) == name);
    }
  } catch (const Error&) {
  }
  return 0;
}
