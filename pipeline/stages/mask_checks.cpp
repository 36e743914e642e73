#include "pipeline/stages/mask_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/files/text.h"
#include "pipeline/report/report.h"

namespace wireplan::pipeline {
namespace {

std::string place_in_mask(const Vec3& p) { return place_text(p) + " mm"; }

/// Where two pieces come nearest: of voxels of the one, the nearest to the other's point is enough
/// for a person to look at.
Vec3 nearest_of_piece(const preprocess::Grid& grid, const preprocess::Labels& piece,
                      const Vec3& point) {
  return preprocess::center_of(grid, preprocess::nearest_label(grid, piece, point).voxel);
}

/// How limbs that a mask joins, and that only touch, can be parted.
std::string tell_parting(const Case& given) {
  if (given.labels) return "part them in the labels";
  return std::string(given.segmentation.lower_hu
                         ? "raise segmentation.lower_hu and neck_opening_mm"
                         : "give segmentation.lower_hu, upper_hu and neck_opening_mm") +
         " so that the contact is left out, or give labels that part them";
}

std::string touch_warning(const preprocess::Touch& touch, bool by_values, const Case& given) {
  const std::string place = place_in_mask(touch.place);
  const std::string measured =
      by_values ? "the contact has " + format("%.0f", touch.level) + " HU, both sides " +
                      format("%.0f", touch.side) + " or more"
                : "the contact is " + format("%.1f", touch.level) + " mm in radius, both sides " +
                      format("%.1f", touch.side) + " or more";
  const std::string ways = " (" + format("%.0f", touch.through_mm) + " mm through it, " +
                           format("%.0f", touch.round_mm) + " mm round)";
  const std::string seed = "a seed there in segmentation.seeds_mm";
  if (touch.cut) {
    return "segment: limbs touch at " + place + " and were parted there: " + measured + ways +
           "; if they are open to each other, " + seed + " keeps them so";
  }
  return "segment: limbs touch at " + place + ", and the way leads through the touch: " + measured +
         ways + "; if they only touch, " + tell_parting(given) + "; if the vessel is open there, " +
         (given.labels ? "nothing is to be done" : seed + " says so");
}

}  // namespace

double reach_beside(const preprocess::Grid& grid) {
  return std::max(3.0, 2.0 * std::cbrt(grid.spacing.prod()));
}

bool require_ends_in_one_piece(const Case& given, preprocess::Mask& mask, Json& figures) {
  const preprocess::Grid& grid = mask.grid;
  const double reach = reach_beside(grid);
  const auto inside = [&](std::size_t n) { return mask.labels[n] != 0; };
  std::string problems;
  const auto add = [&](const std::string& line) {
    problems += (problems.empty() ? "" : "\n") + line;
  };
  preprocess::Labels piece;  // that holds the first end
  std::string first;
  for (const auto& [key, point] : end_points(given)) {
    const preprocess::NearestLabel nearest = preprocess::nearest_label(grid, mask.labels, point);
    if (nearest.distance > reach) {
      add(key + " is " + to_json(point).dump() + ", " + format("%.1f", nearest.distance) +
          " mm outside of what was found of the vessel, expected a point inside it (move the "
          "point, or mend the segmentation that left its place out)");
      continue;
    }
    if (piece.empty()) {
      piece = preprocess::flood(grid, {nearest.voxel}, inside);
      first = key;
    } else if (piece[nearest.voxel] == 0) {
      add(key + " is " + to_json(point).dump() + ", in another piece of the vessel than " + first +
          ", which comes no nearer than " + place_in_mask(nearest_of_piece(grid, piece, point)) +
          ", expected one piece that holds both (if the artery is open between them, " +
          (given.labels                  ? ""
           : given.segmentation.lower_hu ? "lower segmentation.lower_hu or neck_opening_mm, or "
                                         : "give segmentation.lower_hu and upper_hu, or ") +
          "draw what is missing)");
    }
  }
  if (!problems.empty()) throw Error(problems);

  // The surface is made of the largest piece.
  const std::size_t kept = preprocess::count(piece), all = preprocess::count(mask.labels);
  if (2 * kept > all) return false;
  preprocess::Labels rest = mask.labels;
  for (std::size_t n = 0; n < rest.size(); ++n) rest[n] = piece[n] != 0 ? 0 : rest[n];
  preprocess::Labels largest;
  preprocess::measure_shape(grid, rest, &largest);
  const std::size_t other = preprocess::count(largest);
  if (other <= kept) return false;
  const Vec3 at = nearest_of_piece(grid, largest, end_points(given).front().second);
  figures["warnings"].push_back(
      "segment: a piece of " +
      format("%.2g", static_cast<double>(other) * grid.spacing.prod() / 1000.0) + " ml at " +
      place_in_mask(at) +
      " is not connected with that of access and target, and left out although it is the "
      "largest; " +
      (given.labels ? "draw what joins them" : "delete the seed in it, or join them"));
  mask.labels = std::move(piece);
  return true;
}

void add_shape(const preprocess::MaskShape& shape, Json& figures) {
  figures["shape"] = {{"pieces", shape.pieces},
                      {"voxels", shape.voxels},
                      {"outer_faces", shape.faces},
                      {"handles", shape.handles},
                      {"cavities", shape.cavities}};
}

void add_touches(const Case& given, const std::vector<preprocess::Touch>& touches,
                 std::size_t dipping, Json& figures) {
  figures["touches"] = Json::array();
  for (std::size_t k = 0; k < touches.size(); ++k) {
    const preprocess::Touch& touch = touches[k];
    const bool by_values = k < dipping;
    const std::string unit = by_values ? "hu" : "radius_mm";
    figures["touches"].push_back({{"place_mm", to_json(touch.place)},
                                  {"contact_" + unit, touch.level},
                                  {"beside_" + unit, touch.side},
                                  {"way_through_mm", touch.through_mm},
                                  {"way_round_mm", touch.round_mm},
                                  {"cut", touch.cut}});
    figures["warnings"].push_back(touch_warning(touch, by_values, given));
  }
}

}  // namespace wireplan::pipeline
