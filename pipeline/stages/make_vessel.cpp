// The stages from the input to the wall.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pipeline/files/text.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/makers.h"
#include "pipeline/stages/mask_checks.h"
#include "pipeline/stages/mask_look.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/files/vessel_io.h"
#include "preprocess/segment/segment.h"
#include "preprocess/surface/openings.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_handles.h"
#include "preprocess/surface/surface_repair.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// What was cut, in words; the largest leaks only.
std::string leak_warning(const preprocess::Leak& leak) {
  const auto rounded = [](double value) { return Json(std::round(value * 10.0) / 10.0).dump(); };
  const Vec3& at = leak.place;
  return "segment: cut a leak at (" + rounded(at.x()) + ", " + rounded(at.y()) + ", " +
         rounded(at.z()) + ") mm: behind a neck of " + rounded(leak.neck_radius_mm) +
         " mm radius lay " + rounded(leak.volume_mm3 / 1000.0) + " cm3, up to " +
         rounded(leak.radius_mm) + " mm in radius, of " + rounded(leak.mean_hu) +
         " HU in the mean" + (leak.bright_fraction > 0.2 ? ", much of it against bone" : "") +
         "; if that is artery, add a point in it to segmentation.seeds_mm";
}

// What was kept, though it may be another vessel.
std::string doubt_warning(const preprocess::Leak& part) {
  const Vec3& at = part.place;
  return "segment: " + format("%.1f", part.volume_mm3 / 1000.0) + " cm3 round " + place_text(at) +
         " mm, up to " + format("%.1f", part.radius_mm) + " mm in radius and of " +
         format("%.0f", part.mean_hu) +
         " HU in the mean, may be a vein or an organ that touches the artery: look at its outline "
         "there; if it is no artery, give segmentation.lower_hu and upper_hu, or labels";
}

// Where the way may leave its vessel.
std::string way_warning(const preprocess::WayDoubt& doubt) {
  const std::string place = place_text(doubt.place) + " mm";
  if (doubt.by_level) {
    return "segment: the lumen's level changes from " + format("%.0f", doubt.before_hu) + " to " +
           format("%.0f", doubt.after_hu) + " HU within 20 mm of the way at " + place +
           ", which an artery's does not: it may leave the artery for a vein that touches it; look "
           "at the outline there, and whether access and target lie in arteries";
  }
  return "segment: the way narrows to " + format("%.1f", doubt.neck_mm) + " mm in radius at " +
         place + ", between parts of " + format("%.1f", doubt.beside_mm) +
         " mm or more: a stenosis, or another vessel that touches the artery there; look at the "
         "outline, and whether access and target lie in arteries";
}

// Slices in which vessels that pass each other are one.
void add_thick_slices(const preprocess::Grid& grid, Json& figures) {
  constexpr double kThickMm = 2.5;
  const double slice = grid.spacing.maxCoeff();
  if (slice < kThickMm) return;
  figures["warnings"].push_back(
      "segment: the volume's slices are " + format("%.1f", slice) +
      " mm apart: vessels that pass each other within one are not told apart, and the way may take "
      "a shortcut from one to the other; look whether it keeps to the artery, or take slices of 1 "
      "to 2 mm");
}

// The first of loops or handles: "(1.0, 2.0, 3.0) mm (1.2 mm in radius), ... and in other places".
template <typename Loops>
std::string places_of(const Loops& loops) {
  constexpr std::size_t kLoopsTold = 5;
  std::string places;
  for (std::size_t k = 0; k < std::min(loops.size(), kLoopsTold); ++k) {
    places += (k == 0 ? "" : ", ") + place_text(loops[k].place) +
              format(" mm (%.1f mm in radius)", loops[k].radius_mm);
  }
  return places + (loops.size() > kLoopsTold ? " and in other places" : "");
}

template <typename Loops>
Json loops_json(const Loops& loops) {
  Json list = Json::array();
  for (const auto& loop : loops) {
    list.push_back({{"place_mm", to_json(loop.place)}, {"radius_mm", loop.radius_mm}});
  }
  return list;
}

