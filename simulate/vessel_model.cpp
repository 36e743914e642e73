#include "simulate/vessel_model.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <optional>

namespace wireplan::simulate {

namespace {

VesselModel make_yielding(const Surface& surface, const Wall& wall, LumenOptions options) {
  options.band = std::max(options.band, VesselModel::kYieldingBand);
  std::optional<Lumen> field;
  std::unique_ptr<const WallCompliance> compliance;
  tbb::parallel_invoke([&] { field.emplace(surface, options); },
                       [&] { compliance = std::make_unique<WallCompliance>(surface, wall); });
  VesselModel model(surface, std::move(*field));
  model.compliance = std::move(compliance);
  return model;
}

}  // namespace

VesselModel::VesselModel(const Surface& surface, const Wall& wall, const LumenOptions& options)
    : VesselModel(make_yielding(surface, wall, options)) {}

}  // namespace wireplan::simulate
