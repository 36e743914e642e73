#pragma once
/// NIfTI-1 and NIfTI-2 in one file, .nii or .nii.gz, read here and not by a library: nifticlib
/// takes a file's twin of the other extension, and ITK converts units of the spacing but not of the
/// place, refuses shears of rounding size, reads larger ones in silence and knows no NIfTI-2.
#include <filesystem>

#include "preprocess/volume/describe.h"

namespace wireplan::preprocess {

/// Values times slope plus intercept, where there is a slope; the grid in LPS mm by the sform, else
/// by the qform, else upright, told in the image's remarks (nifti1.h, methods 3, 2 and 1). Throws
/// `Error` where it is no NIfTI, damaged or cut short, a colour or 4D image, sheared (with the
/// angle), without a spacing, over 3 m across, where its sform alone places it with other spacings
/// than pixdim's, or where both forms are given and place a corner more than half a voxel apart;
/// from 0.1 mm on the remarks tell.
/// What is read of the header stands in `told` then too.
Image read_nifti(const std::filesystem::path& path, VolumeHeader& told);

}  // namespace wireplan::preprocess