// Loops that were wide enough to be arteries.
std::string loops_warning(const std::vector<preprocess::Loop>& loops) {
  return "segment: the vessel closes to a loop at " + places_of(loops) +
         ": a ring of arteries, or vessels that touch; look at the outline there";
}

std::string handles_warning(int count, const std::vector<preprocess::Handle>& handles) {
  return "surface: it has " + std::to_string(count) + (count == 1 ? " handle" : " handles") +
         ", of arteries that touch or run in a ring, or holes" +
         (handles.empty() ? "" : ", thinnest at " + places_of(handles)) + "; look whether " +
         (count == 1 ? "it is" : "they are") + " real";
}

// Side branches that the levels alone would leave out.
std::string branches_warning(const std::vector<preprocess::Leak>& branches) {
  constexpr std::size_t kBranchesTold = 5;
  std::string places;
  for (std::size_t k = 0; k < std::min(branches.size(), kBranchesTold); ++k) {
    const Vec3& at = branches[k].place;
    places +=
        (k == 0 ? "" : ", ") + place_text(at) +
        format(" mm (%.1f mm in radius, %.0f HU)", branches[k].radius_mm, branches[k].mean_hu);
  }
  return "segment: side branches with less or other contrast than the way were kept, for they end "
         "at it, from " +
         places + (branches.size() > kBranchesTold ? " and in other places" : "") +
         ": arteries that fill late or are thin, or veins that end there; look at the outline";
}

// Figures of the segment stage. What was chosen for the case is told as the report prints it.
void add_segmentation(const preprocess::SegmentStatistics& statistics, bool chosen, Json& figures) {
  constexpr std::size_t kLeaksTold = 5;
  constexpr double kDoubtfulPart = 0.02;  // of the vessel's volume, from which it is told
  const preprocess::Band& band = statistics.band;
  figures["band"] = {{"chosen", chosen},
                     {"lower_hu", band.lower_hu},
                     {"connect_hu", band.connect_hu},
                     {"upper_hu", band.upper_hu},
                     {"smoothing_mm", band.smoothing_mm},
                     {"neck_opening_mm", band.neck_mm}};
  figures["samples"] = Json::array();
  for (const preprocess::LumenSample& sample : statistics.samples) {
    figures["samples"].push_back({{"point_mm", to_json(sample.point)},
                                  {"level_hu", sample.level_hu},
                                  {"noise_hu", sample.noise_hu},
                                  {"voxels", sample.voxels},
                                  {"standard_error_hu", sample.error_hu}});
  }
  figures["along_way"] = Json::array();
  for (const preprocess::LevelAlong& place : statistics.along) {
    figures["along_way"].push_back({{"place_mm", to_json(place.place)},
                                    {"arc_mm", place.arc_mm},
                                    {"level_hu", place.level_hu},
                                    {"contrast_hu", place.level_hu - band.surroundings_hu}});
  }
  figures["volume_mm3"] = statistics.volume_mm3;
  figures["mean_hu"] = statistics.mean_hu;
  figures["removed_by_opening_mm3"] = statistics.removed_by_opening_mm3;
  figures["bright_boundary_fraction"] = statistics.bright_boundary;
  figures["touches_border"] = statistics.touches_border;
  figures["way_length_mm"] = statistics.search.route.length_mm;
  figures["narrowest_radius_mm"] = statistics.search.route.narrowest_radius_mm;
  figures["narrowest_mm"] = to_json(statistics.search.route.narrowest);
  figures["leaks"] = Json::array();
  for (const preprocess::Leak& leak : statistics.search.leaks) {
    figures["leaks"].push_back({{"place_mm", to_json(leak.place)},
                                {"neck_radius_mm", leak.neck_radius_mm},
                                {"radius_mm", leak.radius_mm},
                                {"volume_mm3", leak.volume_mm3},
                                {"mean_hu", leak.mean_hu},
                                {"bright_fraction", leak.bright_fraction}});
    if (figures["leaks"].size() <= kLeaksTold) {
      figures["warnings"].push_back(leak_warning(leak));
    }
  }
  if (chosen) {  // else nobody looked for them: the surface tells its handles
    figures["loops"] = {{"cut", statistics.loops.cut}, {"left", loops_json(statistics.loops.left)}};
  }
  if (!statistics.loops.left.empty()) {
    figures["warnings"].push_back(loops_warning(statistics.loops.left));
  }
  figures["side_branches"] = Json::array();
  for (const preprocess::Leak& branch : statistics.branches) {
    figures["side_branches"].push_back({{"place_mm", to_json(branch.place)},
                                        {"radius_mm", branch.radius_mm},
                                        {"volume_mm3", branch.volume_mm3},
                                        {"mean_hu", branch.mean_hu}});
  }
  if (!statistics.branches.empty()) {
    figures["warnings"].push_back(branches_warning(statistics.branches));
  }
  for (const preprocess::WayDoubt& doubt : statistics.way_doubts) {
    figures["way_doubts"].push_back({{"place_mm", to_json(doubt.place)},
                                     {"by", doubt.by_level ? "level" : "width"},
                                     {"before_hu", doubt.before_hu},
                                     {"after_hu", doubt.after_hu}});
    if (doubt.by_width) {
      figures["way_doubts"].back()["neck_radius_mm"] = doubt.neck_mm;
      figures["way_doubts"].back()["beside_radius_mm"] = doubt.beside_mm;
    }
    figures["warnings"].push_back(way_warning(doubt));
  }
  for (const preprocess::Leak& part : statistics.doubtful) {
    if (part.volume_mm3 < kDoubtfulPart * statistics.volume_mm3) continue;
    figures["warnings"].push_back(doubt_warning(part));
  }
}

