#pragma once
/// Chosen classes of labels -> one mask of the lumen, which class each of its voxels is, and places
/// in a class by its name.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/volume/labels.h"

namespace wireplan::preprocess {

/// A gap between two pieces that was filled.
struct Bridge {
  std::size_t from = 0, to = 0;  // indices of the classes on both sides
  Vec3 place = Vec3::Zero();     // its middle                                           [mm]
  double length_mm = 0.0;        // between the faces of the voxels on both sides; 0 where they
                                 // touch at an edge or corner alone
  double radius_mm = 0.0;        // of what it was filled with: that of the thinner side
};

/// A piece that is not connected with the largest, and left out of the mask.
struct LostPiece {
  std::size_t of = 0;         // index of the class that most of it is
  Vec3 place = Vec3::Zero();  // its point nearest to the mask                          [mm]
  double gap_mm = 0.0;        // from there to the mask
  double volume_mm3 = 0.0;
};

struct LabelMask {
  Mask mask;
  std::vector<std::uint8_t> class_of;  // by voxel: 0 outside, 1 + the index of the class inside
  std::vector<Bridge> bridges;
  std::vector<LostPiece> lost;   // the largest first
  double lost_specks_mm3 = 0.0;  // pieces of less than kLeastPiece voxels, in all
  double volume_mm3 = 0.0;
  bool touches_border = false;  // of the volume: the vessel is cut there
};

inline constexpr std::size_t kLeastPiece = 10;
inline constexpr double kMostGap = 5.0;  // between pieces that are joined                 [mm]

/// Joins the classes to one piece: the largest, connected through voxel faces. A piece that is less
/// than `most_gap` [mm] from it is joined by a round bridge from the middle of its end, nearest
/// pieces first. Cavities that are closed in all directions are filled. Throws `Error` where there
/// are more than `most_pieces` of kLeastPiece voxels: noise, and each takes time to join.
LabelMask merge_labels(const LabelVolume& labels, double most_gap = kMostGap,
                       std::size_t most_pieces = 200);

/// From the point to the nearest voxel outside the mask, at most `most` [mm].
double inscribed_radius(const Mask& mask, const Vec3& point, double most);

}  // namespace wireplan::preprocess
