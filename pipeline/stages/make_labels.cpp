// The stage segment of a case that enters at labels: they become the mask.
#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/files/text.h"
#include "pipeline/stages/makers.h"
#include "pipeline/stages/mask_checks.h"
#include "pipeline/stages/mask_look.h"
#include "preprocess/segment/label_growth.h"
#include "preprocess/segment/label_mask.h"
#include "preprocess/segment/segment.h"
#include "preprocess/volume/label_frame.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kMm3PerMl = 1000.0;
constexpr double kKnownTo = 0.5;  // of a voxel: how well labels know where the wall is

std::string shown_place(const Vec3& p) { return place_text(p) + " mm"; }

double voxel_side(const preprocess::Grid& grid) { return std::cbrt(grid.spacing.prod()); }

/// Refuses labels whose edges the volume shows elsewhere, all of them or a class of them; tells
/// where it shows none.
void compare_with_volume(const Case& given, const preprocess::Image& image,
                         const preprocess::LabelVolume& labels, Json& figures) {
  constexpr double kHardlySeen = 30.0;
  const std::size_t classes = labels.classes.size();
  for (std::size_t one = 0; one <= (classes > 1 ? classes : 0); ++one) {  // 0: all together
    double contrast = 0.0;
    const std::optional<preprocess::FrameChange> better = preprocess::find_better_frame(
        image, labels.class_of, contrast, static_cast<std::uint8_t>(one));
    if (one == 0) figures["edge_contrast_hu"] = contrast;
    const std::string whose =
        one == 0 ? "the labels' edges" : "the edges of " + labels.classes[one - 1].name;
    if (better) {
      throw Error(
          given.labels->path.string() + ": the volume does not show " + whose +
          " where they lie (a mean step of " + format("%.0f", contrast) + " HU), but does with " +
          (one == 0 ? "the labels" : "it") +
          " moved, expected labels in the volume's frame (they would fit " +
          preprocess::describe_change(*better) +
          (better->linear.isIdentity() ? ", but for what runs along a straight vessel" : "") +
          "; export them again with this volume, or mend their header)");
    }
    if (contrast < kHardlySeen) {
      figures["warnings"].push_back("segment: the volume hardly shows " + whose +
                                    " (a mean step of " + format("%.0f", contrast) +
                                    " HU inward): are they of this volume, and is there contrast "
                                    "in the arteries? Look at the "
                                    "slices");
      if (one == 0) return;  // so will it of each
    }
  }
  const auto near = preprocess::find_near_shift(image, labels.class_of);
  if (!near) return;
  figures["warnings"].push_back(
      "segment: the volume shows the labels' edges more clearly with the labels " +
      preprocess::describe_change(*near) +
      ": were they exported with this volume, and is the place in their header rounded or that of "
      "another crop? Look at the slices");
}

