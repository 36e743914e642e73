#include "simulate/vessel_model.h"

#include <algorithm>
#include <future>

namespace wireplan::simulate {

namespace {

VesselModel make_yielding(const Surface& surface, const Wall& wall, LumenOptions options) {
  options.band = std::max(options.band, VesselModel::kYieldingBand);
  std::future<std::unique_ptr<WallCompliance>> compliance = std::async(
      std::launch::async, [&] { return std::make_unique<WallCompliance>(surface, wall); });
  VesselModel model(surface, options);
  model.compliance = compliance.get();
  return model;
}

}  // namespace

VesselModel::VesselModel(const Surface& surface, const Wall& wall, const LumenOptions& options)
    : VesselModel(make_yielding(surface, wall, options)) {}

}  // namespace wireplan::simulate
