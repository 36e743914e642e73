#pragma once
/// Slices of the volume with the outline of the lumen, by which a person checks the segmentation:
/// axial, coronal and sagittal, through places on the way from access to target. They are cut in
/// patient LPS and not along the grid, so that volume and surface match however the volume is
/// stored.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::pipeline {

/// The plane of a slice, shown as radiologists look at it: the patient's right at the left, head
/// up. right_of() and down_of() are the directions in LPS that run right and down in the picture.
enum class Plane { kAxial, kCoronal, kSagittal };
inline constexpr std::array kPlanes = {Plane::kAxial, Plane::kCoronal, Plane::kSagittal};
const char* plane_name(Plane plane);  // "axial", ...
Vec3 right_of(Plane plane);           // unit vectors in LPS
Vec3 down_of(Plane plane);

struct Slice {
  Plane plane = Plane::kAxial;
  std::vector<std::uint8_t> gray;  // (size * size), rows from the top
  Eigen::Matrix4Xf outline;        // (4, k) segments right_a, down_a, right_b, down_b of the
                                   // surface in this plane, from the slice's middle       [mm]
};

struct Place {
  std::string name;           // "access", "target", "42 mm from the access", ...
  Vec3 point = Vec3::Zero();  // middle of its slices                                     [mm]
  std::array<Slice, 3> slices;
};

struct Slices {
  int size = 0;                                // pixels along each side
  double spacing = 0.0;                        // of a pixel                                 [mm]
  double window_low = 0.0, window_high = 0.0;  // shown as black and as white             [HU]
  std::vector<Place> places;
};

struct SliceOptions {
  int size = 240;            // [px]
  double field = 96.0;       // width and height of a slice                               [mm]
  double window_low = 0.0;   // [HU]
  double window_high = 0.0;  // [HU]
};

/// The value at a point, interpolated linearly between the eight voxels around it; NaN outside the
/// voxels' centres.
double sample(const preprocess::Image& image, const Vec3& point);

/// Where the surface meets the plane through `middle` [mm]: segments as Slice::outline has them.
Eigen::Matrix4Xf cut_outline(const Surface& surface, Plane plane, const Vec3& middle, double field);

/// Places with names and points -> their slices.
Slices cut_slices(const preprocess::Image& image, const Surface& surface, std::vector<Place> places,
                  const SliceOptions& options);

/// What the page's panel of slices shows: the pictures as JPEG in base64, the outlines as 32 bit
/// floats in base64.
Json slices_json(const Slices& slices);

/// A gray picture as JPEG bytes.
std::string encode_jpeg(const std::vector<std::uint8_t>& gray, int size);

}  // namespace wireplan::pipeline
