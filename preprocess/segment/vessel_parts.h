#pragma once
/// Which parts of a mask are the vessel of given ways, and which are others that touch it.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "preprocess/segment/segment_way.h"

namespace wireplan::preprocess {

/// A part of a mask: the voxels that climb to one maximum of the depth, with the bumps beside it.
struct VesselPart {
  float depth = 0.0F;              // inscribed radius                                    [mm]
  Vec3 peak = Vec3::Zero();        // where                                                [mm]
  double core = 0.0;               // mean of the volume in the middle of it              [HU]
  double core_voxels = 0.0;        // of which that is the mean
  double voxels = 0.0;             // of all of it
  double faces = 0.0, soft = 0.0;  // of its boundary; behind how many the values stay high
  float level = 0.0F;              // followed from the ways; where it is `other` its own [HU]
  bool on_way = false;             // of the vessel that the ways run in, as far as it goes on
  bool other = false;              // another vessel, or an organ
  bool doubtful = false;           // not other, but nearly so
};

struct VesselParts {
  std::vector<std::uint32_t> of;  // each voxel's part, from 1; 0 outside the mask
  std::vector<VesselPart> parts;  // the first is none
};

/// Divides `mask`, whose depth is given [mm], and visits its parts from those that the ways run
/// through, the widest way first. `level` [HU] is what a lumen is expected to have at each voxel.
/// A part is not entered, and so counts as another vessel, where
/// - the contact is narrower than `neck` [mm], or the part is wider than 1.5 times the narrowest
///   place on the way to it and a millimetre: arteries taper;
/// - its level is that of another vessel: darker by more than 12 % of the contrast or brighter by
///   more than 20 %, and by three standard errors (by half as much, if it is also wider than 1.3
///   times the contact); blur is allowed for;
/// - behind more than 60 % of its boundary the values stay high or bone begins, which is
///   beyond lumen in pieces of 5 ml, with 800 HU somewhere: it lies in an organ or is marrow (of 75
///   %, where the ways' vessel goes on in it, through a contact of three quarters of both depths).
/// A part with less volume than the ball that fits in there belongs to what it touches most widely.
/// The level is followed from part to part over 10 mm, in branches down by at most 1 % of the
/// contrast in 10 mm: into a vein it would follow the vein. Parts on the ways have their own.
VesselParts divide_vessels(const LumenField& field, const Labels& mask,
                           const std::vector<float>& depth, const std::vector<float>& level,
                           const std::vector<std::vector<WayLevel>>& ways, double neck);

}  // namespace wireplan::preprocess
