#pragma once
/// Whether the images of a series are one volume of Hounsfield units; for the .cpp files here.
#include <filesystem>

#include "preprocess/volume/apart.h"
#include "preprocess/volume/dicom_choice.h"
#include "preprocess/volume/dicom_stack.h"

namespace wireplan::preprocess {

/// Images of a series at their places, or frames of an enhanced file. `problem` tells with its path
/// why they are no volume: of several phases, unevenly placed, thick slabs, of values in other
/// units. Pixels are read of a CT alone that does not tell how its values are scaled. Throws
/// `Error` where frames have no common grid.
Stack stack_series(const Series& series, const std::filesystem::path& folder, const At& at);

/// Leaves the images of one acquisition or phase of several, counted from 1 as the refusal of them
/// all has them. Throws `Error` where there is none of that number.
void keep_part(Series& series, std::size_t part, const std::string& wanted,
               const std::filesystem::path& folder);

}  // namespace wireplan::preprocess
