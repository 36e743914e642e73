#pragma once
/// Which series of a folder is read; for the .cpp files here.
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/volume/dicom_slice.h"

namespace wireplan::preprocess {

/// Images of one series UID, size, spacing and orientation, never none.
using Series = std::vector<Slice>;

/// Puts a slice where it belongs.
void add_slice(Slice slice, std::vector<Series>& all);

std::vector<Vec3> origins_of(const Series& series);

/// Whether it is one file of several frames.
bool is_enhanced(const Series& series);

/// By which a series that has neither a number nor a description of its own is named: "#" and eight
/// hexadecimal digits made of its UID, which is not shown itself, as it may hold a date.
std::string key_of(const Series& series);

/// The series to read of those whose number, description or key is `wanted`, or of all where that
/// is empty: the only one, the only scan among doses, segmentations and projections, or the one
/// that alone has a volume's shape; the end where there is none.
/// What has its UID but not its shape is not asked for.
std::vector<Series>::iterator find_chosen(std::vector<Series>& all, const std::string& wanted);

/// The same. Throws `Error` where there is none, where images of the series differ in size, spacing
/// or orientation (but for a localizer's few), and where one of them is refused.
Series choose_series(const std::filesystem::path& folder, const std::string& wanted,
                     std::vector<Series> all);

/// Why images of this series cannot be read as one volume; empty where nothing is found.
std::string find_mixture(const Series& series, const std::vector<Series>& all);

/// For messages and lists: "0.8 x 0.6".
std::string shown_spacing(const Grid& grid);

}  // namespace wireplan::preprocess
