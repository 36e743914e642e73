#pragma once
/// Tunnels of noise through a mask, closed.
#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// Fills what closing by a ball of `radius` [mm] would add, part by part (connected through faces),
/// where that closes tunnels: where it makes handles fewer (by the Euler number). Pits stay, and so
/// do gaps between limbs, which would become handles. `blocked` voxels are never filled.
void close_tunnels(const Grid& grid, double radius, const Labels& blocked, Labels& labels);

}  // namespace wireplan::preprocess
