#pragma once
/// What the way from access to target is like, by its centerline alone: how narrow, how tortuous,
/// where vessels leave it and how far in that is. No wire is simulated for it.
#include <string>
#include <vector>

#include "preprocess/vessel.h"
#include "simulate/insertion/way.h"

namespace wireplan::plan {

/// Where an arc length [mm] is on a line of at least two points: this part, 0 to 1, of the way from
/// one point to the next; the end where it is beyond one.
struct LinePart {
  Eigen::Index before = 0;
  double part = 0.0;
};
LinePart find_part(const Centerline& line, double arc);

/// The point of a line there.
Vec3 point_at(const Centerline& line, double arc);

double length_of(const Centerline& line);  //                                              [mm]

struct Narrowest {
  double diameter = 0.0;      // of the inscribed sphere                                   [mm]
  double arc = 0.0;           //                                                           [mm]
  Vec3 point = Vec3::Zero();  //                                                           [mm]
};

/// Where the first `length` mm of the way are narrowest. A sphere at an end of the line touches the
/// vessel's cap and not its side, so points within their own radius of an end do not count, where
/// others are left.
Narrowest find_narrowest(const Centerline& way, double length);

/// Length of the line over the distance between its ends; infinite where the line is closed.
double tortuosity(const Centerline& way);

/// Where another vessel leaves the way or the way leaves a vessel.
struct Junction {
  int trunk = -1;             // branch of the tree that goes on ...
  int branch = -1;            // ... and the one that leaves it there
  bool taken = false;         // the way leaves the trunk for the branch; else it passes the branch
  bool bifurcation = false;   // of the aorta (simulate::Bifurcation); also where the way crosses it
  bool entered = false;       // taken out of a branch into a wider vessel (simulate::is_entered):
                              // trunk and trunk_direction are those of the branch, coming in
  int fork = -1;              // branch of the tree that begins there
  double arc = 0.0;           // of the ostium, along the way; of one passed its level     [mm]
  Vec3 point = Vec3::Zero();  // there                                                     [mm]
  double level = 0.0;         // how far along the trunk from the access the ostium is     [mm]
  double radius = 0.0;        // of the branch's lumen in the ostium                       [mm]
  /// Unit vectors from the ostium: where the trunk goes on, and where the branch goes.
  Vec3 trunk_direction = Vec3::UnitZ(), branch_direction = Vec3::UnitX();
};

/// By how much the branch turns from the trunk [rad].
double turn_of(const Junction& junction);

/// The vessel that leaves, by the name of its part there; where a vessel parts and the way's part
/// is called as before, by the other too: "branch 1, past branch 11".
std::string leaving_name(const std::vector<preprocess::Branch>& tree, const Junction& junction);

/// The vessel that it leaves, by the name of its part there.
std::string trunk_name(const std::vector<preprocess::Branch>& tree, const Junction& junction);

/// All along the way, nearest first; none without a tree, and none of stumps, of ostia whose level
/// is before the access, or passed by beyond the target. It leaves a trunk where it changes from
/// one branch of the tree to another, unless that is the trunk, and where the trunk is another
/// branch than the one that it stays in: the vessel that goes on (simulate::goes_on) and is wider
/// by a third, since a tree's first branch may well end in a small artery, or goes straight on
/// (simulate::goes_straight_on). The ostium is where the branch's line leaves the trunk's inscribed
/// spheres, whether the way takes it or passes it; its level is the place of the trunk's axis
/// nearest to it, as lengths between ostia are measured for stent grafts (Chassin-Trubert et al., J
/// Endovasc Ther 2020, from centre to centre along the aorta), so that ostia which face each other
/// have one. The trunk's direction is that of a chord of two of its diameters round the ostium, the
/// branch's that of its first three radii, at least 6 mm, without a sixth at either end: a line
/// crosses the trunk at right angles, and settles in an oblique branch only beyond the ostium.
/// Where the trunk parts into arteries of like width (simulate::parts), and where the way goes from
/// one leg into the other of two that meet in a wider vessel, the trunk's direction is that before
/// the fork. A turn into a stem and one out of it at the same level are one, out of the trunk. A
/// way out of a branch into a wider vessel turns into that; the ostium is then where it
/// comes into the vessel's spheres, and the level where it comes to its axis. Expects a tree that
/// starts where the way does, as find_tree() makes it.
std::vector<Junction> find_junctions(const simulate::Way& of);

/// From there on a bend is none to speak of: noise turns its plane and moves its place.
inline constexpr double kNoBend = 170.0 * kRadPerDeg;

struct Corner {
  double angle = kPi;         // between the arms, pi where the way is straight            [rad]
  double arc = 0.0;           // of the corner                                             [mm]
  Vec3 point = Vec3::Zero();  //                                                           [mm]
  double arm = 0.0;           // length of both, along the way                             [mm]
  Vec3 before = Vec3::UnitZ(), behind = Vec3::UnitZ();  // unit, of the arms, onward
};

/// Where the chords of the points `arm` before and behind make the smallest angle; the angle told
/// is that between the arms without their first and last 15 %, since a middle line rounds corners.
/// Of a circle of radius R that is pi - arm/R. The arm is at most a third of the way. The turn into
/// a branch is one corner, at the level of its ostium: the arms begin where the line has not yet
/// left the trunk's axis, a radius of the branch before that, and where it has settled in the
/// branch.
Corner find_sharpest_bend(const Centerline& way, const std::vector<Junction>& junctions = {},
                          double arm = 20.0);

}  // namespace wireplan::plan