// Contrast that is there, but little.
void add_little_contrast(const preprocess::SegmentStatistics& statistics, Json& figures) {
  if (statistics.along.empty()) return;
  const auto darkest =
      std::min_element(statistics.along.begin(), statistics.along.end(),
                       [](const auto& a, const auto& b) { return a.level_hu < b.level_hu; });
  const double contrast = darkest->level_hu - preprocess::kBloodHu;
  if (contrast >= preprocess::kSureContrastHu) return;
  const Vec3& at = darkest->place;
  figures["warnings"].push_back(
      "segment: little contrast: " + format("%.0f", contrast) +
      " HU over blood without contrast at " + place_text(at) +
      " mm, expected 150 or more; look at the outline there, and take the arterial phase if there "
      "is one");
}

// What was mended of a given surface: each place, and in words.
void add_mends(const std::vector<preprocess::Mend>& mends, Json& figures) {
  figures["mended"] = Json::array();
  for (const preprocess::Mend& mend : mends) {
    figures["mended"].push_back({{"what", preprocess::name_of(mend.kind)},
                                 {"count", mend.count},
                                 {"place_mm", to_json(mend.place)},
                                 {"size_mm", mend.size}});
  }
  for (const std::string& line : preprocess::tell_mends(mends)) {
    figures["warnings"].push_back("surface: " + line);
  }
}

// Length and width of a line, as the report has them of a branch.
Json line_figures(const Centerline& line) {
  const Eigen::Index last = line.points.cols() - 1;
  const double length = line.arc_length(last);
  const double distance = (line.points.col(last) - line.points.col(0)).norm();
  return {{"length_mm", length},
          {"mean_diameter_mm", 2.0 * line.radius.mean()},
          {"min_diameter_mm", 2.0 * line.radius.minCoeff()},
          {"max_diameter_mm", 2.0 * line.radius.maxCoeff()},
          {"tortuosity", distance > 0.0 ? Json(length / distance) : Json(nullptr)}};
}

