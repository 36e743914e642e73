// The stage that tells what the way is like before a wire is pushed.
#include <string>

#include "pipeline/files/text.h"
#include "pipeline/report/anatomy_json.h"
#include "pipeline/stages/makers.h"
#include "preprocess/centerline/section_width.h"
#include "preprocess/segment/segment.h"
#include "preprocess/volume/calcium.h"

namespace wireplan::pipeline {
namespace {

/// Why calcium cannot be told from the case's input; empty where it can.
std::string calcium_unknown(Workspace& work, const plan::AccessLimits& limits) {
  if (!work.given().volume) {
    return std::string("the case starts from ") + (work.given().labels ? "labels" : "a surface") +
           ", which shows no calcium";
  }
  if (!preprocess::in_hounsfield(work.image())) {
    return work.image().modality.empty()
               ? "the volume does not say that it is a CT, and its values do not look like HU"
               : "the volume is no CT";
  }
  const double lumen = work.figures("segment").at("mean_hu").get<double>();
  if (lumen > 0.8 * limits.calcium_hu) {
    return "the contrast in the lumen is nearly as bright as calcium";
  }
  return "";
}

std::string tell_plaque_in_lumen(const preprocess::Calcium& calcium,
                                 const plan::AccessLimits& limits) {
  return "anatomy: " + format("%.0f mm3", calcium.inside) +
         " of what counts as lumen along the way " +
         format("are brighter than %.0f HU", limits.calcium_hu) + ", the largest piece round " +
         place_text(*calcium.inside_at) +
         " mm: plaque or metal there leaves less room than the lumen's widths say; look at the "
         "slices";
}

}  // namespace

void make_anatomy(Workspace& work, const std::filesystem::path& folder) {
  const plan::AccessLimits& limits = work.given().access_limits;
  Json figures = figures_of("anatomy");
  const simulate::Way& way = *work.study().goal.way;
  figures.update(anatomy_figures(way, preprocess::section_diameters(work.surface(), way.path()),
                                 limits, work.given().axes_known));
  if (work.given().axes_known) {
    const std::string doubt = doubt_of_axes(way);
    if (!doubt.empty()) figures["warnings"].push_back("anatomy: " + doubt);
  }

  const std::string unknown = calcium_unknown(work, limits);
  preprocess::Calcium calcium;
  if (unknown.empty()) {
    calcium = preprocess::measure_calcium(
        work.image(), preprocess::read_mask(work.artifact("segment").folder / "mask.nrrd"),
        work.path(), {.threshold_hu = limits.calcium_hu, .within_mm = limits.calcium_within});
  }
  if (calcium.inside_at) figures["warnings"].push_back(tell_plaque_in_lumen(calcium, limits));
  if (work.given().volume) work.drop_image();
  figures["access"]["calcium"] = calcium_json(calcium.beside + calcium.inside, unknown, limits);
  write_figures(figures, folder);
}

}  // namespace wireplan::pipeline
