#include "preprocess/volume/labels.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/label_frame.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostClasses = 250;  // class_of holds their numbers in 8 bits
constexpr float kLargestLabel = 1e6F;

/// All that is wrong, told at once.
class Complaints {
 public:
  void add(const std::string& what) { text_ += (text_.empty() ? "" : "\n") + what; }
  void throw_if_any() const {
    if (!text_.empty()) throw Error(text_);
  }

 private:
  std::string text_;
};

std::string key_of(const char* list, std::size_t index) {
  return std::string("labels.") + list + "[" + std::to_string(index) + "]";
}

std::string quoted_list(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 30;
  std::string text;
  for (std::size_t k = 0; k < std::min(kMost, names.size()); ++k) {
    text += (k == 0 ? "" : ", ") + names[k];
  }
  if (names.size() > kMost) text += " and " + std::to_string(names.size() - kMost) + " more";
  return text.empty() ? "none" : text;
}

/// With all of its digits: what is hardly no whole number must not look like one.
std::string whole_text(float value) {
  std::ostringstream text;
  text << std::setprecision(9) << value;
  return text.str();
}

/// The first value that is no label; empty where all are whole numbers from 0.
std::optional<std::size_t> find_no_label(const std::vector<float>& values) {
  const auto bad = std::find_if(values.begin(), values.end(), [](float value) {
    return !(value >= 0.0F && value <= kLargestLabel) || value != std::floor(value);
  });
  if (bad == values.end()) return {};
  return static_cast<std::size_t>(bad - values.begin());
}

/// Why a file that holds no labels of ours, but is DICOM, is refused; empty where it is none.
std::string find_dicom(const fs::path& file) {
  const DicomLook look = look_at_dicom(file);
  if (look.form == DicomForm::kNone) return {};
  const auto [name, labels] = kind_of(look);
  return name + (labels ? " is not read; export it as NIfTI or NRRD"
                        : " holds no labels that are read; export the segmentation as NIfTI or "
                          "NRRD");
}

/// The layers of a file, seen to hold labels.
std::vector<Image> read_checked(const fs::path& path, VolumeHeader& told) {
  if (!fs::exists(path)) {
    throw Error(path.string() +
                ": no such file or folder; expected a volume of labels (.nii, .nii.gz, .nrrd, "
                ".nhdr, .mha or .mhd), or a folder with one such file per class");
  }
  if (const std::string dicom = find_dicom(path); !dicom.empty()) {
    throw Error(path.string() + ": " + dicom);
  }
  std::vector<Image> layers = read_layers(path, told);
  for (const Image& layer : layers) {
    const std::optional<std::size_t> bad = find_no_label(layer.values);
    if (!bad) continue;
    const auto count = std::count_if(layer.values.begin(), layer.values.end(),
                                     [](float value) { return value != std::floor(value); });
    const Grid& grid = layer.grid;
    const auto nx = static_cast<std::size_t>(grid.size[0]),
               ny = static_cast<std::size_t>(grid.size[1]);
    const Vec3 at =
        grid.lps_from_ijk(Vec3(static_cast<double>(*bad % nx), static_cast<double>(*bad / nx % ny),
                               static_cast<double>(*bad / (nx * ny))));
    throw Error(path.string() + ": its value at " + place_text(at) + " mm is " +
                whole_text(layer.values[*bad]) + ", expected labels: whole numbers from 0 (" +
                (count > 0 ? "if these are probabilities, threshold them at 0.5"
                           : "if this is the CT, it belongs under volume") +
                ")");
  }
  return layers;
}

/// What a file holds under one name.
struct Known {
  std::string name;
  int value = 0;
  std::size_t layer = 0;
  std::size_t choice = 0;  // where the case's list has it
};

void add_once(const std::vector<std::string>& remarks, std::vector<std::string>& to) {
  for (const std::string& remark : remarks) {
    if (std::find(to.begin(), to.end(), remark) == to.end()) to.push_back(remark);
  }
}

