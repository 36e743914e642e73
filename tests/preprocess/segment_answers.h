#pragma once
/// What a segmentation answers: how much of the truth, or which error.
#include <gtest/gtest.h>

#include <string>

#include "preprocess/segment/segment.h"

namespace wireplan::preprocess {

/// Overlap of the mask with the voxels for which `truth(point)` holds: 2 |A and B| / (|A| + |B|).
template <typename Truth>
double dice(const Mask& mask, Truth truth) {
  double both = 0.0, sum = 0.0;
  for (int k = 0; k < mask.grid.size[2]; ++k) {
    for (int j = 0; j < mask.grid.size[1]; ++j) {
      for (int i = 0; i < mask.grid.size[0]; ++i) {
        const bool a = mask.labels[mask.grid.index(i, j, k)] != 0;
        const bool b = truth(mask.grid.lps_from_ijk(Vec3(i, j, k)));
        both += a && b ? 2.0 : 0.0;
        sum += (a ? 1.0 : 0.0) + (b ? 1.0 : 0.0);
      }
    }
  }
  return both / sum;
}

inline std::string error_of(const Image& image, const SegmentOptions& settings) {
  try {
    segment(image, settings);
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace wireplan::preprocess
