#pragma once
/// Surface + thickness -> the tetrahedral wall of paper section 1.5.
#include "preprocess/vessel.h"

namespace wireplan::preprocess {

struct WallOptions {
  double thickness_mm = 1.0;
  double young_modulus = 0.0;  // effective, references B2; 0: from the target k_n = 25 kPa/mm [MPa]
  double poisson_ratio = 0.3;
};

struct WallStatistics {
  int inverted = 0;  // tetrahedra without volume or with their apex inside; 0 on a sound surface
  int limited = 0;   // triangles whose height is below the asked thickness
  double min_height_mm = 0.0;
};

struct ExtrudedWall {
  Wall wall;
  WallStatistics statistics;
};

/// One tetrahedron per triangle: apex = centroid + height * outward normal. The height is
///   1. the thickness, or half of the free way outward where that is less, so that no apex lies
///      inside another lumen (prototypes D);
///   2. halved until the apex is at least half of its height away from all of the surface.
/// Step 2 stops at 5 % of the thickness. A neighbouring triangle across a crease does not reduce
/// the height of step 1 below 5 % either: the apex may then lie a little beyond that neighbour. A
/// height of 1 % would make one element a hundred times as stiff.
/// Expects a closed surface with outward normals. The same at any thread count.
ExtrudedWall extrude_wall(const Surface& surface, const WallOptions& options);

}  // namespace wireplan::preprocess
