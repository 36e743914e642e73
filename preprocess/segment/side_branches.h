#pragma once
/// Branches that are too thin or too little filled to have the level of the vessel that they leave.
#include <vector>

#include "preprocess/segment/segment_leak.h"
#include "preprocess/segment/segment_way.h"

namespace wireplan::preprocess {

/// Adds to `artery` the branches that show by their shape alone. From each contact of the artery
/// with voxels that have 65 % of its contrast there, and five times the noise, these are visited in
/// the order of their distance in them from the contact; then with 55 and with 45 %, where more
/// touches, thrice each at most, for what leaves or prolongs a branch. A branch is what goes on as
/// one piece of a steady cross-section for 12 mm and six of its radii, of three voxels at least,
/// and narrower than the artery (0.7 of its radius, or 2 mm; 2.5 mm with three quarters of its
/// contrast). Where what touches falls into pieces within 5 mm, each that is so bright is followed
/// by itself: a branch whose mouth touches something else. A vein that passes by goes on in two
/// directions, an organ widens, rims of bone lead back to the artery or are films, and veins that
/// end at it are wide. It is kept as far as it does so, and down to half of its own contrast.
/// `level` [HU] is that of the artery in its voxels; what is added takes its own, and leaves
/// `other`. Returns what was added, with the place of the contact, the radius of its cross-section
/// and the mean of the volume in it, the largest first.
std::vector<Leak> add_side_branches(const LumenField& field, std::vector<float>& level,
                                    Labels& artery, Labels& other);

}  // namespace wireplan::preprocess
