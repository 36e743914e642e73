#pragma once
/// Energy and derivatives of the whole wire, and what its supports take out of them.
#include "simulate/equilibrium/elements.h"
#include "simulate/equilibrium/sinks.h"
#include "simulate/equilibrium/tool_elements.h"
#include "simulate/wire/twist_chain.h"

namespace wireplan::simulate {

/// All elements that touch a free node, apart from contact with a vessel and the twist of a chain.
template <class Sink>
Energy assemble(const Problem& problem, const RodState& state, Sink& sink,
                const TwistChain& chain = {}) {
  const Rod& rod = *problem.rod;
  const int n = rod.nodes();
  Energy energy;
  if constexpr (requires { sink.add_wire(rod, state); }) {
    const WirePass::Energy wire = sink.add_wire(rod, state);
    energy.stretch = wire.stretch;
    energy.bend = wire.bend;
  } else {
    for (int i = std::max(0, problem.first - 1); i <= std::min(n - 2, problem.last - 1); ++i) {
      energy.stretch += add_stretch(problem, state, i, sink);
    }
    for (int i = std::max(1, problem.first - 1); i <= std::min(n - 2, problem.last); ++i) {
      energy.bend += add_bend(problem, state, i, sink);
    }
  }
  if (problem.first == 0 && problem.proximal.tangent) {
    energy.bend +=
        add_clamp(state, 0, rod.rest_length[0], rod.proximal_bend, *problem.proximal.tangent, sink);
  }
  if (problem.last == n && problem.distal.tangent) {
    energy.bend += add_clamp(state, n - 2, rod.rest_length[n - 2], rod.distal_bend,
                             *problem.distal.tangent, sink);
  }
  if (problem.tools != nullptr) {
    add_tools(problem, state, chain, sink, energy);
  } else if (rod.twisted) {
    for (int i = std::max(1, problem.first - 1); i <= std::min(n - 2, problem.last); ++i) {
      if (chain.has(i)) continue;  // it has no shape either
      energy.twist += add_twist(rod.twist[i], state, i, sink);
      if (rod.rest_angle[i] != 0.0) energy.bend += add_rest_bend(problem, state, i, sink);
      if (rod.strip[i] != 0.0) energy.bend += add_strip(problem, state, i, sink);
    }
    if (problem.first == 0 && problem.proximal.tangent) {
      energy.bend += add_clamp_shape(problem, state, 0, *problem.proximal.tangent, sink);
    }
    if (problem.last == n && problem.distal.tangent) {
      energy.bend += add_clamp_shape(problem, state, n - 2, *problem.distal.tangent, sink);
    }
  }
  if (problem.load != nullptr) {
    for (int i = problem.first; i < problem.last; ++i) {
      const Vec3 f = problem.load->col(i);
      sink.gradient(i, -f);
      energy.load -= f.dot(state.x.col(i));
    }
  }
  if (problem.springs != nullptr) {
    for (int i = problem.first; i < problem.last; ++i) {
      energy.load += add_spring(*problem.springs, state, i, sink);
    }
  }
  if (problem.plane) {
    for (int i = std::max(1, problem.first); i < problem.last; ++i) {
      energy.contact += add_plane(problem, state, i, sink);
    }
  }
  if (problem.tip_moment) energy.load += add_tip_moment(problem, state, sink);
  return energy;
}

/// The straight shaft whose twist is one spring, of a wire out of an introducer or of the one tool
/// that twists. None where cross-sections of the vessel move. Of tools in a vessel alone: saddles
/// are left along modes of the whole Hessian.
inline TwistChain find_chain_of(const Problem& problem, const RodState& state) {
  const bool moves = problem.contact != nullptr && problem.contact->chain() != nullptr;
  if (problem.twists() != 1 || moves || problem.last < problem.rod->nodes()) return {};
  if (problem.tools == nullptr) {
    return problem.first > 0 ? find_chain(*problem.rod, problem.first, state) : TwistChain{};
  }
  const bool rolls = problem.proximal.hold_roll || problem.distal.hold_roll;
  if (problem.first > 0 || problem.contact == nullptr || rolls) return {};
  return find_chain(*problem.tools);
}

inline void spread_chain(const TwistChain& chain, const Problem& problem, RodState& state) {
  const ToolTerms* tools = problem.tools;
  const auto twist = [&](int i) {
    return tools != nullptr ? tools->twist(0, i) : problem.rod->twist[i];
  };
  spread_chain(chain, twist, state);
}

/// Takes what a support holds out of the Hessian: rows and columns of block k are projected and the
/// held directions get a unit pivot.
template <int D>
void hold(const Mat3& P, bool hold_theta, int k, BlockBand<D>& H) {
  typename BlockBand<D>::Block Q = BlockBand<D>::Block::Identity();
  Q.template topLeftCorner<3, 3>() = P;
  if (hold_theta) {
    for (int r = 3; r < D; ++r) Q(r, r) = 0.0;
  }
  H.own(k) = (Q * H.own(k).template selfadjointView<Eigen::Lower>() * Q).eval();
  H.own(k) += BlockBand<D>::Block::Identity() - Q;
  if (k >= 1) H.one(k) = (Q * H.one(k)).eval();
  if (k >= 2) H.two(k) = (Q * H.two(k)).eval();
  if (k + 1 < H.size()) H.one(k + 1) = (H.one(k + 1) * Q).eval();
  if (k + 2 < H.size()) H.two(k + 2) = (H.two(k + 2) * Q).eval();
}

/// The same out of what couples nodes with sections.
inline void hold_sections(const Problem& problem, SectionBlocks& blocks) {
  const int n = problem.rod->nodes();
  if (problem.first == 0) blocks.project(0, free_directions(problem.proximal));
  if (problem.last == n) {
    blocks.project(n - 1 - problem.first, free_directions(problem.distal));
  }
}

/// Takes what the supports hold out of a vector of the free nodes.
template <int D>
void project(const Problem& problem, Eigen::VectorXd& v) {
  const int n = problem.rod->nodes();
  const auto project_end = [&](const EndSupport& support, int node, int edge) {
    v.segment<3>(D * node) = (free_directions(support) * v.segment<3>(D * node)).eval();
    if (D > 3 && support.hold_roll && edge >= 0) v.segment<D - 3>(D * edge + 3).setZero();
  };
  if (problem.first == 0) project_end(problem.proximal, 0, 0);
  if (problem.last == n) project_end(problem.distal, n - 1 - problem.first, n - 2 - problem.first);
}

/// And out of their Hessian.
template <int D>
void apply_supports(const Problem& problem, BlockBand<D>& H) {
  const int n = problem.rod->nodes();
  if (problem.first == 0) {
    hold<D>(free_directions(problem.proximal), problem.proximal.hold_roll, 0, H);
  }
  if (problem.last == n) {
    hold<D>(free_directions(problem.distal), true, n - 1 - problem.first, H);  // no edge n-1
    if (D > 3 && problem.distal.hold_roll && n - 2 >= problem.first) {
      hold<D>(Mat3::Identity(), true, n - 2 - problem.first, H);
    }
  }
}

}  // namespace wireplan::simulate
