// Labels that somebody else made: the first byte says what kind of file or folder, which classes
// are chosen and on which grid; the rest is the file, or the two files of a folder.
#include <array>

#include "preprocess/volume/labels.h"
#include "tests/fuzz/volumes.h"

using namespace wireplan;

namespace {

preprocess::LabelChoice choice_of(unsigned mode) {
  preprocess::LabelChoice choice;
  const unsigned chosen = mode >> 2U & 3U;
  if (chosen % 2 == 1) choice.names = {"aorta", "renal left"};
  if (chosen >= 2) choice.values = {1, 2};
  if ((mode & 16U) != 0) choice.table = {{1, "aorta"}, {2, "renal left"}, {3, "air"}};
  choice.table_wins = (mode & 32U) != 0;
  return choice;
}

std::filesystem::path write_labels(unsigned kind, std::string_view bytes) {
  constexpr std::array kNames = {"labels.seg.nrrd", "labels.nii", "labels.mha"};
  if (kind < kNames.size()) return fuzz::folder().write(kNames[kind], bytes);
  const std::vector<std::string_view> files = fuzz::files_in(bytes);
  fuzz::folder().write("classes/aorta.nii", files.front());
  return fuzz::folder().write("classes/renal left.nrrd", files.back()).parent_path();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const preprocess::Grid kVolume{
      .size = {3, 4, 5}, .spacing = Vec3(1.0, 0.5, 0.7), .origin = Vec3(-0.5, 0.0, 0.25)};
  if (size == 0) return 0;
  const unsigned mode = data[0];
  fuzz::write_voxels_beside();
  try {
    const preprocess::LabelVolume labels =
        preprocess::read_labels(write_labels(mode % 4, fuzz::view(data + 1, size - 1)),
                                choice_of(mode), (mode & 64U) != 0 ? &kVolume : nullptr);
    fuzz::expect_sound(labels.grid);
    expects(labels.class_of.size() == labels.grid.voxels() && !labels.classes.empty());
    expects(*std::max_element(labels.class_of.begin(), labels.class_of.end()) <=
            labels.classes.size());
  } catch (const Error&) {
  }
  return 0;
}
