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

/// Moves each vertex along its normal to the edge of the lumen, in three rounds. Lengths are in
/// units: a voxel in the first round, then 1.7 sigma of the blur found on the edges, if that is
/// more, and at most two voxels.
///   1. The edge is where the grey value passes half way between the lumen's and the least within
///      1.2 units outside, which counts as no darker than soft tissue. Levels are local, so that
///      neither bright bone nor dark fat beyond the wall pulls the edge. Where it is brighter
///      outside (calcium), the edge is half way to that.
///   2. Blur draws a curved edge toward the middle of the vessel by sigma^2 times the mean
///      curvature; the vertex moves out by as much.
///   3. Against noise, shifts are averaged over 2 units of the surface, up to 3 in a noisy image.
///   In
///      all a vertex moves by at most 1.2 units.
/// A vertex where the image shows no edge (a vein in contact, the end of what was segmented)
/// follows its neighbours but is held back. Within a voxel of the volume's border, where the vessel
/// is capped, vertices stay. Connectivity is kept, but the mesh may cut itself afterwards where
/// walls are close: check it. Expects a closed surface with outward normals.
Surface fit_to_image(const Surface& surface, const Image& image, FitStatistics* statistics);

}  // namespace wireplan::preprocess
