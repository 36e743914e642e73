#pragma once
/// Images at their places -> a regular stack of slices, or why they form none; for the .cpp files
/// here.
#include <cstddef>
#include <string>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct Stack {
  std::vector<std::size_t> order;  // of the images, along their normal
  Grid grid;
  std::string problem = {};              // why they form no volume; empty where they do
  std::vector<std::size_t> images = {};  // at which the problem is, where it is at one or two
  std::size_t places = 1;                // that differ along the normal
};

/// The grid of images that lie at `origins` and are else as `first`, which is one of them.
Stack stack(const std::vector<Vec3>& origins, const Grid& first);

}  // namespace wireplan::preprocess
