// In the place of image.cpp where wireplan is built without ITK.
#include "preprocess/volume/describe.h"
#include "preprocess/volume/image.h"
#include "preprocess/volume/labels.h"

namespace wireplan::preprocess {

bool reads_volumes() { return false; }

namespace {

[[noreturn]] void refuse() {
  throw Error("this wireplan is built without imaging and reads no volumes; enter the case at a " +
              std::string("surface, or configure with -DWIREPLAN_IMAGING=ON"));
}

}  // namespace

Image read_image(const std::filesystem::path&, const std::string&) { refuse(); }
void write_image(const Image&, const std::filesystem::path&) { refuse(); }
void write_mask(const Mask&, const std::filesystem::path&) { refuse(); }
Mask read_mask(const std::filesystem::path&) { refuse(); }
LabelVolume read_labels(const std::filesystem::path&, const LabelChoice&, const Grid*) { refuse(); }
LabelListing list_labels(const std::filesystem::path&, const std::map<int, std::string>&) {
  refuse();
}
VolumeDescription describe_volume(const std::filesystem::path&) { refuse(); }

}  // namespace wireplan::preprocess
