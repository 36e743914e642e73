#pragma once
/// The steps of `repair_surface`, one .cpp each; not for other folders. Each tells in `mends` what
/// it did, and names `origin` in its errors.
#include "preprocess/surface/surface_repair.h"

namespace wireplan::preprocess {

/// Any triangles -> manifold, consistently oriented ones, which may be open and of several pieces:
/// duplicates, fins and inner sheets dropped, contacts parted, neighbours' normals made to agree.
Surface make_manifold(Surface soup, const std::string& origin, std::vector<Mend>& mends);

/// Closes a manifold, oriented surface: small holes as smooth as their surroundings, ends at which
/// a vessel is cut by a cap across. Throws for holes that are neither.
Surface close_openings(const Surface& open, const std::string& origin, std::vector<Mend>& mends);

/// Makes triangles that cut each other anew, where that changes nothing else.
Surface without_intersections(const Surface& surface, std::vector<Mend>& mends);

/// The inner skin, turned to face outward from the lumen and open where the skins met, if the
/// closed surface is a thin wall with an inner and an outer skin; else the surface as it is.
Surface inner_skin(const Surface& closed, std::vector<Mend>& mends);

}  // namespace wireplan::preprocess
