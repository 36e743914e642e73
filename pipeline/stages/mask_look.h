#pragma once
/// The first look at a mask, without a viewer.
#include <filesystem>

#include "pipeline/files/case_file.h"
#include "preprocess/volume/image.h"

namespace wireplan::pipeline {

/// Writes slices.png (report/mask_picture.h): accesses, targets, the narrowest place of the way and
/// those that the stage's `figures` doubt, which are touches and leaks that were cut; and the way
/// from the first access to the first target. Expects the mask to hold both in one piece.
void write_mask_look(const Case& given, const preprocess::Image& image,
                     const preprocess::Mask& mask, const Json& figures,
                     const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
