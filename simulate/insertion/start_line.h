#pragma once
/// A line that a wire is to start from, as somebody measured or drew it.
#include <Eigen/Core>

#include "preprocess/base.h"
#include "simulate/wall/lumen.h"

namespace wireplan::simulate {

/// Points at any spacing, proximal to distal; perhaps a little through the wall, or from behind
/// the introducer's point on.
struct StartLine {
  Eigen::Matrix3Xd nodes;  // (3, k), at least 2                                         [mm]
  double length = 0.0;     // of wire in the vessel; 0: that of the line from the entry on  [mm]
  bool find_roll = false;  // whether the hub is rolled as the line bends where the wire is curved
                           // at rest, in the place of the introducer's roll
};

double arc_length(const Eigen::Matrix3Xd& line);  //                                     [mm]

/// The line's part beyond its place nearest to the entry, which becomes its first point.
Eigen::Matrix3Xd line_from_entry(const Eigen::Matrix3Xd& line, const Vec3& entry);

/// A place on a line of points: so much of the edge beyond the point `before`.
struct PlaceOnLine {
  Eigen::Index before = 0;
  double part = 0.0;  // above 1 on the extension of the last edge
};
PlaceOnLine place_at_arc(const Eigen::Matrix3Xd& line, double arc);
Vec3 point_on(const Eigen::Matrix3Xd& line, const PlaceOnLine& place);

/// Point of the line at an arc length; on its last edge's extension beyond its end.
Vec3 point_at_arc(const Eigen::Matrix3Xd& line, double arc);

/// The line from its start to the point at an arc length, at least its first edge's start and end.
Eigen::Matrix3Xd line_up_to(const Eigen::Matrix3Xd& line, double arc);

/// Moves points from `first` on that are nearer to the wall than the radius, or through it, to that
/// distance from it. Those beyond the field of the lumen first come to it, straight toward the last
/// point that is not, or the next one.
void bring_into_lumen(const Lumen& lumen, double radius, int first, Eigen::Matrix3Xd& points);

/// How the points of one line lie from another: mean and largest of the distances to its nearest
/// place, both ways, each point for its share of length; and of the last points from each other.
struct LineDistance {
  double mean = 0.0, largest = 0.0, tip = 0.0;  //                                       [mm]
};
LineDistance find_distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

/// The point of the line nearest to a point.
Vec3 nearest_on_line(const Eigen::Matrix3Xd& line, const Vec3& point);

}  // namespace wireplan::simulate
