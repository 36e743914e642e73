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

/// One tetrahedron per triangle: apex = centroid + height * outward normal. The height is the
/// thickness, or half of the free distance outward where another part of the surface is nearer
/// (prototypes D), so that no apex comes to lie inside a lumen. It is halved on until the apex
/// keeps half of its height from all other wall, but not below 5 % of the thickness for that, nor
/// for a neighbour across a crease: there the apex may come to lie that little beyond it, where a
/// height of 1 % would make one element a hundred times as stiff.
/// Expects a closed surface with outward normals. The same at any thread count.
ExtrudedWall extrude_wall(const Surface& surface, const WallOptions& options);

}  // namespace wireplan::preprocess
