#pragma once
/// Leaks: what a mask holds besides the vessel that the seeds lie in.
#include <cstddef>
#include <vector>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// A part of the mask that was cut off.
struct Leak {
  Vec3 place = Vec3::Zero();    // where it was cut from the vessel                          [mm]
  double neck_radius_mm = 0.0;  // of the contact: inscribed radius there                    [mm]
  double radius_mm = 0.0;       // largest inscribed radius behind it                        [mm]
  double volume_mm3 = 0.0;
  double mean_hu = 0.0;          //                                                           [HU]
  double bright_fraction = 0.0;  // of its boundary that lies against values above the band: bone
};

/// The way from the first seed to the others through the middle of the vessel.
struct Route {
  std::vector<Vec3> points;          // from the first seed to the last, smoothed          [mm]
  double length_mm = 0.0;            // of these
  double narrowest_radius_mm = 0.0;  // least inscribed radius on all ways
  Vec3 narrowest = Vec3::Zero();     // where                                                [mm]
};

struct LeakSearch {
  Route route;
  std::vector<Leak> leaks;  // largest first
};

/// Cuts from `labels` (1 inside) what cannot be the artery of the seeds. Arteries taper: a branch
/// is nowhere wider than where it was entered.
///   1. The ways between the seeds are trusted.
///   2. From these, the widest way to each voxel is found: the one whose narrowest place has the
///      largest inscribed radius.
///   3. A voxel whose own inscribed radius is more than twice that of this narrowest place, and a
///      millimetre more, lies behind a neck: in a vein, an organ, the heart or a bone.
///   4. The cut is made in the neck: both sides flood the mask from wide to narrow until they meet.
/// A seed beyond a real neck (a stenosis before an aneurysm) keeps what lies there, by step 1.
/// `seeds` are labelled voxels, `values` [HU] those of the grid, `upper` the end of the band. Seeds
/// that no way joins each start a vessel of their own. Where the ways are known, `known.ways` are
/// trusted in the place of step 1; what `known.other` labels counts as found by step 3, and what
/// `known.own` labels starts a flood of step 4 as the ways do.
struct KnownParts {
  const std::vector<std::size_t>& ways;
  const Labels& own;
  const Labels& other;
};
LeakSearch cut_leaks(const Grid& grid, const std::vector<float>& values, double upper,
                     const std::vector<std::size_t>& seeds, Labels& labels,
                     const KnownParts* known = nullptr);

/// The ways of step 1 alone.
Route find_route(const Grid& grid, const std::vector<std::size_t>& seeds, const Labels& labels);

/// Inscribed radius of each labelled voxel, to the faces of the nearest others [mm]; 0 outside.
std::vector<float> measure_depth(const Grid& grid, const Labels& labels);

/// A line of neighbouring voxels without its zigzag: each point is thrice replaced by the mean of
/// the seven round it, the ends stay.
std::vector<Vec3> smooth_line(std::vector<Vec3> points);

double length_of_line(const std::vector<Vec3>& points);

/// Share of the boundary faces of the mask behind which, one or two voxels on, the values [HU] lie
/// above `upper`: about 1 inside a bone's shell, small in an artery with plaque.
double bright_boundary(const Grid& grid, const std::vector<float>& values, double upper,
                       const Labels& labels);

}  // namespace wireplan::preprocess
