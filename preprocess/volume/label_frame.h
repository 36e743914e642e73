#pragma once
/// Whether labels lie where the volume that they were drawn in does, and how they come onto its
/// grid.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// Moves points of the labels to the volume: p_volume = linear * p_labels + shift.
struct FrameChange {
  Mat3 linear = Mat3::Identity();
  Vec3 shift = Vec3::Zero();  //                                                           [mm]
  std::string order = {};     // "k, j, i" where axes of the file stand in another order
};

/// "shifted by (0, 10, 0) mm", "mirrored in y: y' = 12.5 - y", the order of axes, and else the
/// matrix.
std::string describe_change(const FrameChange& change);

/// Of a grid of labels with the volume's sizes and spacings that holds other places: what would
/// bring one onto the other. Empty where the grids agree (to a tenth of a voxel; the order of axes
/// and slices may differ), and where they are of different sizes, so that each may be right.
std::optional<FrameChange> find_contradiction(const Grid& labels, const Grid& volume);

/// Whether every centre of `from` is one of `to`, or would be if `to` went on, to a tenth of a
/// voxel.
bool shares_lattice(const Grid& from, const Grid& to);

/// Classes (0, or 1 + an index) on another grid. A voxel is inside where trilinear weights of all
/// classes round its centre sum to a half, and of the class with the largest of them.
std::vector<std::uint8_t> onto_grid(const Grid& to, const Grid& from,
                                    const std::vector<std::uint8_t>& classes);

/// Looks in the volume for the labels' edges: contrast is brighter inside. Returns the change under
/// which they are seen well where they are not as they lie: mirrored along the grid's axes, their
/// order changed, x and y negated (RAS and LPS mixed up), shifted by up to 20 mm, or mirrored round
/// their own middle and shifted. Empty where they are seen as they lie, which may be by edges
/// between two classes, as of a wall and its lumen, and where they are seen nowhere. `contrast` is
/// set to the mean step inward across the edge as they lie [HU]. Of all classes together, or of one
/// (1 + its index): the edges of a trunk hide where a small branch lies. One of less than 100 edges
/// toward what is in none is not judged, and has no contrast (NaN).
std::optional<FrameChange> find_better_frame(const Image& image,
                                             const std::vector<std::uint8_t>& classes,
                                             double& contrast, std::uint8_t only = 0);

/// The shift by a voxel to three under which all labels are seen more clearly, by a seventh of
/// their contrast, than as they lie: a header that was rounded, or cropped at another voxel. Empty
/// where there is none.
std::optional<FrameChange> find_near_shift(const Image& image,
                                           const std::vector<std::uint8_t>& classes);

}  // namespace wireplan::preprocess
