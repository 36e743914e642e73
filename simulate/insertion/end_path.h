#pragma once
/// How the end of a wire is brought from its unloaded shape to a support far from there, so that
/// the wire bends on the way and is never crushed: where the end is at each part of the way, and a
/// guess of how the wire follows it.
#include <optional>

#include "simulate/wire/rod.h"

namespace wireplan::simulate {

/// How an end path starts and ends, and what of it is held.
struct EndPathEnds {
  Vec3 start_point = Vec3::Zero();       // of the proximal support                             [mm]
  bool start_is_directed = true;         // it holds the wire's direction and roll
  Vec3 start_direction = Vec3::UnitX();  // unit
  Vec3 point = Vec3::Zero();             // of the distal support                               [mm]
  bool is_directed = true;               // it holds the end's direction and roll
  bool slides = false;                   // the end is free along that direction
  Vec3 direction = Vec3::UnitX();        // unit
  double roll = 0.0;          // beyond that of the unloaded wire, all turns counted  [rad]
  std::optional<Vec3> plane;  // unit normal of a table that the wire lies on
};

/// The way of the distal end, by its parts from 0, the unloaded wire, to 1, where it is held. The
/// end turns evenly about one axis, the shortest way, and goes as if the wire were bent evenly by
/// that turn. What is left over is added in proportion to the part; but along the wire with its
/// square, since a wire gets shorter with the square of what it is bent by. Of a turn by 180
/// degrees the axis is the table's normal where there is one, else square to the end's direction
/// and to the line from the proximal support to the distal one.
///
/// The roll of the end counts from the unloaded material director, turned with the end.
class EndPath {
 public:
  /// Keeps a reference to the rod. `unloaded` is its rest shape on the proximal support.
  EndPath(const Rod& rod, const RodState& unloaded, const EndPathEnds& ends);

  /// Whether the end is turned by more than 10 degrees, or moved by more than 5 % of the wire.
  bool is_far() const { return is_far_; }
  /// The part of the way that one step may take at most.
  double longest_step() const;
  /// Unit tangent at the very end, half a bend element beyond the last edge.
  Vec3 direction(double part) const;

  /// A wire on the way: its equilibrium, at which part, and the one before where there is one.
  struct Progress {
    RodState now, before;
    double part = 0.0, part_before = 0.0;
  };
  /// Where the wire may be at a later part: it goes on as it went, and is then bent to the end's
  /// new place by the least bending energy. Edges keep their lengths, unless the end is out of
  /// reach. The theta of a held end is the one that its roll asks for.
  RodState guess(const Progress& progress, double part) const;
  /// Turns the edges of held ends about themselves to what their rolls ask for, and the others as
  /// torsion spreads it; the largest turn [rad]. Directors follow their edge: where that went round
  /// in circles on the way, the rolls are off.
  double correct_rolls(double part, RodState& state) const;

 private:
  Vec3 point(double part) const;
  Vec3 rolled_end(double turn) const;
  Vec3 material_at(double part) const;
  double arc_to_middle(int edge) const;

  const Rod& rod_;
  EndPathEnds ends_;
  Vec3 start_ = Vec3::Zero();      // of the unloaded wire                                  [mm]
  Eigen::Matrix3Xd edges_;         // (3, n-1) of the unloaded wire                         [mm]
  Vec3 direction_, material_;      // of its end; unit
  Vec3 start_material_;            // material director where the wire starts, unit
  Vec3 axis_ = Vec3::UnitZ();      // of the end's turn, unit
  double turn_ = 0.0;              //                                                      [rad]
  Vec3 left_along_, left_across_;  // what the turn alone does not reach                    [mm]
  bool is_far_ = false;
};

/// Turns the last edge about itself by `turn`, and those before it, but the first, as torsion
/// spreads that.
void spread_turn(const Rod& rod, double turn, RodState& state);

}  // namespace wireplan::simulate