void tell_labels(const preprocess::LabelVolume& labels, const preprocess::LabelMask& made,
                 Json& figures) {
  const double voxel = labels.grid.spacing.prod();
  const auto name = [&](std::size_t k) { return labels.classes.at(k).name; };
  const auto tell = [&](const std::string& line) { figures["warnings"].push_back(line); };
  figures["classes"] = Json::array();
  for (const preprocess::LabelClass& one : labels.classes) {
    figures["classes"].push_back(
        {{"name", one.name},
         {"value", one.value},
         {"voxels", one.voxels},
         {"volume_ml", voxel / kMm3PerMl * static_cast<double>(one.voxels)}});
  }
  for (const std::string& line : labels.remarks) tell("segment: labels: " + line);
  for (const std::string& line : labels.resampled) tell("segment: " + line);
  figures["overlaps"] = Json::array();
  for (const preprocess::LabelOverlap& both : labels.overlaps) {
    figures["overlaps"].push_back(
        {{"first", name(both.first)}, {"second", name(both.second)}, {"voxels", both.voxels}});
    tell("segment: labels " + name(both.first) + " and " + name(both.second) + " overlap in " +
         std::to_string(both.voxels) + " voxels, which count as " + name(both.first));
  }
  figures["bridges"] = Json::array();
  for (const preprocess::Bridge& bridge : made.bridges) {
    figures["bridges"].push_back({{"from", name(bridge.from)},
                                  {"to", name(bridge.to)},
                                  {"place_mm", to_json(bridge.place)},
                                  {"length_mm", bridge.length_mm},
                                  {"radius_mm", bridge.radius_mm}});
    tell("segment: bridged a gap of " + format("%.1f", bridge.length_mm) +
         " mm (between the nearest voxels' faces) between " + name(bridge.from) + " and " +
         name(bridge.to) + " at " + shown_place(bridge.place) + ", " +
         format("%.1f", bridge.radius_mm) + " mm in radius; look whether the vessel goes on there");
  }
  for (const preprocess::LabelClass& one : labels.classes) {
    if (!one.lost.empty()) tell("segment: " + one.lost);
  }
  figures["left_out"] = Json::array();
  constexpr std::size_t kMostTold = 5;
  for (const preprocess::LostPiece& piece : made.lost) {
    figures["left_out"].push_back({{"of", name(piece.of)},
                                   {"place_mm", to_json(piece.place)},
                                   {"gap_mm", piece.gap_mm},
                                   {"volume_mm3", piece.volume_mm3}});
    if (figures["left_out"].size() > kMostTold) continue;
    tell("segment: a piece of " + name(piece.of) + ", " +
         format("%.2g", piece.volume_mm3 / kMm3PerMl) + " ml at " + shown_place(piece.place) +
         ", is left out: " + format("%.1f", piece.gap_mm) +
         " mm part its nearest voxels from the rest, and only gaps below 5 mm are bridged");
  }
  figures["left_out_specks_mm3"] = made.lost_specks_mm3;
}

/// Arteries to accesses and targets that the labels lack, from the volume.
void grow_to_points(const Case& given, const preprocess::Image& image,
                    const preprocess::LabelVolume& labels, preprocess::LabelMask& made,
                    Json& figures) {
  std::string problems;
  figures["grown"] = Json::array();
  for (const auto& [key, point] : end_points(given)) {
    if (preprocess::compute_distance(made.mask, point) <= reach_beside(labels.grid)) continue;
    if (!image.modality.empty() && image.modality != "CT") continue;  // is told to lie outside
    try {
      const preprocess::Growth growth = preprocess::grow_to(image, point, made, given.mask_limits);
      const std::string& name = labels.classes.at(growth.from).name;
      figures["grown"].push_back({{"toward", key},
                                  {"from", name},
                                  {"start_mm", to_json(growth.start)},
                                  {"length_mm", growth.length_mm},
                                  {"radius_mm", growth.radius_mm},
                                  {"volume_mm3", growth.volume_mm3}});
      figures["warnings"].push_back(
          "segment: " + key + " lies beyond the labels: " + name +
          " was grown from the volume by " + format("%.1f", growth.length_mm) + " mm (" +
          format("%.2g", growth.volume_mm3 / kMm3PerMl) + " ml, at the least " +
          format("%.1f", growth.radius_mm) + " mm in radius) from " + shown_place(growth.start) +
          " on; look at it in the slices");
    } catch (const DiskError&) {
      throw;
    } catch (const Error& error) {
      problems += (problems.empty() ? "" : "\n") + key + " is " + to_json(point).dump() +
                  ", outside the labels, and no artery leads there from them in the volume, "
                  "expected a point in an artery (" +
                  error.what() + ")";
    }
  }
  if (!problems.empty()) throw Error(problems);
}

/// Every access and target must lie in the mask, or so near that the surface may hold it; all that
/// do not are told, each with what is nearest.
void require_points_inside(const Case& given, const preprocess::LabelVolume& labels,
                           const preprocess::LabelMask& made) {
  const double reach = reach_beside(labels.grid);
  std::string problems;
  for (const auto& [key, point] : end_points(given)) {
    const double distance = preprocess::compute_distance(made.mask, point);
    if (distance <= reach) continue;
    std::string why =
        "give a point inside them, in mm and LPS, or choose the class that it lies in";
    for (const preprocess::LostPiece& piece : made.lost) {
      const preprocess::LabelClass& of = labels.classes.at(piece.of);
      const auto voxel = preprocess::nearest_voxel(labels.grid, point);
      if (!voxel) break;
      if (labels.class_of[preprocess::index_of(labels.grid, *voxel)] != piece.of + 1) continue;
      why = "it lies in " + of.name + ", of which a piece is " + format("%.1f", piece.gap_mm) +
            " mm from the rest at " + shown_place(piece.place) +
            ": draw what is missing between them, or take another point";
      break;
    }
    problems += (problems.empty() ? "" : "\n") + key + " is " + to_json(point).dump() + ", " +
                format("%.1f", distance) + " mm outside the labels, expected a point inside (" +
                why + ")";
  }
  if (!problems.empty()) throw Error(problems);
}

