#include "pipeline/commands/scene_support.h"

#include <cmath>
#include <optional>

#include "pipeline/commands/scene_sensitivity.h"
#include "pipeline/files/text.h"
#include "pipeline/stages/held_places.h"
#include "plan/support_fit.h"

namespace wireplan::pipeline {
namespace {

// Of places that are measured apart from one another; assumed                           [mm]
constexpr double kPlaceSpacing = 10.0;

/// Places along a measured line, one every 10 mm, the entry left out, where the wire is held.
Eigen::Matrix3Xd places_along(const Eigen::Matrix3Xd& line) {
  const auto count = static_cast<Eigen::Index>(simulate::arc_length(line) / kPlaceSpacing);
  Eigen::Matrix3Xd places(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    places.col(k) = simulate::point_at_arc(line, kPlaceSpacing * static_cast<double>(k + 1));
  }
  return places;
}

/// Squares of the distances to a computed wire.
Eigen::VectorXd squares_from(const Eigen::Matrix3Xd& wire, const Eigen::Matrix3Xd& places) {
  Eigen::VectorXd squares(places.cols());
  for (Eigen::Index k = 0; k < places.cols(); ++k) {
    squares(k) = (simulate::nearest_on_line(wire, places.col(k)) - places.col(k)).squaredNorm();
  }
  return squares;
}

Json fit_json(const plan::SupportFit& fit, const MeasuredWire& measured, Eigen::Index places) {
  Json json = {{"support_kpa_per_mm", clean(fit.support / kMpaPerKpa)},
               {"rms_mm", std::sqrt(fit.misfit)},
               {"sigma_mm", measured.sigma},
               {"places", places},
               {"runs", Json::array()}};
  const auto add_end = [&](const char* key, const std::optional<double>& end, double tried) {
    json[key] = end ? Json(clean(*end / kMpaPerKpa)) : Json(nullptr);
    if (end) return;
    json[std::string(key) + "_reason"] =
        format("the wire lies as well with %.3g, and nothing beyond was tried", tried / kMpaPerKpa);
  };
  add_end("low_kpa_per_mm", fit.low, plan::kSoftestSupport);
  add_end("high_kpa_per_mm", fit.high, plan::kStiffestSupport);
  for (const plan::SupportRun& run : fit.runs) {
    json["runs"].push_back({{"support_kpa_per_mm", clean(run.support / kMpaPerKpa)},
                            {"rms_mm", std::sqrt(run.misfit)}});
  }
  return json;
}

}  // namespace

SceneSupport find_scene_support(const InsertionScene& scene, const WallInput& wall,
                                const std::vector<preprocess::Branch>& tree, double young_modulus,
                                simulate::VesselModel& vessel) {
  const MeasuredWire& measured = *scene.measured;
  const Eigen::Matrix3Xd places = places_along(measured.line);
  WallInput tried = wall;
  const auto misfit = [&](double support) -> std::optional<double> {
    tried.support = support;
    vessel.sections = make_section_chain(tried, tree, scene.introducer.point, young_modulus);
    const simulate::TrialResult result = run_hand(scene, vessel, scene.options);
    const bool lies = result.nodes.cols() >= 2 && result.nodes.allFinite() &&
                      result.outcome != simulate::Outcome::kNotConverged &&
                      result.outcome != simulate::Outcome::kFailed;
    if (!lies) return {};
    return squares_from(result.nodes, places).mean();
  };
  const auto fit = plan::fit_support(misfit, static_cast<int>(places.cols()), measured.sigma);
  if (!fit) {
    throw Error(
        "measured: with no support of the vessel from 0.01 to 100 kPa/mm the wire comes to "
        "rest where the hand leaves it. Run the scene without \"measured\", which tells "
        "how it ends");
  }
  const auto end = [](const std::optional<double>& at, const std::string& open) {
    return at ? format("%.2g", *at / kMpaPerKpa) : open;
  };
  return {.support = fit->support,
          .json = fit_json(*fit, measured, places.cols()),
          .line = format("the measured wire lies %.2f mm (rms) from the one with a support of %.2g "
                         "kPa/mm; 95 %% interval from ",
                         std::sqrt(fit->misfit), fit->support / kMpaPerKpa) +
                  end(fit->low, "below 0.01") + " to " + end(fit->high, "above 100")};
}

}  // namespace wireplan::pipeline