std::vector<Known> known_classes(const VolumeHeader& told, const LabelChoice& choice) {
  std::vector<Known> known;
  for (std::size_t k = 0; k < told.segments.size(); ++k) {
    const NamedSegment& segment = told.segments[k];
    // 3D Slicer before 4.11 gave no values: a layer for each segment, of 0 and 1.
    const bool old = segment.value == 0;
    const auto renamed = choice.table.find(segment.value);
    const bool other = choice.table_wins && renamed != choice.table.end();
    const int value = old ? 1 : segment.value;
    const std::string own = segment.name.empty() ? "label " + std::to_string(value) : segment.name;
    known.push_back({.name = other ? renamed->second : own,
                     .value = value,
                     .layer = old ? k : static_cast<std::size_t>(std::max(0, segment.layer))});
  }
  if (!known.empty()) return known;
  const bool by_table = choice.table_wins || told.label_names.empty();
  for (const auto& [value, name] : by_table ? choice.table : told.label_names) {
    if (value != 0) known.push_back({.name = name, .value = value});
  }
  return known;
}

std::vector<std::string> names_of(const std::vector<Known>& known) {
  std::vector<std::string> names;
  for (const Known& one : known) names.push_back(one.name);
  return names;
}

/// How many voxels of a layer have each value other than 0.
std::map<int, std::size_t> count_labels(const Image& layer) {
  const auto largest = std::max_element(layer.values.begin(), layer.values.end());
  std::vector<std::size_t> seen(static_cast<std::size_t>(*largest) + 1);
  for (const float value : layer.values) ++seen[static_cast<std::size_t>(value)];
  std::map<int, std::size_t> counts;
  for (std::size_t value = 1; value < seen.size(); ++value) {
    if (seen[value] > 0) counts[static_cast<int>(value)] = seen[value];
  }
  return counts;
}

/// Values other than 0 in a layer, ascending.
std::vector<int> values_in(const Image& layer) {
  std::vector<int> values;
  for (const auto& [value, count] : count_labels(layer)) values.push_back(value);
  return values;
}

std::vector<std::string> as_text(const std::vector<int>& values) {
  std::vector<std::string> text;
  for (const int value : values) text.push_back(std::to_string(value));
  return text;
}

std::string values_text(const std::vector<Image>& layers) {
  std::set<int> found;
  for (const Image& layer : layers) {
    const std::vector<int> values = values_in(layer);
    found.insert(values.begin(), values.end());
  }
  const std::vector<int> all(found.begin(), found.end());
  return quoted_list(as_text(all));
}

/// The class of a value that the case names.
Known chosen_by_value(const fs::path& path, const LabelChoice& choice, std::size_t k,
                      const std::vector<Known>& known, std::size_t layers, Complaints& wrong) {
  const int value = choice.values[k];
  Known found{.name = "label " + std::to_string(value), .value = value};
  int matches = 0;
  for (const Known& one : known) {
    if (one.value != value) continue;
    found = one;
    ++matches;
  }
  if (matches > 1 && layers > 1) {
    wrong.add(path.string() + ": " + key_of("values", k) + " is " + std::to_string(value) +
              ", which several segments in different layers have, expected a value of one segment "
              "(choose them by labels.names: " +
              quoted_list(names_of(known)) + ")");
  }
  if (!choice.names.empty()) found.name = choice.names[k];
  found.choice = k;
  return found;
}

