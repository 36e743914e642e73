#pragma once
/// Numbers for tests, the same on every machine.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "simulate/equilibrium/dynamics.h"
#include "simulate/equilibrium/elements.h"
#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/scene.h"
#include "tests/shapes.h"
#include "tests/simulate/paper_wire.h"

namespace wireplan::simulate {

inline double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0;
}

}  // namespace wireplan::simulate
