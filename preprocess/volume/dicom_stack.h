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
  std::string problem;  // why they form no volume; empty where they do
};

/// The grid of images that lie at `origins` and are else as `first`, which is one of them.
Stack stack(const std::vector<Vec3>& origins, const Grid& first);

/// The description of a series, or nothing where it holds one of the `tags` of its patient: a part
/// of a name ("LOVELACE^AUGUSTA"), a number, or a date in any order of day, month and year.
std::string without_identity(const std::string& description, const std::vector<std::string>& tags);

}  // namespace wireplan::preprocess