/// The classes that are meant, each with its layer. Empty ones are told by the caller.
std::vector<Known> choose_classes(const fs::path& path, const LabelChoice& choice,
                                  const VolumeHeader& told, const std::vector<Image>& layers,
                                  Complaints& wrong) {
  const std::vector<Known> known = known_classes(told, choice);
  std::vector<Known> chosen;
  if (!choice.values.empty()) {
    for (std::size_t k = 0; k < choice.values.size(); ++k) {
      chosen.push_back(chosen_by_value(path, choice, k, known, layers.size(), wrong));
    }
    return chosen;
  }
  for (std::size_t k = 0; k < choice.names.size(); ++k) {
    const auto is_it = [&](const Known& one) { return one.name == choice.names[k]; };
    const auto count = std::count_if(known.begin(), known.end(), is_it);
    if (count == 1) {
      chosen.push_back(*std::find_if(known.begin(), known.end(), is_it));
      chosen.back().choice = k;
      continue;
    }
    wrong.add(path.string() + ": " + key_of("names", k) + " is \"" + choice.names[k] + "\"" +
              (count > 1 ? ", which several of its classes have" : "") +
              ", expected the name of one of its classes: " +
              (known.empty() ? "it tells none (give labels.values, or labels.table with the names; "
                               "it holds the values " +
                                   values_text(layers) + ")"
                             : quoted_list(names_of(known))));
  }
  if (!choice.names.empty()) return chosen;
  const std::vector<int> values = layers.size() == 1 ? values_in(layers.front()) : std::vector{0};
  if (values.size() == 1 && values.front() != 0) {
    LabelChoice only = choice;
    only.values = values;
    return {chosen_by_value(path, only, 0, known, 1, wrong)};
  }
  wrong.add(path.string() + ": labels.names is missing, expected " +
            (known.empty() ? "labels.values: some of " + values_text(layers)
                           : "some of its classes: " + quoted_list(names_of(known))) +
            " (name those that are arteries)");
  return {};
}

/// Equal voxel by voxel: the first voxel and the end of every axis.
bool are_same_voxels(const Grid& a, const Grid& b) {
  if (a.size != b.size) return false;
  const double most = 0.2 * b.spacing.minCoeff();
  for (int axis = -1; axis < 3; ++axis) {
    Vec3 ijk = Vec3::Zero();
    if (axis >= 0) ijk[axis] = a.size[static_cast<std::size_t>(axis)] - 1;
    if ((a.lps_from_ijk(ijk) - b.lps_from_ijk(ijk)).norm() >= most) return false;
  }
  return true;
}

/// Puts classes into one volume, one after the other.
class Merger {
 public:
  Merger(LabelVolume& volume, const Grid* onto) : volume_(volume), onto_(onto) {}

  /// A mask or several classes of one file, 0 or 1 + their index, which do not overlap.
  void add(const fs::path& path, const Grid& grid, std::vector<std::uint8_t> classes) {
    if (volume_.class_of.empty()) {
      volume_.grid = onto_ ? *onto_ : grid;
      volume_.class_of.assign(volume_.grid.voxels(), 0);
    }
    const auto before = static_cast<std::size_t>(
        std::count_if(classes.begin(), classes.end(), [](auto one) { return one != 0; }));
    if (!are_same_voxels(grid, volume_.grid)) classes = moved(path, grid, classes, before);
    for (std::size_t n = 0; n < classes.size(); ++n) put(n, classes[n]);
  }

  void finish() {
    for (LabelClass& one : volume_.classes) one.voxels = 0;
    for (const std::uint8_t one : volume_.class_of) {
      if (one != 0) ++volume_.classes[one - 1U].voxels;
    }
    for (std::size_t k = 0; k < volume_.classes.size(); ++k) {
      if (volume_.classes[k].voxels == 0) volume_.classes[k].lost = why_lost(k);
    }
  }

 private:
  std::string why_lost(std::size_t k) const {
    std::vector<std::string> over;
    for (const LabelOverlap& both : volume_.overlaps) {
      if (both.second == k) over.push_back("\"" + volume_.classes[both.first].name + "\"");
    }
    const std::string name = "\"" + volume_.classes[k].name + "\"";
    if (over.empty()) return "nothing of " + name + " is left on the volume's grid";
    return "nothing of " + name + " is left: " + quoted_list(over) +
           (over.size() > 1 ? " cover" : " covers") +
           " all of it, and what two classes hold counts as the first's; list " + name +
           " before in the case's labels";
  }

