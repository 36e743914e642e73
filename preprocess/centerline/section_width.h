#pragma once
/// Cross-sections of the vessel across a line in its middle: how wide they are, and what else runs
/// through them.
#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// Of each point of the line the diameter [mm] of a circle as large as the vessel's cross-section
/// there, as a radiologist measures it; mean over 1.5 mm of line to either side. The inscribed
/// sphere, which touches the deepest dent of the noise, is some per cent thinner. Where no closed
/// cut goes round the point, it is the sphere's. The cut is across the chord of one radius (1 mm at
/// least) to either side, or tilted from that where it has a tenth less area so: where a line turns
/// from one vessel into another its chord runs across both. What of it lies in the mouth of a
/// branch does not count: where, seen from the point, the wall turns away steeply and comes back
/// within 150 degrees. Of a lumen bent like a crescent that is an arm, so it comes out narrower.
/// Where a section is over a fifth wider, as a part of its inscribed sphere, than those within 20
/// mm in the median, it is open, as where the line leaves one vessel for another: there the sphere
/// counts, with the median's part.
/// Expects a line of two points or more.
Eigen::VectorXd section_diameters(const Surface& surface, const Centerline& line);

/// Whether the vessel's cross-section at point k of `line`, across the chord as above, has `other`
/// in it too: the two run in one lumen there. False where no closed cut goes round the point.
bool shares_section(const Surface& surface, const Centerline& line, Eigen::Index k,
                    const Centerline& other);

}  // namespace wireplan::preprocess
