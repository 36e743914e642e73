#pragma once
/// Bending a wire, without stretching it, to where its end is to be.
#include <optional>

#include "simulate/wire/rod.h"

namespace wireplan::simulate {

/// Which ends of the wire are held in their direction; each is held in its place.
struct DirectedEnds {
  bool start = true, end = true;
};

/// A wire as edges that are turned.
struct BentWire {
  Vec3 start = Vec3::Zero();           //                                                  [mm]
  Eigen::Matrix3Xd edges;              // (3, n-1)                                         [mm]
  Vec3 end_direction = Vec3::UnitX();  // unit tangent half a bend element beyond the last edge

  Vec3 end() const { return start + edges.rowwise().sum(); }
};

Mat3 rotation_by(const Vec3& vector);  // about it, by its length                           [rad]

/// Rotation vectors (3, n) of the edges, and of the end's direction, that to first order move the
/// end by `gap` and turn its direction by `turn`, and whose differences from edge to edge take the
/// least bending energy. They are those of a force F and a couple C on the end, with the moment
/// C + arm x F at each node; a start that holds no direction turns by itself, so that there is no
/// moment. Along a straight wire nothing moves.
Eigen::Matrix3Xd find_least_bending(const Rod& rod, const DirectedEnds& ends,
                                    const Eigen::Matrix3Xd& edges, const Vec3& gap,
                                    const Vec3& turn);

/// Turns edges so, again and again, until the wire ends at the point, with the direction if that is
/// held. False where it never does, as for an end out of reach; it is then somewhere on the way.
bool bend_to(const Rod& rod, const DirectedEnds& ends, const Vec3& point, const Vec3& direction,
             BentWire& wire);

/// Bends a chain of nodes so that it ends at the point, with its last half element as it is, by
/// turns of its edges of no more than `most` [rad]; where it would take more, nothing is done.
void bend_end_to(const Rod& rod, const DirectedEnds& ends, const Vec3& point, double most,
                 Eigen::Ref<Eigen::Matrix3Xd> x);

/// A straight wire whose end comes nearer to its start by more than its sideways move explains gets
/// the shape of a clamped column that buckles, as much shorter: in the plane where there is one,
/// else toward reference_normal(). Others stay as they are.
void buckle_column(const Rod& rod, const Vec3& point, const std::optional<Vec3>& plane,
                   BentWire& wire);

}  // namespace wireplan::simulate