  void put(std::size_t n, std::uint8_t one) {
    if (one == 0) return;
    std::uint8_t& place = volume_.class_of[n];
    if (place == 0) {
      place = one;
      return;
    }
    const std::size_t first = std::min(place, one) - 1U, second = std::max(place, one) - 1U;
    place = std::min(place, one);
    auto& all = volume_.overlaps;
    auto found = std::find_if(all.begin(), all.end(), [&](const LabelOverlap& other) {
      return other.first == first && other.second == second;
    });
    if (found == all.end()) found = all.insert(all.end(), {first, second, 0});
    ++found->voxels;
  }

  std::vector<std::uint8_t> moved(const fs::path& path, const Grid& from,
                                  const std::vector<std::uint8_t>& classes, std::size_t before) {
    const Grid& to = volume_.grid;
    const std::string whose = onto_ ? "the volume's" : "that of the first class";
    if (const std::optional<FrameChange> change = find_contradiction(from, to)) {
      throw Error(path.string() + ": its grid is " + whose +
                  " in size and spacing, but lies elsewhere, expected the same place (" +
                  "it would fit " + describe_change(*change) +
                  "; mend the header of the labels, or give them as they were exported with this "
                  "volume)");
    }
    std::vector<std::uint8_t> result = onto_grid(to, from, classes);
    const auto after = static_cast<std::size_t>(
        std::count_if(result.begin(), result.end(), [](auto one) { return one != 0; }));
    const double volume_before = static_cast<double>(before) * from.spacing.prod(),
                 volume_after = static_cast<double>(after) * to.spacing.prod();
    if (after == 0 && before > 0) {
      throw Error(path.string() + ": no labelled voxel lies on " + whose +
                  " grid, which spans other places; expected labels of this volume (check which "
                  "volume they were drawn in, and its frame)");
    }
    constexpr double kLost = 0.02;
    const bool aligned = shares_lattice(from, to);
    if (!aligned || volume_after < (1.0 - kLost) * volume_before) {
      const auto spacing = [](const Grid& grid) {
        return number_text(grid.spacing[0]) + " x " + number_text(grid.spacing[1]) + " x " +
               number_text(grid.spacing[2]) + " mm";
      };
      volume_.resampled.push_back(path.filename().string() +
                                  (aligned ? " is cut to " : " is resampled to ") + whose +
                                  " grid, from voxels of " + spacing(from) + " to " + spacing(to) +
                                  ": " + number_text(volume_before / 1000.0) + " cm3 become " +
                                  number_text(volume_after / 1000.0) + " cm3");
    }
    return result;
  }

  LabelVolume& volume_;
  const Grid* onto_;
};

void require_few(std::size_t classes, const fs::path& path) {
  if (classes <= kMostClasses) return;
  throw Error(path.string() + ": labels.names has " + std::to_string(classes) +
              " classes, expected at most " + std::to_string(kMostClasses) +
              " (choose the arteries alone)");
}

/// Tells chosen classes that no voxel has.
void require_voxels(const fs::path& path, const LabelChoice& choice,
                    const std::vector<Image>& layers, const std::vector<Known>& chosen,
                    Complaints& wrong) {
  const bool by_value = !choice.values.empty();
  for (const Known& one : chosen) {
    if (one.layer >= layers.size()) {
      wrong.add(path.string() + ": segment \"" + one.name + "\" lies in layer " +
                std::to_string(one.layer) + ", but the file has " + std::to_string(layers.size()) +
                " (export the segmentation again)");
      continue;
    }
    const std::vector<float>& values = layers[one.layer].values;
    if (std::find(values.begin(), values.end(), static_cast<float>(one.value)) != values.end()) {
      continue;
    }
    wrong.add(path.string() + ": " + key_of(by_value ? "values" : "names", one.choice) + " is " +
              (by_value ? std::to_string(one.value) : "\"" + one.name + "\"") +
              ", a class without any voxel, expected one that holds some (delete it; the values " +
              "that occur are " + values_text(layers) + ")");
  }
}

