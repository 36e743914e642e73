#include "preprocess/volume/dicom_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sstream>
#include <utility>

#include "preprocess/volume/dicom_stack.h"
#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLeastOfVolume = 5, kMostOfLocalizer = 3;  // images

/// True where two images can be slices of one volume.
bool same_series(const Slice& a, const Slice& b) {
  return a.series_uid == b.series_uid && a.grid.size == b.grid.size &&
         a.grid.spacing.head<2>().isApprox(b.grid.spacing.head<2>(), 1e-3) &&
         (a.grid.direction - b.grid.direction).cwiseAbs().maxCoeff() < 1e-3;
}

std::size_t images_of(const Series& series) {
  std::size_t count = 0;
  for (const Slice& slice : series) count += static_cast<std::size_t>(slice.grid.size[2]);
  return count;
}

/// Not a scout of few images, nor images of few places, as of contrast tracking. Slices that lie
/// unevenly, or twice, have it: one may have been lost, or copied, of the very series that is
/// meant.
bool has_volume_shape(const Series& series) {
  if (images_of(series) < kLeastOfVolume) return false;
  if (series.front().grid.size[2] > 1) return true;
  const auto refused = static_cast<std::size_t>(std::count_if(
      series.begin(), series.end(), [](const Slice& slice) { return !slice.refused.empty(); }));
  if (refused > 0 && refused < series.size()) return true;  // and is told why it is none
  return stack(origins_of(series), series.front().grid).places >= kLeastOfVolume;
}

/// Clearly made to place the others: two of few images, of another orientation, and said to be one.
bool is_localizer(const Series& part, const Series& main) {
  constexpr double kAcross = 0.5;  // cosine of 60 degrees
  const bool across =
      std::abs(part.front().grid.direction.col(2).dot(main.front().grid.direction.col(2))) <
      kAcross;
  const bool few = images_of(part) <= kMostOfLocalizer;
  return (few ? 1 : 0) + (across ? 1 : 0) + (part.front().localizer ? 1 : 0) >= 2;
}

/// Of each series UID the images that are most.
bool is_main(const Series& series, const std::vector<Series>& all) {
  for (const Series& other : all) {
    if (&other == &series || other.front().series_uid != series.front().series_uid) continue;
    const std::size_t mine = images_of(series), its = images_of(other);
    if (its > mine || (its == mine && &other < &series)) return false;
  }
  return true;
}

std::string shown(double value) {
  std::ostringstream text;
  text << std::round(value * 1e4) / 1e4 + 0.0;
  return text.str();
}

/// Rows and columns of an image as they run.
std::string shown_axes(const Grid& grid) {
  std::string text;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      text += (axis + k == 0 ? "" : "\\") + shown(grid.direction(k, axis));
    }
  }
  return text;
}

std::string shown_size(const Grid& grid) {
  return std::to_string(grid.size[0]) + " x " + std::to_string(grid.size[1]) + " pixels";
}

/// In what two parts of one series differ, as the first and the second have it.
std::pair<std::string, std::string> differing(const Grid& a, const Grid& b) {
  std::string of_a, of_b;
  const auto add = [&](const std::string& from_a, const std::string& from_b) {
    of_a += (of_a.empty() ? "" : ", ") + from_a;
    of_b += (of_b.empty() ? "" : ", ") + from_b;
  };
  if (a.size != b.size) add(shown_size(a), shown_size(b));
  if (!a.spacing.head<2>().isApprox(b.spacing.head<2>(), 1e-3)) {
    add("pixels of " + shown_spacing(a) + " mm", "pixels of " + shown_spacing(b) + " mm");
  }
  if ((a.direction - b.direction).cwiseAbs().maxCoeff() >= 1e-3) {
    add("orientation " + shown_axes(a), "orientation " + shown_axes(b));
  }
  return {of_a, of_b};
}

/// The files of a part, the first few by name.
std::string shown_files(const Series& part) {
  constexpr std::size_t kShown = 4;
  std::string text;
  for (std::size_t k = 0; k < std::min(kShown, part.size()); ++k) {
    text += (k == 0 ? "" : ", ") + part[k].file.string();
  }
  if (part.size() > kShown) text += " and " + std::to_string(part.size() - kShown) + " more";
  return text;
}

/// Why files of several frames of one series are not read.
std::string several_enhanced(const std::vector<const Series*>& parts) {
  int files = 0, frames = 0;
  bool alike = true;
  for (const Series* part : parts) {
    const int count = part->front().grid.size[2];
    if (count < 2) continue;
    alike = alike && (files == 0 || count == frames);
    files += static_cast<int>(part->size());
    frames = count;
  }
  if (files < 2) return {};
  return std::to_string(files) + " files of " + (alike ? std::to_string(frames) : "several") +
         " frames each, expected one such file or files of one slice each; export the series as "
         "one file per slice, or put the file to plan on into a folder of its own";
}

/// Whether the number or the description that is shown names this series alone.
bool names_one(const Series& series, const std::vector<Series>& all) {
  const Slice& first = series.front();
  if (first.shown_number.empty() && first.description.empty()) return false;
  return std::none_of(all.begin(), all.end(), [&](const Series& other) {
    const Slice& its = other.front();
    return its.series_uid != first.series_uid && its.shown_number == first.shown_number &&
           its.description == first.description;
  });
}

