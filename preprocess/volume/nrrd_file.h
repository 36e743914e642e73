#pragma once
/// NRRD, .nrrd and .nhdr: placed by its own header, voxels by ITK's NrrdIO after that was looked
/// through.
#include <filesystem>
#include <vector>

#include "preprocess/volume/describe.h"

namespace wireplan::preprocess {

/// A volume for each value of a voxel where `layered`, and else one; the grid in LPS mm by `space`
/// (LPS, RAS, LAS, with time or without), `space directions`, `space origin` and the units of
/// either; without a space along the axes of LPS, told in the first image's remarks, by `spacings`,
/// or `axis mins`, `axis maxs` and `centers`. Throws `Error` where it is no NRRD, cut short or
/// packed in a way that NrrdIO does not know, where its space is another, without the size of its
/// voxels, over 3 m across, and where its axes have different units.
/// What is read of the header stands in `told` then too.
std::vector<Image> read_nrrd(const std::filesystem::path& path, VolumeHeader& told, bool layered);

}  // namespace wireplan::preprocess