void read_one_file(const fs::path& path, const LabelChoice& choice, const Grid* onto,
                   LabelVolume& volume) {
  VolumeHeader told;
  const std::vector<Image> layers = read_checked(path, told);
  Complaints wrong;
  const std::vector<Known> chosen = choose_classes(path, choice, told, layers, wrong);
  require_few(chosen.size(), path);
  require_voxels(path, choice, layers, chosen, wrong);
  wrong.throw_if_any();
  add_once(layers.front().remarks, volume.remarks);
  for (const Known& one : chosen) volume.classes.push_back({.name = one.name, .value = one.value});
  Merger merger(volume, onto);
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const Image& layer = layers[l];
    std::vector<std::uint8_t> classes(layer.values.size(), 0);
    for (std::size_t c = 0; c < chosen.size(); ++c) {
      if (chosen[c].layer != l) continue;
      const auto value = static_cast<float>(chosen[c].value);
      for (std::size_t n = 0; n < classes.size(); ++n) {
        if (layer.values[n] == value) classes[n] = static_cast<std::uint8_t>(c + 1);
      }
    }
    merger.add(path, layer.grid, std::move(classes));
  }
  merger.finish();
}

/// The name of a class by its file; empty where it is no volume.
std::string class_name(const fs::path& file) {
  const std::string name = file.filename().string(), small = lower_case(name);
  for (const char* ending : {".nii.gz", ".nii", ".seg.nrrd", ".nrrd", ".nhdr", ".mha", ".mhd"}) {
    const std::string end = ending;
    if (small.ends_with(end) && small.size() > end.size())
      return name.substr(0, name.size() - end.size());
  }
  return {};
}

void read_class_file(const fs::path& file, std::size_t index, const std::string& name,
                     Merger& merger, LabelVolume& volume) {
  VolumeHeader told;
  const std::vector<Image> layers = read_checked(file, told);
  const std::vector<int> values =
      layers.size() == 1 ? values_in(layers.front()) : std::vector<int>{};
  if (layers.size() > 1 || values.size() > 1) {
    throw Error(file.string() + ": " + key_of("names", index) + " is \"" + name +
                "\", whose file holds the values " + values_text(layers) +
                ", expected one class per file of a folder (give the file itself as labels.path)");
  }
  if (values.empty()) {
    throw Error(file.string() + ": " + key_of("names", index) + " is \"" + name +
                "\", a class without any voxel, expected one that holds some (delete it from "
                "labels.names)");
  }
  const Image& layer = layers.front();
  add_once(layer.remarks, volume.remarks);
  std::vector<std::uint8_t> mask(layer.values.size(), 0);
  std::transform(layer.values.begin(), layer.values.end(), mask.begin(), [&](float value) {
    return value != 0.0F ? static_cast<std::uint8_t>(index + 1) : std::uint8_t{0};
  });
  volume.classes[index].value = values.front();
  merger.add(file, layer.grid, std::move(mask));
}

/// The volumes of a folder by the names of their classes.
std::map<std::string, std::vector<fs::path>> find_class_files(const fs::path& folder) {
  std::map<std::string, std::vector<fs::path>> files;
  std::string dicom;  // why the first such file is refused
  std::error_code refused;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, refused)) {
    const std::string name = class_name(entry.path());
    std::error_code unknown;
    if (!entry.is_regular_file(unknown)) continue;
    if (!name.empty()) {
      files[name].push_back(entry.path());
    } else if (dicom.empty()) {
      dicom = find_dicom(entry.path());
    }
  }
  if (refused) {
    throw Error(folder.string() + ": cannot be read (" + refused.message() +
                "), expected a folder with one file per class; check its permissions");
  }
  if (files.empty()) {
    throw Error(folder.string() +
                ": holds no volumes, expected one file per class (.nii.gz, .nii, "
                ".nrrd, .mha)" +
                (dicom.empty() ? "" : "; " + dicom));
  }
  return files;
}