Error several_series(const fs::path& folder, const std::string& wanted, std::vector<Series> all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Series& a, const Series& b) { return a.size() > b.size(); });
  std::ostringstream text;
  text << folder.string() << ": " << all.size() << kSeveralSeries;
  if (!wanted.empty()) text << " of the number or description \"" << wanted << "\"";
  text << ":";
  for (const Series& series : all) {
    const Slice& first = series.front();
    text << " number " << (first.shown_number.empty() ? "unknown" : first.shown_number);
    if (!first.description.empty()) text << " (" << first.description << ")";
    if (!names_one(series, all)) text << ", \"series\": \"" << key_of(series) << "\",";
    text << " has " << series.size() << (series.size() == 1 ? " image of " : " images of ")
         << shown_size(first.grid);
    if (first.refused.empty()) text << " of " << shown_spacing(first.grid) << " mm";
    if (series.size() > 1) {
      const Stack stacked = stack(origins_of(series), first.grid);
      if (stacked.problem.empty()) text << ", " << stacked.grid.spacing[2] << " mm apart";
      if (!stacked.problem.empty()) text << ", which are no even stack";
    }
    text << ";";
  }
  text << " name the one to plan on by \"series\" in the case's volume, or put it into a folder of "
          "its own";
  return Error(text.str());
}

}  // namespace

void add_slice(Slice slice, std::vector<Series>& all) {
  const auto home = std::find_if(all.begin(), all.end(), [&](const Series& series) {
    return same_series(series.front(), slice);
  });
  if (home == all.end()) {
    all.push_back({std::move(slice)});
  } else {
    home->push_back(std::move(slice));
  }
}

std::vector<Vec3> origins_of(const Series& series) {
  std::vector<Vec3> origins;
  for (const Slice& slice : series) origins.push_back(slice.grid.origin);
  return origins;
}

std::string shown_spacing(const Grid& grid) {
  return shown(grid.spacing[0]) + " x " + shown(grid.spacing[1]);
}

bool is_enhanced(const Series& series) {
  return series.size() == 1 && series.front().grid.size[2] > 1;
}

std::string key_of(const Series& series) {
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : series.front().series_uid) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  }
  std::array<char, 10> text{};
  std::snprintf(text.data(), text.size(), "#%08x", hash);
  return text.data();
}

std::vector<Series>::iterator find_chosen(std::vector<Series>& all, const std::string& wanted) {
  const auto only = [&](const auto& fits) {
    const auto found = std::find_if(all.begin(), all.end(), fits);
    return std::count_if(all.begin(), all.end(), fits) == 1 ? found : all.end();
  };
  const auto is_wanted = [&](const Series& series) {
    const Slice& first = series.front();
    return is_main(series, all) && (wanted.empty() || first.series_number == wanted ||
                                    first.description == wanted || key_of(series) == wanted);
  };
  const auto is_scan = [&](const Series& series) {
    return is_wanted(series) && !series.front().aside;
  };
  auto found = only(is_wanted);
  if (found == all.end()) found = only(is_scan);
  if (found != all.end()) return found;
  found = only([&](const Series& series) { return is_scan(series) && has_volume_shape(series); });
  if (found != all.end()) return found;
  return only([&](const Series& series) { return is_wanted(series) && has_volume_shape(series); });
}

std::string find_mixture(const Series& series, const std::vector<Series>& all) {
  const auto of_same = [&](const Series& other) {
    return other.front().series_uid == series.front().series_uid;
  };
  const auto main = std::find_if(all.begin(), all.end(), [&](const Series& other) {
    return of_same(other) && is_main(other, all);
  });
  if (&*main != &series && is_localizer(series, *main)) return {};
  std::vector<const Series*> parts;  // the main one first
  for (const Series& part : all) {
    if (of_same(part) && &part != &*main && !is_localizer(part, *main)) parts.push_back(&part);
  }
  parts.insert(parts.begin(), &*main);
  if (std::string told = several_enhanced(parts); !told.empty()) return told;
  if (parts.size() < 2) return {};
  const Series& most = *parts[0];
  const Series& few = *parts[1];
  const auto [of_most, of_few] = differing(most.front().grid, few.front().grid);
  return "images of one series that differ: " + std::to_string(most.size()) + " have " + of_most +
         " (" + most.front().file.string() + "), " + std::to_string(few.size()) + " have " +
         of_few + " (" + shown_files(few) +
         "), expected all alike; export the series again with one size, spacing and orientation, "
         "or take out the images that are no slices of the volume";
}

Series choose_series(const fs::path& folder, const std::string& wanted, std::vector<Series> all) {
  if (all.empty()) {
    throw Error(folder.string() +
                ": a folder without DICOM images (folders inside it are not searched); " +
                kFormats);
  }
  const auto found = find_chosen(all, wanted);
  if (found == all.end()) throw several_series(folder, wanted, std::move(all));
  for (const Series& part : all) {
    if (part.front().series_uid != found->front().series_uid) continue;
    if (&part != &*found && is_localizer(part, *found)) continue;
    for (const Slice& slice : part) {
      if (!slice.refused.empty()) throw Error(slice.file.string() + ": " + slice.refused);
    }
  }
  if (const std::string mixture = find_mixture(*found, all); !mixture.empty()) {
    throw Error(folder.string() + ": " + mixture);
  }
  return std::move(*found);
}

}  // namespace wireplan::preprocess
