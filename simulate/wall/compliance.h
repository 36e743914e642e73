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

/// The wall's stiffness, factored once per patient; what unit forces do to it is found when first
/// asked for and kept. Shared by all trials and threads: every answer is the same whoever asks
/// first, and reading takes no lock.
class WallCompliance {
 public:
  /// Displacements below this part of those under the forces themselves count as none.
  static constexpr double kKeptFraction = 1e-8;

  /// Throws Error as `wall_stiffness` does, and where the factorisation does not solve it.
  WallCompliance(const Surface& surface, const Wall& wall);
  ~WallCompliance();
  WallCompliance(const WallCompliance&) = delete;
  WallCompliance& operator=(const WallCompliance&) = delete;

  /// A force on a point of the surface acts on the vertices of its triangle and, so that the wall
  /// is not softer at a vertex than between them, on those joined to them: half of a vertex's part
  /// on itself, half on its neighbours. The motion of a point is the mean of theirs in the same
  /// way.
  struct Part {
    int vertex;
    double part;
  };
  std::vector<Part> spread(int vertex) const;

  /// y = L^-1 f of a unit outward normal force on a point at a vertex, K = L L': half of the way to
  /// the displacements, and all that their scalar products need. It is 0 but at ancestors of the
  /// force's vertices in the elimination tree, and next to nothing at those far away, which are
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

  /// Normal displacement of a point at a vertex, outward, under a unit outward normal force on a
  /// point at another: c_ab = sum over spread(a) and spread(b) of n . (K^-1 n), n the vertices'
  /// normals, = y_a . y_b [mm/N]. The same to the bit from a to b and back. 0 where it is less than
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