/// Refuses a mask that is too complicated for a vessel, and tells where the way leads through a
/// touch.
void look_at_shape(const Case& given, const preprocess::Mask& mask, Json& figures) {
  using preprocess::Voxel;
  const auto first = std::find(mask.labels.begin(), mask.labels.end(), 1);
  expects(first != mask.labels.end());
  const Voxel seed =
      preprocess::voxel_at(mask.grid, static_cast<std::size_t>(first - mask.labels.begin()));
  const preprocess::Box box = preprocess::grown(
      preprocess::bounding_box(mask.grid, mask.labels, {seed, seed}), Voxel{1, 1, 1}, mask.grid);
  const preprocess::Mask part{.grid = preprocess::cropped(mask.grid, box),
                              .labels = preprocess::crop_values(mask.grid, box, mask.labels)};
  const preprocess::MaskShape shape = preprocess::measure_shape(part.grid, part.labels);
  add_shape(shape, figures);
  preprocess::require_simple(shape, given.mask_limits, preprocess::MaskBy::kLabels);
  std::vector<std::size_t> ends;
  std::vector<Vec3> points;
  for (const auto& [key, point] : end_points(given)) {
    ends.push_back(preprocess::nearest_label(part.grid, part.labels, point).voxel);
    points.push_back(point);
  }
  add_touches(given, preprocess::find_touches(part.grid, part.labels, ends, points), 0, figures);
}

/// Means of the volume inside the mask, and on both sides of its edge [HU].
void tell_values(const preprocess::Image& image, const preprocess::Mask& mask, Json& figures) {
  double sum = 0.0, count = 0.0, edge = 0.0, faces = 0.0;
  for (std::size_t n = 0; n < mask.labels.size(); ++n) {
    if (mask.labels[n] == 0) continue;
    const auto value = static_cast<double>(image.values[n]);
    sum += value;
    count += 1.0;
    preprocess::for_each_face_neighbour(mask.grid, n, [&](std::size_t m) {
      if (mask.labels[m] != 0) return;
      edge += 0.5 * (value + static_cast<double>(image.values[m]));
      faces += 1.0;
    });
  }
  figures["mean_hu"] = sum / count;
  figures["edge_hu"] = faces > 0.0 ? edge / faces : sum / count;
}

/// The case's labels as one piece, with all that is to be told of them.
struct LabelledLumen {
  preprocess::LabelVolume labels;
  preprocess::LabelMask made;
  Json figures;
};

LabelledLumen find_lumen(const Case& given, const preprocess::Image* image) {
  LabelledLumen lumen{
      .labels = read_labels(*given.labels, image != nullptr ? &image->grid : nullptr),
      .made = {},
      .figures = figures_of("segment")};
  Json& figures = lumen.figures;
  if (image != nullptr) compare_with_volume(given, *image, lumen.labels, figures);
  lumen.made =
      preprocess::merge_labels(lumen.labels, preprocess::kMostGap, given.mask_limits.pieces());
  tell_labels(lumen.labels, lumen.made, figures);
  if (image != nullptr) grow_to_points(given, *image, lumen.labels, lumen.made, figures);
  require_points_inside(given, lumen.labels, lumen.made);
  require_ends_in_one_piece(given, lumen.made.mask, figures);
  look_at_shape(given, lumen.made.mask, figures);
  const preprocess::Grid& grid = lumen.labels.grid;
  figures["volume_mm3"] = lumen.made.volume_mm3;
  figures["touches_border"] = lumen.made.touches_border;
  if (image != nullptr) {
    tell_values(*image, lumen.made.mask, figures);
  } else {
    const double error = kKnownTo * voxel_side(grid);
    figures["spacing_mm"] = to_json(grid.spacing);
    figures["radius_error_mm"] = error;
    figures["warnings"].push_back(
        "segment: without a volume the wall is known to half a voxel: every radius may be " +
        format("%.2g", error) +
        " mm more or less; the disturbances draw of it as far as the thinnest wire allows "
        "(robustness.lumen_mm states another)");
  }
  if (lumen.made.touches_border) {
    figures["warnings"].push_back(
        "segment: the vessel touches the border of the volume and is closed there by a flat cap");
  }
  return lumen;
}