// The whole tree: files for viewers, and a list of its branches.
Json write_tree(const std::vector<preprocess::Branch>& tree, const fs::path& folder) {
  std::vector<Centerline> lines;
  std::vector<NamedCurve> curves;
  Json branches = Json::array();
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const Centerline& line = tree[k].line;
    const std::string name = branch_name(tree, static_cast<int>(k));
    Json parts = Json::array();
    for (const preprocess::NamedPart& part : tree[k].parts) {
      parts.push_back({{"from_mm", part.from}, {"name", part.name}});
    }
    lines.push_back(line);
    curves.push_back({name, line.points});
    Json branch = {
        {"name", name},
        {"parts", std::move(parts)},
        {"parent", tree[k].parent < 0 ? Json(nullptr) : Json(branch_name(tree, tree[k].parent))},
        {"parent_arc_mm", tree[k].parent_arc},
        {"start_mm", to_json(Vec3(line.points.col(0)))},
        {"end_mm", to_json(Vec3(line.points.col(line.points.cols() - 1)))}};
    branch.update(line_figures(line));
    branches.push_back(std::move(branch));
  }
  preprocess::write_centerlines(lines, folder / "tree.vtp");
  write_curve_markups(curves, folder / "tree.mrk.json");
  return branches;
}

fs::path dropped_file(const fs::path& folder) { return folder / kKeptFolder / "dropped.vtp"; }

/// The pieces of a given surface that were dropped, for the stage centerline: a point may lie in
/// one of them.
void write_dropped(const std::vector<Surface>& dropped, const fs::path& folder) {
  if (dropped.empty()) return;
  Surface all;
  for (const Surface& piece : dropped) {
    const Eigen::Index vertices = all.vertices.cols(), triangles = all.triangles.cols();
    all.vertices.conservativeResize(3, vertices + piece.vertices.cols());
    all.vertices.rightCols(piece.vertices.cols()) = piece.vertices;
    all.triangles.conservativeResize(3, triangles + piece.triangles.cols());
    all.triangles.rightCols(piece.triangles.cols()) =
        piece.triangles.array() + static_cast<int>(vertices);
  }
  fs::create_directories(folder / kKeptFolder);
  preprocess::write_surface(all, dropped_file(folder));
}

std::vector<Surface> read_dropped(const fs::path& folder) {
  std::vector<Surface> dropped;
  if (!fs::exists(dropped_file(folder))) return dropped;
  for (preprocess::Piece& piece :
       preprocess::pieces_of(preprocess::read_surface_artifact(dropped_file(folder)))) {
    dropped.push_back(std::move(piece.surface));
  }
  return dropped;
}

constexpr const char* kWaysFile = "ways.vtp";  // found by the levels of a volume

/// Of the ways that the segmentation found that between these points; none where the access is not
/// the one that they start from.
std::vector<Vec3> known_way(const Workspace& work, const Vec3& access, const Vec3& target) {
  constexpr double kNear = 10.0;  // to the middle of the lumen that a point was moved to    [mm]
  std::vector<Vec3> known;
  if (!work.has("segment")) return known;
  const fs::path file = work.artifact("segment").folder / kWaysFile;
  if (!fs::exists(file)) return known;
  double least = 2.0 * kNear;
  for (const Centerline& way : preprocess::read_centerlines(file)) {
    const double off =
        (way.points.leftCols<1>() - access).norm() + (way.points.rightCols<1>() - target).norm();
    if (off >= least) continue;
    least = off;
    known.clear();
    for (const Vec3& p : way.points.colwise()) known.push_back(p);
  }
  return known;
}

