#pragma once
/// The lumen round known ways, by the levels that hold at each place of them.
#include <cstddef>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment_leak.h"
#include "preprocess/segment/segment_way.h"

namespace wireplan::preprocess {

struct LocalLumen {
  Labels labels;               // 1 in the arteries
  Labels other;                // 1 in what touches them
  std::vector<Leak> leaks;     // what touches them and was cut, largest first
  std::vector<Leak> doubtful;  // what was kept, though it may be a vein
  std::vector<Leak> branches;  // thin or little filled, kept by their shape
};

/// The arteries that the ways run in, with their branches.
///   1. Each candidate is held against the level of the way that it is nearest to: what has the
///      core's part of that contrast is core, within 3 mm of a way also what has as much as the way
///      itself. Specks of noise in it are filled.
///   2. Parts of it that are other vessels or organs (vessel_parts.h) and leaks (segment_leak.h)
///      are cut from it, in the neck; the balls that fit in round the ways stay, as far as they lie
///      in the ways' own parts.
///   3. Two layers of voxels are added to either, down to 40 % of the contrast (smoothing makes
///      vessels thinner) to what lies there, one and two voxels on, before fat to what blur leaves
///      there of a wall of 0.9 mm; between an artery and what was
///      cut a voxel goes to the nearer, or to the one whose level it is nearer to.
///   4. Side branches that are too thin or too little filled for this are added (side_branches.h).
/// `seeds` are voxels on the ways; contacts narrower than `neck` [mm] connect nothing. Throws
/// `Error` where the core is more complicated than what a vessel may be (require_no_flood).
LocalLumen find_local_lumen(const LumenField& field, const Candidates& candidates,
                            const std::vector<std::vector<WayLevel>>& ways,
                            const std::vector<std::size_t>& seeds, double neck,
                            const MaskLimits& limits);

}  // namespace wireplan::preprocess
