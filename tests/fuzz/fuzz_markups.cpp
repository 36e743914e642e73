// Markups of 3D Slicer: the first byte chooses the ending, the rest is the file. What it holds is
// then a case's access and target.
#include <array>

#include "pipeline/files/markups_file.h"
#include "tests/fuzz/fuzz.h"

using namespace wireplan;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"points.mrk.json", "points.fcsv", "points.csv"};
  if (size == 0) return 0;
  const std::string name = kNames[data[0] % kNames.size()];
  const std::filesystem::path file = fuzz::folder().write(name, fuzz::view(data + 1, size - 1));
  try {
    for (const pipeline::MarkupPoint& point : pipeline::read_markups(file).points) {
      expects(point.point.allFinite() && point.point.cwiseAbs().maxCoeff() <= 1e6);
    }
  } catch (const Error&) {
  }
  pipeline::Problems problems("case.json");
  pipeline::Json ends = {{"access", {{"point", {{"markups", name}, {"label", "entry"}}}}},
                         {"target", {{"point", {{"markups", name}}}}}};
  pipeline::resolve_points(ends, file.parent_path(), problems);
  for (const char* end : {"access", "target"}) expects(ends[end]["point_mm"].size() == 3);
  try {
    problems.throw_if_any();
  } catch (const Error&) {
  }
  return 0;
}