/// Refuses the section's access and target outside the vessel, by their keys, both at once.
void require_inside(const Surface& surface, const fs::path& folder, const Case& given) {
  const std::array<std::pair<std::string, Vec3>, 2> ends = {
      {{access_point_key(given), given.study.access},
       {target_point_key(given), given.study.goal.point}}};
  std::string outside, pieces;
  int found = 0;
  for (const auto& [key, point] : ends) {
    const preprocess::InsideAnswer answer = preprocess::locate_point(surface, point);
    if (answer.inside) continue;
    outside += (found++ > 0 ? "; " : "") + key + " is " + to_json(point).dump() + ", " +
               Json(std::round(answer.distance * 10.0) / 10.0).dump() + " mm outside the vessel";
    const std::string of_piece = preprocess::tell_dropped(read_dropped(folder), surface, point);
    if (!of_piece.empty()) pieces += "; " + key + " " + of_piece;
  }
  if (found == 0) return;
  throw Error(outside + (found > 1 ? "; expected points" : "; expected a point") + " inside it" +
              (pieces.empty() ? "; look at surface.vtp and move what lies outside, or mend the "
                                "segmentation that left its place out"
                              : pieces));
}

/// A way that ends in the lumen's ball round its start has no cross-section of its own there: what
/// would be told of it is that of another direction.
void require_apart(const Case& given, const Surface& surface, const Centerline& way) {
  const plan::Study& study = given.study;
  const bool onward = given.targets[given.target].beyond_mm > 0.0;
  const double length = way.arc_length(way.arc_length.size() - 1), radius = way.radius(0),
               wall = preprocess::locate_point(surface, study.access).distance,
               apart = onward ? length : std::min(length, (study.goal.point - study.access).norm());
  if (length >= radius && (onward || apart >= wall)) return;
  throw Error(target_point_key(given) + " is " + format("%.1f mm", apart) + " from " +
              access_point_key(given) + ", expected more than the lumen's radius there, " +
              format("%.1f mm", std::max(radius, wall)) +
              ": a wire would be there before it is pushed; move one of the two along the vessel");
}

}  // namespace

std::vector<std::string> warn_of_values(const preprocess::Image& image) {
  const std::string follows =
      "no Hounsfield units: bone is not told by its brightness, and calcium is not measured";
  std::vector<std::string> warnings;
  if (!image.modality.empty() && image.modality != "CT") {
    warnings.push_back("volume: its modality is " + image.modality + ", not CT: values are " +
                       follows);
  } else if (!preprocess::in_hounsfield(image)) {
    const auto [least, largest] = std::minmax_element(image.values.begin(), image.values.end());
    warnings.push_back("volume: its file names no modality, and values from " +
                       number_text(static_cast<double>(*least)) + " to " +
                       number_text(static_cast<double>(*largest)) +
                       " are not those of a CT, which has air below zero: taken as " + follows +
                       "; if it is a CT, give it with air, or as DICOM");
  } else if (!image.unit.empty() && image.unit != "HU") {
    warnings.push_back("volume: its values are of rescale type " + image.unit +
                       (image.unit == "US" ? " (unspecified)" : " (modified)") +
                       ", taken as Hounsfield units");
  }
  for (const std::string& remark : image.remarks) warnings.push_back("volume: " + remark);
  return warnings;
}

void make_volume(Workspace& work, const fs::path& folder) {
  const preprocess::Image& image = work.image();
  const preprocess::Grid& grid = image.grid;

  // Statistics of the values, summed in order.
  expects(!image.values.empty());
  double sum = 0.0;
  float low = image.values.front(), high = low;
  for (const float value : image.values) {
    sum += static_cast<double>(value);
    low = std::min(low, value);
    high = std::max(high, value);
  }

  Json figures = figures_of("volume");
  figures["size"] = grid.size;
  figures["spacing_mm"] = to_json(grid.spacing);
  figures["origin_mm"] = to_json(grid.origin);
  figures["direction_ijk_to_lps"] = to_json(Eigen::Matrix3Xd(grid.direction.transpose()));
  figures["min_hu"] = low;
  figures["mean_hu"] = sum / static_cast<double>(image.values.size());
  figures["max_hu"] = high;
  for (const std::string& line : warn_of_values(image)) figures["warnings"].push_back(line);
  write_figures(figures, folder);
}

