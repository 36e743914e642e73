#pragma once
/// The surface of a mask, moved to where the image itself has the lumen's edge.
#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// How wide the vessel becomes.
enum class FitWidth {
  kOfImage,  // to half of the contrast, where a lumen's edge is
  kOfMask,   // as far beyond or within it as the given surface is in the median: somebody drew it
             // so, and means it; but that of the image where that is more than half a voxel
};

/// What the image said about the edge.
struct FitStatistics {
  double lumen_value = 0.0;      // median of the values just inside                    [HU]
  double outside_value = 0.0;    // median of the values just outside                   [HU]
  double mean_shift_mm = 0.0;    // how far vertices moved, mean of the absolute value  [mm]
  double fitted_fraction = 0.0;  // of the vertices at which the image shows an edge
  double beyond_half_mm = 0.0;   // outward from half of the contrast to the given surface [mm]
  bool wide_as_image = false;    // whether the given one was too far off to be as wide as that
};

/// Moves each vertex along its normal to the edge of the lumen, in three rounds. Lengths are in
/// units: a voxel in the first round, then 1.7 sigma of the blur found on the edges, if that is
/// more, and at most two voxels.
///   1. The edge is where the grey value passes half way between the lumen's and the least within
///      1.2 units outside, which counts as no darker than soft tissue. Levels are local, so that
///      neither bright bone nor dark fat beyond the wall pulls the edge. Where it is brighter
///      outside (calcium), the edge is half way to that. From the second round on the wall before
///      fat is seen in the profile (wall_profile.h), unless slices blur more than all else.
///   2. Blur draws a curved edge toward the middle of the vessel by sigma^2 times the mean
///      curvature; the vertex moves out by as much.
///   3. Against noise, shifts are averaged over 2 units of the surface, up to 3 in a noisy image.
///      In all a vertex moves by at most 1.2 units.
///   4. With `FitWidth::kOfMask` vertices move back along their normals by the median of what those
///      with an edge moved (the others by as much as they are held), and end within half a voxel of
///      where they began, as well as labels are known: the shape is the image's, the width that of
///      the given surface. Where fewer than a quarter show an edge, they are not moved back; nor
///      where the median is more than half a voxel: then the edge is sought up to two voxels away.
/// A vertex where the image shows no edge (a vein in contact, the end of what was segmented)
/// follows its neighbours but is held back. Within a voxel of the volume's border and at most
/// 1.7 mm, where the vessel is capped, vertices stay. Connectivity is kept, but the mesh may cut
/// itself afterwards where walls are close: check it. Expects a closed surface with outward
/// normals.
Surface fit_to_image(const Surface& surface, const Image& image, FitStatistics* statistics,
                     FitWidth width = FitWidth::kOfImage);

}  // namespace wireplan::preprocess