/// Where on a branch its parent's lumen ends, about.
double start_of_own(const std::vector<preprocess::Branch>& tree, std::size_t k) {
  if (tree[k].parent < 0) return 0.0;
  const Centerline& parent = tree[static_cast<std::size_t>(tree[k].parent)].line;
  Eigen::Index nearest = 0;
  (parent.arc_length.array() - tree[k].parent_arc).abs().minCoeff(&nearest);
  return std::min(1.2 * parent.radius(nearest), 0.8 * tree[k].line.arc_length.tail<1>().value());
}

/// What a class is called in a sentence: "left common carotid artery" of
/// "common_carotid_artery_left".
std::string words_of_class(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  for (const std::string side : {"left", "right"}) {
    const std::string end = " " + side;
    if (!name.ends_with(end)) continue;
    name.erase(name.size() - end.size());
    name.insert(0, side + " ");
  }
  return name;
}

/// The classes that a line runs through beyond `from`, in order, each for 5 mm or a fifth of it.
std::vector<preprocess::NamedPart> classes_along(const preprocess::Image& classes,
                                                 const Json& names, const Centerline& line,
                                                 double from) {
  constexpr double kLeastMm = 5.0, kLeastPart = 0.2;
  struct Run {
    std::size_t value = 0;
    double from = 0.0, length = 0.0;
  };
  std::vector<Run> runs;
  double all = 0.0;
  for (Eigen::Index k = 1; k < line.arc_length.size(); ++k) {
    if (line.arc_length(k) < from) continue;
    const double step = line.arc_length(k) - line.arc_length(k - 1);
    all += step;
    const auto voxel = preprocess::nearest_voxel(classes.grid, line.points.col(k));
    const auto value =
        voxel ? static_cast<std::size_t>(classes.values[preprocess::index_of(classes.grid, *voxel)])
              : 0;
    if (value == 0) continue;
    if (runs.empty() || runs.back().value != value) runs.push_back({value, line.arc_length(k)});
    runs.back().length += step;
  }
  std::erase_if(runs,
                [&](const Run& r) { return r.length < std::min(kLeastMm, kLeastPart * all); });
  std::vector<preprocess::NamedPart> parts;
  for (const Run& run : runs) {
    const std::string name = words_of_class(names.at(run.value - 1).at("name").get<std::string>());
    if (!parts.empty() && parts.back().name == name) continue;
    parts.push_back({parts.empty() ? 0.0 : run.from, name});
  }
  return parts;
}

}  // namespace

void name_branches(const Workspace& work, std::vector<preprocess::Branch>& tree) {
  if (!work.given().labels) return;
  const preprocess::Image classes =
      preprocess::read_image(work.artifact("segment").folder / "classes.nrrd");
  const Json told = work.figures("segment").at("classes");
  for (std::size_t k = 0; k < tree.size(); ++k) {
    tree[k].parts = classes_along(classes, told, tree[k].line, start_of_own(tree, k));
  }
}

std::vector<std::string> check_labels(const Case& given, const preprocess::Image* image) {
  return find_lumen(given, image).figures.at("warnings").get<std::vector<std::string>>();
}

void make_labels(Workspace& work, const fs::path& folder) {
  const LabelledLumen lumen =
      find_lumen(work.given(), work.given().volume ? &work.image() : nullptr);
  const auto& [labels, made, figures] = lumen;
  preprocess::write_mask(made.mask, folder / "mask.nrrd");
  preprocess::write_image(
      {.grid = labels.grid, .values = {made.class_of.begin(), made.class_of.end()}},
      folder / "classes.nrrd");
  if (work.given().volume) {
    write_mask_look(work.given(), work.image(), made.mask, figures, folder);
  }
  write_figures(figures, folder);
}

}  // namespace wireplan::pipeline