void make_segment(Workspace& work, const fs::path& folder) {
  preprocess::SegmentOptions options = work.given().segmentation;
  // One vessel for all sections: it holds every access and target.
  const Case& given = work.given();
  options.seeds.insert(options.seeds.begin(), given.accesses.front().point);
  for (std::size_t k = 1; k < given.accesses.size(); ++k) {
    options.seeds.push_back(given.accesses[k].point);
  }
  for (std::size_t k = 1; k < given.targets.size(); ++k) {
    options.seeds.push_back(given.targets[k].point);
  }
  options.target = given.targets.front().point;
  options.limits = given.mask_limits;
  options.hounsfield = preprocess::in_hounsfield(work.image());
  preprocess::Segmentation segmentation = preprocess::segment(work.image(), options);
  preprocess::SegmentStatistics& statistics = segmentation.statistics;
  Json figures = figures_of("segment");
  if (require_ends_in_one_piece(given, segmentation.mask, figures)) {
    measure_mask(work.image(), segmentation.mask, statistics);
    statistics.shape = measure_shape(segmentation.mask.grid, segmentation.mask.labels);
  }
  add_segmentation(statistics, !options.lower_hu.has_value(), figures);
  if (options.hounsfield) add_little_contrast(statistics, figures);
  add_thick_slices(segmentation.mask.grid, figures);
  add_shape(statistics.shape, figures);
  add_touches(given, statistics.touches, statistics.dipping, figures);
  preprocess::write_mask(segmentation.mask, folder / "mask.nrrd");
  preprocess::write_centerlines(statistics.ways, folder / kWaysFile);
  if (statistics.touches_border) {
    figures["warnings"].push_back(
        "segment: the vessel touches the border of the volume and is closed there by a flat cap");
  }
  write_mask_look(given, work.image(), segmentation.mask, figures, folder);
  write_figures(figures, folder);
}

void make_surface(Workspace& work, const fs::path& folder) {
  // From the mask, or from the case's file, mended where that is safe.
  const Case& given = work.given();
  Surface surface;
  std::vector<preprocess::Mend> mends;
  preprocess::FitStatistics fit;
  if (given.surface_input) {
    preprocess::RepairedSurface repaired = preprocess::read_sound_surface(
        work.input, given.surface_input->unit, given.surface_input->frame);
    surface = std::move(repaired.surface);
    mends = std::move(repaired.mends);
    write_dropped(repaired.dropped, folder);
    surface = preprocess::remesh(surface, given.surface.edge_length_mm);
  } else {
    const preprocess::Mask mask =
        preprocess::read_mask(work.artifact("segment").folder / "mask.nrrd");
    // Who drew the labels also chose how wide the vessel is, to half a voxel.
    const auto width =
        given.labels ? preprocess::FitWidth::kOfMask : preprocess::FitWidth::kOfImage;
    surface = given.volume
                  ? preprocess::surface_from_image(work.image(), mask, given.surface, &fit, width)
                  : preprocess::surface_from_mask(mask, given.surface);
    work.drop_image();
  }
  const preprocess::SurfaceCheck check = preprocess::check_surface(surface);
  preprocess::require_sound(check, "stage surface");
  preprocess::write_surface(surface, folder / "surface.vtp");

  Json figures = figures_of("surface");
  figures["vertices"] = check.vertices;
  figures["triangles"] = check.triangles;
  figures["volume_mm3"] = check.volume_mm3;
  figures["area_mm2"] = check.area_mm2;
  figures["euler_number"] = check.euler_number;
  figures["mean_edge_mm"] = check.mean_edge_mm;
  figures["min_angle_deg"] = check.min_angle_deg;
  figures["self_intersections"] = check.self_intersections;
  if (given.volume) {
    figures["fit"] = {{"lumen_value", fit.lumen_value},
                      {"outside_value", fit.outside_value},
                      {"mean_shift_mm", fit.mean_shift_mm},
                      {"fitted_fraction", fit.fitted_fraction},
                      {"beyond_half_mm", fit.beyond_half_mm}};
  }
  constexpr double kToldFrom = 0.1;  // mm
  if (std::abs(fit.beyond_half_mm) > kToldFrom) {
    figures["warnings"].push_back(
        "surface: the labels put the wall " + format("%.2f", std::abs(fit.beyond_half_mm)) +
        (fit.beyond_half_mm > 0.0 ? " mm outside" : " mm inside") +
        " half of the contrast, where a lumen's edge is" +
        (fit.wide_as_image ? ", more than half a voxel; the vessel is made as wide as the volume "
                             "shows it, look at its outline in the slices"
                           : "; the vessel is kept as wide as they say"));
  }
  if (given.surface_input) add_mends(mends, figures);
  figures["openings"] = openings_json(preprocess::find_openings(surface));
  std::vector<preprocess::Handle> handles;
  if (check.euler_number != 2) {
    handles = preprocess::find_handles(surface);
    figures["warnings"].push_back(handles_warning((2 - check.euler_number) / 2, handles));
  }
  figures["handles"] = loops_json(handles);
  write_figures(figures, folder);
}

