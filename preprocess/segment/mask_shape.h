#pragma once
/// How complicated a mask is, told before a surface is made of it: a vessel has few handles.
#include <cstddef>
#include <string>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// Counts of a mask, connected through voxel faces; all but `pieces` of its largest piece.
struct MaskShape {
  std::size_t pieces = 0;
  std::size_t voxels = 0;
  std::size_t faces = 0;     // of its voxels that lie against others, or on the border of the grid
  std::size_t handles = 0;   // ways round which a loop can be laid; a ring has one
  std::size_t cavities = 0;  // closed in all directions, corners included
  double volume_mm3 = 0.0;
};

/// What is still made a surface. Most of any real case here (MEASUREMENTS.md): 8 handles and
/// 0.03 million faces.
struct MaskLimits {
  int handles = 50;     // a vessel's own loops, and places where noise or calcium is a hole
  int faces = 400'000;  // outer ones, of voxels: what a surface takes time by

  /// In so many pieces labels may come: each takes time to join.
  std::size_t pieces() const { return 4 * static_cast<std::size_t>(handles > 1 ? handles : 1); }
};

/// What a mask was made by, which remedies follow from.
enum class MaskBy { kLabels, kBand, kLevels };

/// In time linear in the voxels: handles from the Euler number of the complex of voxel centres,
/// the pairs, squares and cubes of neighbours among them, which is pieces - handles + cavities.
/// `largest`, where given, becomes the largest piece.
MaskShape measure_shape(const Grid& grid, const Labels& labels, Labels* largest = nullptr);

/// Of a part of a mask: pieces (connected through faces) - handles + cavities.
std::ptrdiff_t euler_number(const Grid& grid, const Labels& labels);

/// "67 handles (loops or holes) in 12 ml (310 thousand voxels with 51 thousand outer faces)".
std::string describe_shape(const MaskShape& shape);

/// Throws `Error` with these, the limit and a remedy where the shape is beyond the limits.
void require_simple(const MaskShape& shape, const MaskLimits& limits, MaskBy by);

/// The same of what is connected to the seeds, before contacts and leaks are cut from it: 400
/// times the handles (of which the cavities are taken off here), 20 times the faces, and 25 voxels
/// for each of the limit's faces. This bounds the time of what follows.
void require_no_flood(const Grid& grid, const Labels& labels, const MaskLimits& limits, MaskBy by);

}  // namespace wireplan::preprocess