void read_folder(const fs::path& folder, const LabelChoice& choice, const Grid* onto,
                 LabelVolume& volume) {
  const std::map<std::string, std::vector<fs::path>> files = find_class_files(folder);
  std::vector<std::string> there;
  for (const auto& [name, paths] : files) there.push_back(name);
  Complaints wrong;
  if (!choice.values.empty()) {
    wrong.add(folder.string() + ": labels.values is given for a folder, expected labels.names: " +
              "its classes are its files (" + quoted_list(there) + ")");
  } else if (choice.names.empty()) {
    wrong.add(folder.string() + ": labels.names is missing, expected some of its classes: " +
              quoted_list(there) + " (name those that are arteries)");
  }
  std::vector<std::size_t> single;  // of the names, those that one file has
  for (std::size_t k = 0; k < choice.names.size() && choice.values.empty(); ++k) {
    const auto found = files.find(choice.names[k]);
    if (found != files.end() && found->second.size() == 1) {
      single.push_back(k);
      continue;
    }
    wrong.add(folder.string() + ": " + key_of("names", k) + " is \"" + choice.names[k] + "\"" +
              (found != files.end() ? ", of which there are several files" : "") +
              ", expected one file of that name: " + quoted_list(there));
  }
  require_few(choice.names.size(), folder);
  Merger merger(volume, onto);
  for (const std::string& name : choice.names) volume.classes.push_back({name});
  for (const std::size_t k : single) {
    try {
      read_class_file(files.at(choice.names[k]).front(), k, choice.names[k], merger, volume);
    } catch (const DiskError&) {
      throw;
    } catch (const Error& error) {
      wrong.add(error.what());
    }
  }
  wrong.throw_if_any();
  merger.finish();
}

/// The classes of a file: those that it or `table` names, and other values that occur.
LabelListing list_file(const fs::path& path, const std::map<int, std::string>& table) {
  VolumeHeader told;
  const std::vector<Image> layers = read_checked(path, told);
  const std::vector<Known> known = known_classes(told, {.table = table});
  LabelListing listing{.classes = {}, .remarks = layers.front().remarks};
  for (std::size_t l = 0; l < layers.size(); ++l) {
    std::map<int, std::size_t> counts = count_labels(layers[l]);
    std::map<int, std::string> names;
    for (const Known& one : known) {
      if (one.layer != l) continue;
      names[one.value] = one.name;
      if (!told.segments.empty()) counts.try_emplace(one.value, 0);
    }
    const double voxel = layers[l].grid.spacing.prod();
    for (const auto& [value, count] : counts) {
      listing.classes.push_back({names.contains(value) ? names.at(value) : "", value,
                                 static_cast<int>(l), count, voxel * static_cast<double>(count)});
    }
  }
  return listing;
}

}  // namespace

LabelListing list_labels(const fs::path& path, const std::map<int, std::string>& table) {
  if (!fs::is_directory(path)) return list_file(path, table);
  LabelListing listing;
  for (const auto& [name, files] : find_class_files(path)) {
    try {
      auto [classes, remarks, others] = list_file(files.front(), {});
      if (classes.empty()) classes.emplace_back();
      if (classes.size() > 1 || files.size() > 1) throw Error(name + ": no single class");
      classes.front().name = name;
      listing.classes.push_back(classes.front());
      add_once(remarks, listing.remarks);
    } catch (const DiskError&) {
      throw;
    } catch (const Error&) {
      ++listing.others;
    }
  }
  return listing;
}

LabelVolume read_labels(const fs::path& path, const LabelChoice& choice, const Grid* onto) {
  expects(choice.values.empty() || choice.names.empty() ||
          choice.values.size() == choice.names.size());
  LabelVolume volume;
  if (fs::is_directory(path)) {
    read_folder(path, choice, onto, volume);
  } else {
    read_one_file(path, choice, onto, volume);
  }
  return volume;
}

}  // namespace wireplan::preprocess