void make_centerline(Workspace& work, const fs::path& folder) {
  const Surface& surface = work.surface();
  const plan::Study& study = work.given().study;
  const Case& given = work.given();
  require_inside(surface, work.artifact("surface").folder, given);

  work.begin_field();
  const std::vector<Vec3> guide = known_way(work, study.access, study.goal.point);
  const Centerline line = preprocess::find_centerline(
      surface, study.access, study.goal.point,
      {.beyond_mm = given.targets[given.target].beyond_mm, .guide = guide});
  require_apart(given, surface, line);
  preprocess::write_centerline(line, folder / "centerline.vtp");
  write_curve_markups(line.points, "centerline", folder / "centerline.mrk.json");

  Json figures = figures_of("centerline");
  figures.update(line_figures(line));
  if (const std::optional<Vec3> place = preprocess::find_departure(surface, line, guide)) {
    figures["warnings"].push_back(
        "centerline: at " + place_text(*place) +
        " mm it has left the way that the arteries' levels show, by a shortcut or through a vessel "
        "beside it: vessels that touch there, or a narrow place that the surface has closed; look "
        "at the outline there");
  }
  figures["target_lumen_radius_mm"] = line.radius(line.radius.size() - 1);
  std::vector<preprocess::Branch> tree = preprocess::find_tree(surface, study.access);
  name_branches(work, tree);
  figures["branches"] = write_tree(tree, folder);
  write_figures(figures, folder);
}

void make_wall(Workspace& work, const fs::path& folder) {
  const Surface surface =
      preprocess::read_surface_artifact(work.artifact("surface").folder / "surface.vtp");
  const preprocess::WallOptions& options = work.given().wall.extrusion;
  const preprocess::ExtrudedWall extruded = preprocess::extrude_wall(surface, options);
  preprocess::write_wall(surface, extruded.wall, folder / "wall.vtu");

  Json figures = figures_of("wall");
  figures["tetrahedra"] = extruded.wall.apexes.cols();
  figures["thickness_mm"] = options.thickness_mm;
  figures["young_modulus_kpa"] = clean(extruded.wall.young_modulus / kMpaPerKpa);
  figures["poisson_ratio"] = extruded.wall.poisson_ratio;
  figures["normal_stiffness_kpa_per_mm"] =
      clean(wall_normal_stiffness(extruded.wall.young_modulus, extruded.wall.poisson_ratio,
                                  options.thickness_mm) /
            kMpaPerKpa);
  figures["inverted_tetrahedra"] = extruded.statistics.inverted;
  figures["limited_tetrahedra"] = extruded.statistics.limited;
  figures["min_height_mm"] = extruded.statistics.min_height_mm;
  write_figures(figures, folder);
}

}  // namespace wireplan::pipeline
