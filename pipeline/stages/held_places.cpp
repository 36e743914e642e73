#include "pipeline/stages/held_places.h"

#include <optional>

#include "plan/anatomy/passage.h"
#include "simulate/insertion/vessel_tree.h"

namespace wireplan::pipeline {
namespace {

/// Where an artery's own vessel begins; empty for what is no artery that leaves another.
std::optional<Vec3> find_ostium(const std::vector<preprocess::Branch>& tree, int k) {
  const preprocess::Branch& branch = tree[static_cast<std::size_t>(k)];
  if (branch.parent < 0 || simulate::is_stump(tree, k) || simulate::goes_on(tree, k) ||
      simulate::is_entered(tree, k) ||
      simulate::bifurcation_width(tree, {.parent = branch.parent, .child = k})) {
    return {};
  }
  return plan::point_at(branch.line, branch.line.arc_length[0] + simulate::own_start(branch));
}

std::vector<simulate::Pin> pins_of(const WallInput& wall,
                                   const std::vector<preprocess::Branch>& tree,
                                   const Vec3& access) {
  std::vector<simulate::Pin> pins;
  for (const HeldPlace& held : wall.held) {
    const auto hold = [&](const Vec3& place) {
      pins.push_back({.place = place, .radius = held.radius, .factor = held.factor});
    };
    if (held.at == HeldPlace::At::kAccess) hold(access);
    if (held.at == HeldPlace::At::kPoint) hold(held.point);
    if (held.at != HeldPlace::At::kOstia) continue;
    for (int k = 0; k < static_cast<int>(tree.size()); ++k) {
      if (const std::optional<Vec3> place = find_ostium(tree, k)) hold(*place);
    }
  }
  return pins;
}

}  // namespace

std::unique_ptr<const simulate::SectionChain> make_section_chain(
    const WallInput& wall, const std::vector<preprocess::Branch>& tree, const Vec3& access,
    double young_modulus) {
  return std::make_unique<simulate::SectionChain>(
      tree, simulate::SectionChainOptions{.support = wall.support.value(),
                                          .young_modulus = young_modulus,
                                          .thickness = wall.extrusion.thickness_mm,
                                          .pins = pins_of(wall, tree, access)});
}

}  // namespace wireplan::pipeline
