#pragma once
/// Memory that solves reuse, so that none allocates. Private to the solver.
#include <Eigen/Core>

#include "simulate/wire/block_band.h"
#include "simulate/wire/moving_band.h"
#include "simulate/wire/rod.h"
#include "simulate/wire/twist_chain.h"
#include "simulate/wire/wire_pass.h"

namespace wireplan::simulate {

/// Of D unknowns per node.
template <int D>
struct BandMemory {
  BlockBand<D> hessian, factored;
};

struct SolveMemory {
  WirePass pass;
  UnsymmetricBand unsymmetric;
  CoupledChain coupled;
  SectionBlocks sections;  // and wire, where cross-sections move
  MovingBand moving;
  RodState trial;                                  // where a step leads
  Eigen::VectorXd gradient, step;                  // of the free nodes
  Eigen::VectorXd first_step, refined, direction;  // of refine_step() and longer steps
  Eigen::MatrixXd krylov;
};

}  // namespace wireplan::simulate
