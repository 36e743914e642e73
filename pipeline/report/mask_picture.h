#pragma once
/// The first look at a segmentation: one picture with the outline of the mask on slices through
/// access, target and doubtful places, and on the volume straightened along the way. No viewer is
/// needed for it.
#include <string>
#include <vector>

#include "pipeline/report/canvas.h"
#include "preprocess/volume/image.h"

namespace wireplan::pipeline {

struct MarkedPlace {
  std::string name;           // "access", "limbs touch", ...
  Vec3 point = Vec3::Zero();  // [mm]
};

struct MaskView {
  const preprocess::Image& image;
  const preprocess::Mask& mask;          // on the image's grid
  std::vector<MarkedPlace> places = {};  // each gets an axial, a coronal and a sagittal slice
  std::vector<Vec3> way = {};            // from access to target; fewer than two points: not drawn
  double window_low = 0.0, window_high = 0.0;  // black and white                       [HU]
};

/// Slices as radiologists look at them (see Plane), 96 mm wide, two places in a row; a cross marks
/// the place. Below, the way from left to right, seen from two sides: upper strip across it to the
/// patient's left, lower strip to the back (each made normal to the way), up to 24 mm to either
/// side.
Picture draw_mask_picture(const MaskView& view);

}  // namespace wireplan::pipeline
