#pragma once
/// How the wall yields: paper section 1.5 and Eq. (16), linear tetrahedra between the lumen's
/// surface and fixed outer nodes, seen from the forces that a wire puts on the surface.
#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <atomic>
#include <cstddef>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::simulate {

/// K of paper Eq. (16): forces on the surface's vertices, x y z of each in turn (3v, 3v), per
/// displacement of them, the apexes fixed [N/mm]. Rows of vertices without a triangle are empty.
/// Isotropic and linear. Throws Error where a tetrahedron is flat or turned inward, or where Young
/// modulus or Poisson ratio are out of range.
Eigen::SparseMatrix<double> wall_stiffness(const Surface& surface, const Wall& wall);

/// The wall's stiffness, factored once per patient. The response to a unit force at a vertex is
/// found when first asked for, and kept. Shared by all trials and threads: an answer does not
/// depend on who asked first, and reading takes no lock.
class WallCompliance {
 public:
  /// A displacement counts as 0 where it is below this part of that under the force itself.
  static constexpr double kKeptFraction = 1e-8;

  /// Throws Error as `wall_stiffness` does, and where the factorisation does not solve it.
  WallCompliance(const Surface& surface, const Wall& wall);
  ~WallCompliance();
  WallCompliance(const WallCompliance&) = delete;
  WallCompliance& operator=(const WallCompliance&) = delete;

  /// How a force at a vertex is spread: half of it acts on the vertex, half on the vertices joined
  /// to it by an edge. Without that the wall would be softer at a vertex than between vertices. A
  /// force on a point within a triangle goes to the three vertices first, by the point's weights.
  /// The motion of a point is the mean of the same vertices' motions with the same parts.
  struct Part {
    int vertex;
    double part;
  };
  std::vector<Part> spread(int vertex) const;

  /// y = L^-1 f for a unit outward normal force f at a vertex, where K = L L'. This is half of the
  /// way to the displacements K^-1 f, and enough for `between`. y is 0 but at ancestors of the
  /// force's vertices in the elimination tree; ancestors far away, where it is next to nothing, are
  /// left out.
  struct HalfResponse {
    std::vector<int> places;  // in the order of elimination, ascending
    Eigen::Matrix3Xd values;  // (3, places)                                          [sqrt(mm/N)]
    int own;                  // which of the places is the vertex's
    int above;                // ancestors of the last place
    double compliance;        // c_a, displacement under the force                         [mm/N]
  };
  /// Expects a vertex with a triangle. The reference stays good as long as this object.
  const HalfResponse& half_response(int vertex) const;

  /// Outward normal displacement at one vertex under a unit outward normal force at another, both
  /// spread: c_ab = y_a . y_b, which is the sum over spread(a) and spread(b) of n . (K^-1 n), n the
  /// vertices' normals [mm/N]. c_ab and c_ba are the same to the bit. 0 where it is less than
  /// kKeptFraction of both c_a and c_b.
  static double between(const HalfResponse& a, const HalfResponse& b);

  /// Displacements (3, v) under forces (3, v) on the vertices, by the factorisation alone [mm, N].
  /// Vertices without a triangle stay, whatever their force.
  Eigen::Matrix3Xd displacements(const Eigen::Matrix3Xd& forces) const;

  /// Vertices further apart than this do not feel each other's forces: `between` is 0 [mm].
  double reach() const { return reach_; }

  const Eigen::Matrix3Xd& vertices() const { return vertices_; }  // (3, v)             [mm]
  /// Outward unit normals of the vertices (3, v), angle-weighted; 0 without a triangle.
  const Eigen::Matrix3Xd& normals() const { return normals_; }

  std::size_t response_count() const { return response_count_; }  // found so far
  /// Of the factor and of the responses found so far.
  std::size_t memory_bytes() const;

 private:
  using Cholesky =
      Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>;
  template <class Visit>
  void for_each_part(int vertex, Visit&& visit) const;  // of its spread
  HalfResponse find_response(int vertex) const;
  double find_reach() const;
  Eigen::Matrix3Xd vertices_, normals_;
  std::vector<int> neighbour_start_, neighbour_;  // vertices joined to each by an edge, and itself
  std::vector<int> place_;                        // of each vertex in the factor; -1: no triangle
  Cholesky cholesky_;
  double reach_ = 0.0;  //                                                              [mm]
  mutable std::vector<std::atomic<const HalfResponse*>> responses_;  // owned; null: not found yet
  mutable std::atomic<std::size_t> response_count_ = 0, response_bytes_ = 0;
};

}  // namespace wireplan::simulate
