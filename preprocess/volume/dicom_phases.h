#pragma once
/// Whether images are of one stack, phase and acquisition: put half a step apart, two of them look
/// as one volume of thinner slices; for the .cpp files here.
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "gdcmDataSet.h"

namespace wireplan::preprocess {

/// What an image is of, by the name and tag of what tells it; as bytes, to compare with.
using DicomPhase = std::map<std::string, std::string>;

/// Adds what the elements tell: those of a file, or of a frame's functional groups, whose dimension
/// indices (PS3.3 section C.7.6.17) are told by those `pointers`.
void read_phase(const gdcm::DataSet& data, const std::vector<gdcm::Tag>& pointers,
                DicomPhase& phase);

/// What the dimension indices of a file's frames are of, in their order.
std::vector<gdcm::Tag> read_dimensions(const gdcm::DataSet& data);

/// Images of several stacks, phases or acquisitions.
struct DicomParts {
  std::string what;  // "2 acquisitions (Acquisition Number (0020,0012)) that lie ..."
  std::vector<std::vector<std::size_t>> images;  // of each; none where all are of one
};

/// Of which stacks, phases or acquisitions these images are: of none where they are of one, where
/// each is of its own, or where they are of acquisitions one behind the other in this `order` along
/// their normal, as a scan of several parts is.
DicomParts find_parts(const std::vector<const DicomPhase*>& images,
                      const std::vector<std::size_t>& order);

}  // namespace wireplan::preprocess
