#include "pipeline/stages/mask_look.h"

#include <algorithm>

#include "pipeline/files/text.h"
#include "pipeline/report/mask_picture.h"
#include "pipeline/report/places.h"
#include "pipeline/stages/mask_checks.h"
#include "preprocess/segment/segment_leak.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::pipeline {
namespace {

constexpr std::size_t kMostEnds = 6, kMostTouches = 4, kMostLeaks = 4;  // that get slices

Vec3 point_of(const Json& place) {
  return {place.at(0).get<double>(), place.at(1).get<double>(), place.at(2).get<double>()};
}

std::vector<MarkedPlace> places_to_look_at(const Case& given, const Json& figures) {
  std::vector<MarkedPlace> places;
  for (const auto& [key, point] : end_points(given)) {  // "targets[1].point_mm"
    if (places.size() < kMostEnds) places.push_back({key.substr(0, key.rfind('.')), point});
  }
  if (figures.contains("narrowest_mm") && figures.at("narrowest_radius_mm") > 0.0) {
    places.push_back(
        {"narrowest, " + format("%.1f mm in radius", figures["narrowest_radius_mm"].get<double>()),
         point_of(figures["narrowest_mm"])});
  }
  const auto add = [&](const char* list, std::size_t most, const auto& name_of) {
    const Json::json_pointer key(std::string("/") + list);
    if (!figures.contains(key)) return;
    for (std::size_t k = 0; k < std::min(most, figures.at(key).size()); ++k) {
      const Json& one = figures.at(key).at(k);
      places.push_back({name_of(one), point_of(one.at("place_mm"))});
    }
  };
  add("touches", kMostTouches, [](const Json& touch) -> std::string {
    return touch.at("cut").get<bool>() ? "limbs touch, parted" : "limbs touch";
  });
  add("loops/left", kMostTouches, [](const Json& loop) {
    return format("a loop, %.1f mm in radius", loop.at("radius_mm").get<double>());
  });
  add("way_doubts", kMostTouches, [](const Json& doubt) -> std::string {
    return doubt.at("by") == "level" ? "the level changes" : "the way narrows";
  });
  add("leaks", kMostLeaks, [](const Json& leak) {
    return format("leak cut, %.1f ml", leak.at("volume_mm3").get<double>() / 1000.0);
  });
  return places;
}

/// Through the middle of the mask, sought in the part of the grid that holds it.
std::vector<Vec3> way_through(const preprocess::Mask& mask, const Vec3& from, const Vec3& to) {
  const preprocess::Voxel first = preprocess::voxel_at(
      mask.grid, preprocess::nearest_label(mask.grid, mask.labels, from).voxel);
  const preprocess::Box box =
      preprocess::grown(preprocess::bounding_box(mask.grid, mask.labels, {first, first}),
                        preprocess::Voxel{1, 1, 1}, mask.grid);
  const preprocess::Mask part{.grid = preprocess::cropped(mask.grid, box),
                              .labels = preprocess::crop_values(mask.grid, box, mask.labels)};
  return preprocess::find_route(part.grid,
                                {preprocess::nearest_label(part.grid, part.labels, from).voxel,
                                 preprocess::nearest_label(part.grid, part.labels, to).voxel},
                                part.labels)
      .points;
}

}  // namespace

void write_mask_look(const Case& given, const preprocess::Image& image,
                     const preprocess::Mask& mask, const Json& figures,
                     const std::filesystem::path& folder) {
  const auto [low, high] = vessel_window(image, figures);
  write_png(draw_mask_picture({.image = image,
                               .mask = mask,
                               .places = places_to_look_at(given, figures),
                               .way = way_through(mask, given.accesses.front().point,
                                                  given.targets.front().point),
                               .window_low = low,
                               .window_high = high}),
            folder / "slices.png");
}

}  // namespace wireplan::pipeline
