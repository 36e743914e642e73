#pragma once
/// Segmentations that somebody else made: a volume of labels (NIfTI, NRRD, MetaImage), 3D Slicer's
/// .seg.nrrd with its layers, or a folder with one file per class, as TotalSegmentator writes it.
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// Which classes of a file or folder are meant. Values, names, or both: then the names are those of
/// the values, one each. Neither is enough where a file holds one class alone.
struct LabelChoice {
  std::vector<int> values = {};
  std::vector<std::string> names = {};
  std::map<int, std::string> table = {};  // names of values that the file itself does not tell
  bool table_wins = false;                // over those that it does
};

/// A chosen class.
struct LabelClass {
  std::string name;  // "label 3" where none is known
  int value = 0;     // in its file
  std::size_t voxels = 0;
  std::string lost = {};  // why none of its voxels is left, though its file holds some; else empty
};

/// Voxels that two chosen classes both hold; they count as the first's.
struct LabelOverlap {
  std::size_t first = 0, second = 0;  // indices of the classes
  std::size_t voxels = 0;
};

struct LabelVolume {
  Grid grid;
  std::vector<std::uint8_t> class_of;  // grid.index order: 0, or 1 + the index of the class
  std::vector<LabelClass> classes;     // in the order in which they were chosen
  std::vector<LabelOverlap> overlaps;
  std::vector<std::string> resampled;  // what was moved to another grid, in words
  std::vector<std::string> remarks;    // what else a person should know of how they were read
};

/// Reads the chosen classes, onto the grid `onto` where it is not null; else onto that of the file,
/// of a folder that of its first class. A file on another grid is resampled: a voxel is inside
/// where half of what lies round its centre is. Labels may be stored as floats, but must be whole
/// numbers. Throws one `Error` with all problems: no such class (with those that there are), a
/// class without voxels, values that are no labels (with the first of them and its place), several
/// classes in one file of a folder, and a grid that contradicts `onto` (label_frame.h).
LabelVolume read_labels(const std::filesystem::path& path, const LabelChoice& choice,
                        const Grid* onto = nullptr);

struct ListedClass {
  std::string name;  // empty where none is known
  int value = 0;     // in its file
  int layer = 0;     // of a .seg.nrrd; its values count in it alone
  std::size_t voxels = 0;
  double volume_mm3 = 0.0;
};

/// What a file or folder holds, for people who ask which classes there are.
struct LabelListing {
  std::vector<ListedClass> classes;  // of a file by layer and value, of a folder by name
  std::vector<std::string> remarks;  // of how it was read, each once
  int others = 0;                    // files of a folder that hold no single class
};

/// `table` names values as LabelChoice::table does. Throws `Error` where nothing can be told.
LabelListing list_labels(const std::filesystem::path& path,
                         const std::map<int, std::string>& table);

}  // namespace wireplan::preprocess
