#pragma once
/// How often a curve winds round itself.
#include "preprocess/base.h"

namespace wireplan::simulate {

/// Gauss's double integral over the edges of an open curve, exact for straight edges: Klenin and
/// Langowski, Biopolymers 2000;54:307, method 1a. With the twist it adds up to what the ends are
/// rolled against each other, but for less than a turn by which the ends do not close the curve.
/// Nodes are (3, n) [rad].
double find_writhe(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes);

}  // namespace wireplan::simulate
