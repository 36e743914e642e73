#pragma once
/// Tunnels of noise through a mask, closed, and films on bone, cut.
#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// Fills what closing by a ball of `radius` [mm] would add, part by part (connected through faces),
/// where that closes tunnels: where it makes handles fewer (by the Euler number). Pits stay, and so
/// do gaps between limbs, which would become handles. `blocked` voxels are never filled.
void close_tunnels(const Grid& grid, double radius, const Labels& blocked, Labels& labels);

/// Slices that are thicker may hold an artery in one or two, so they tell nothing of films.
inline constexpr double kFineMm = 1.6;

/// Takes off films, as lie on bone whose blurred rim has the level of a vessel: parts (connected
/// through corners) more than a voxel away from where the mask is three voxels thick in each
/// direction in which voxels are fine (kFineMm), of which half or more lie within two voxels of
/// `values` [HU] above `upper`, the end of the band. Voxels of `kept` stay.
void cut_films(const Grid& grid, const std::vector<float>& values, double upper, const Labels& kept,
               Labels& labels);

}  // namespace wireplan::preprocess
