#pragma once
/// The surface of a mask, moved to where the image itself has the lumen's edge.
#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// What the image said about the edge.
struct FitStatistics {
  double lumen_value = 0.0;      // median of the values just inside                    [HU]
  double outside_value = 0.0;    // median of the values just outside                   [HU]
  double mean_shift_mm = 0.0;    // how far vertices moved, mean of the absolute value  [mm]
  double fitted_fraction = 0.0;  // of the vertices at which the image shows an edge
};

/// Moves each vertex along its normal to where the grey value passes half way between the lumen's
/// and the least within 1.2 voxels outside, but no darker than soft tissue: a local level, so that
/// neither bright bone nor dark fat beyond the wall pulls the edge. Where it is brighter outside
/// (calcium), half way to that. Blur draws a curved edge toward the middle by sigma^2 times the
/// mean curvature, which is added; sigma is measured on the edges. Shifts are at most 1.2 voxels
/// and are averaged over about 2 voxels of the surface against noise; where the image shows no edge
/// (a vein in contact, the end of what was segmented) a vertex follows its neighbours but is held
/// back, and within a voxel of the volume's border, where the vessel is capped, it stays. Shape and
/// connectivity of the mesh are kept; it may cut itself afterwards where walls are close: check it.
/// Expects a closed surface with outward normals.
Surface fit_to_image(const Surface& surface, const Image& image, FitStatistics* statistics);

}  // namespace wireplan::preprocess
