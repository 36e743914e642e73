#pragma once
/// The vessel as preprocess hands it on: plain data that needs Eigen alone, so that simulate and
/// plan build without ITK, VTK or CGAL. Points in mm, patient LPS.
#include <Eigen/Core>

#include "preprocess/base.h"

namespace wireplan {

/// The inner (lumen) surface of the arteries: closed, manifold, oriented, free of
/// self-intersections once `preprocess::require_sound` has passed it.
struct Surface {
  Eigen::Matrix3Xd vertices;   // (3, v)                                                  [mm]
  Eigen::Matrix3Xi triangles;  // (3, m) vertex indices, counter-clockwise seen from outside
};

/// A line along the middle of the lumen, proximal (access) to distal (target).
struct Centerline {
  Eigen::Matrix3Xd points;     // (3, p)                                                  [mm]
  Eigen::VectorXd radius;      // (p)    of the largest inscribed sphere                  [mm]
  Eigen::VectorXd arc_length;  // (p)    counted from the access site                     [mm]
};

/// (p) arc length of each point of a line (3, p), counted from its first.                  [mm]
Eigen::VectorXd arc_length_of(const Eigen::Matrix3Xd& points);

/// The wall as paper section 1.5 extrudes it: tetrahedron k is triangle k of the surface and apex
/// k, which is fixed. `height` is the extrusion per triangle, smaller than the asked thickness
/// where an apex would come too near another part of the wall.
struct Wall {
  Eigen::Matrix3Xd apexes;     // (3, m)                                                 [mm]
  Eigen::VectorXd height;      // (m)                                                    [mm]
  double young_modulus = 0.0;  // effective value, references B2                         [MPa]
  double poisson_ratio = 0.0;  //                                                        [-]
};

struct Vessel {
  Surface surface;
  Centerline path;  // access to target
  Wall wall;
};

/// Outward unit normal of triangle k; zero where it has no area.
Vec3 unit_normal(const Surface& surface, Eigen::Index k);

/// (3, v) at each vertex the sum of its triangles' unit normals times their angles there: the sum's
/// direction does not depend on how the wall round the vertex is cut into triangles.
Eigen::Matrix3Xd angle_weighted_normals(const Surface& surface);

/// (3, v) unit: at each vertex the direction of the sum of its triangles' areas; not a number where
/// that is zero, as at a vertex of no triangle.
Eigen::Matrix3Xd area_weighted_normals(const Surface& surface);

/// Normal stiffness of the extruded wall per area, k_n = M/(3t) with M = E(1-nu)/((1+nu)(1-2nu))
/// [MPa/mm], for the thickness t [mm] (references B2).
inline double wall_normal_stiffness(double young_modulus, double poisson_ratio, double thickness) {
  const double modulus =
      young_modulus * (1.0 - poisson_ratio) / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
  return modulus / (3.0 * thickness);
}

}  // namespace wireplan
