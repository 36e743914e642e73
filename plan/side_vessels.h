#pragma once
/// Vessels off the way that a reversed curve can be reshaped in (reshaping.h).
#include <optional>
#include <vector>

#include "simulate/insertion/tool_trial.h"
#include "simulate/insertion/way.h"

namespace wireplan::plan {

/// All vessels that leave the way's trunks before that arc length of it [mm], the ostium's, each
/// from where its line leaves the way's inscribed balls; widest first. Where the way comes up a
/// leg, the other leg is among them. None without a tree.
std::vector<simulate::SideVessel> find_side_vessels(const simulate::Way& way, double before);

/// Of these at most two, the widest, that serve: twice as wide as the catheter (assumed) as far as
/// it goes in, long enough, and out of a trunk of half the curve's width at least, where the knee
/// is to rise, past the ostium too. None for a curve that is not reversed.
std::vector<simulate::SideVessel> list_reshaping_vessels(
    const simulate::Way& way, double ostium, const std::vector<simulate::SideVessel>& sides,
    const simulate::Wire& tube);

/// How far past an ostium at that arc length of the way a catheter's tip goes along the trunk for
/// its reversed curve to open there [mm]: by all of the curve, where the image is seen so far, by
/// what is before the knee at least; the trunk is as wide there as the last curve. Empty where it
/// is not, and for a curve that is not reversed.
std::optional<double> find_opening_depth(const simulate::Way& way, double ostium,
                                         const simulate::Wire& tube);

/// From a catheter's tip to its knee, the middle of its last curve [mm].
double knee_length(const simulate::Wire& tube);

/// So far the wire goes into a side vessel ahead of a catheter whose knee is at the mouth, and
/// ahead of one whose curve is to open in the trunk [mm].
inline constexpr double kWireLeads = 20.0, kWireLeadsOn = 12.0;

}  // namespace wireplan::plan
