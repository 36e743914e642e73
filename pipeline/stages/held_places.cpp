#include "pipeline/stages/held_places.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "pipeline/files/text.h"
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

/// Distance of a place from the nearest point of the tree's lines [mm].
double distance_to(const std::vector<preprocess::Branch>& tree, const Vec3& place) {
  double nearest = HUGE_VAL;
  for (const preprocess::Branch& branch : tree) {
    nearest = std::min(nearest, (branch.line.points.colwise() - place).colwise().norm().minCoeff());
  }
  return nearest;
}

/// Refuses points so far from the vessel that they would hold nothing.
void expect_near(const WallInput& wall, const std::vector<preprocess::Branch>& tree) {
  std::string text;
  for (std::size_t k = 0; k < wall.held.size(); ++k) {
    const HeldPlace& held = wall.held[k];
    if (held.at != HeldPlace::At::kPoint) continue;
    const double off = distance_to(tree, held.point), most = 2.0 * held.radius;
    if (off < most) continue;
    text += (text.empty() ? "" : "; ") + format("wall.held[%zu].point_mm is ", k) +
            place_text(held.point) +
            format(
                " mm, %.1f mm from the middle of the vessel, expected less than %g, twice its "
                "radius_mm: from there on it holds nothing",
                off, most);
  }
  if (!text.empty()) throw Error(text + "; move the point, or give a larger radius_mm");
}

std::vector<simulate::Pin> pins_of(const WallInput& wall,
                                   const std::vector<preprocess::Branch>& tree,
                                   const Vec3& access) {
  expect_near(wall, tree);
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
