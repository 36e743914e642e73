#pragma once
/// Where the handles of a surface are: vessels that touch or run in a ring, and holes of noise.
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// A handle where it is thinnest.
struct Handle {
  Vec3 place = Vec3::Zero();  // mean of the shortest loop round it                         [mm]
  double radius_mm = 0.0;     // of a circle as long as that loop
};

/// As many as the surface has, the thinnest first: the shortest closed ways along edges that no
/// two of which cross and none of which, with others of them, bounds a part of the surface (a
/// greedy basis of half of its first homology over Z2). Loops are sought from vertices spread over
/// the surface, and from those of loops that are found, until these get no shorter
/// or 200 vertices were tried.
/// Tree and cotree: Erickson and Whittlesey, Greedy optimal homotopy and homology generators, SODA
/// 2005, section 3. Expects a closed, manifold, oriented surface in one piece. None where there are
/// more than 128, which are noise.
std::vector<Handle> find_handles(const Surface& surface);

}  // namespace wireplan::preprocess
