#include "simulate/equilibrium/solver.h"

#include <Eigen/Geometry>
#include <Eigen/Jacobi>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/elements.h"
#include "simulate/wire/quartic.h"

namespace wireplan::simulate {

namespace {

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
  if (rod.twisted) {
    for (int i = std::max(1, problem.first - 1); i <= std::min(n - 2, problem.last); ++i) {
      if (chain.has(i)) continue;  // it has no shape either
      energy.twist += add_twist(problem, state, i, sink);
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
  if (problem.plane) {
    for (int i = std::max(1, problem.first); i < problem.last; ++i) {
      energy.contact += add_plane(problem, state, i, sink);
    }
  }
  if (problem.tip_moment) energy.load += add_tip_moment(problem, state, sink);
  return energy;
}

/// Energy and derivatives of a state with its own lag, contact included.
template <class Sink>
Energy assemble_with_contact(const Problem& problem, const RodState& state, Sink& sink) {
  Energy energy = assemble(problem, state, sink);
  if (problem.contact == nullptr) return energy;
  problem.contact->expect_nothing();
  problem.contact->begin(state.x);
  const ContactEnergy contact = problem.contact->refresh(true).energy;
  problem.contact->add(sink);
  energy.contact += contact.contact;
  energy.wall += contact.wall;
  return energy;
}

// ---------------------------------------------------------------- sinks

/// Energy alone.
struct EnergySink {
  static constexpr bool kHessian = false;
  void gradient(int, const Vec3&) {}
  void gradient_theta(int, double) {}
};

/// Sum of the gradient over the nodes and edges before `first`.
struct HeldSink {
  static constexpr bool kHessian = false;
  int first;
  HeldEnd sum = {};
  void gradient(int i, const Vec3& g) {
    if (i < first) sum.force += g;
  }
  void gradient_theta(int e, double g) {
    if (e < first) sum.torque += g;
  }
};

/// Gradient with respect to every node; no Hessian.
struct GradientSink {
  static constexpr bool kHessian = false;
  Eigen::Ref<Eigen::Matrix3Xd> target;
  void gradient(int i, const Vec3& g) { target.col(i) += g; }
  void gradient_theta(int, double) {}
};

/// Gradient and dense Hessian over all x, then all theta.
struct DenseSink {
  static constexpr bool kHessian = true;
  int n;
  Eigen::VectorXd& g;
  Eigen::MatrixXd& H;

  void gradient(int i, const Vec3& v) { g.segment<3>(3 * i) += v; }
  void gradient_theta(int e, double v) { g[3 * n + e] += v; }
  void hessian(int i, int j, const Mat3& block) {
    H.block<3, 3>(3 * i, 3 * j) += block;
    if (i != j) H.block<3, 3>(3 * j, 3 * i) += block.transpose();
  }
  void hessian_scaled(int i, int j, double scale, const Mat3& block) {
    hessian(i, j, scale * block);
  }
  void hessian_of_edge(int i, const Mat3& block) {
    hessian(i, i, block);
    hessian(i + 1, i + 1, block);
    hessian(i + 1, i, -block);
  }
  void hessian_scaled_identity(int i, int j, double v) { hessian(i, j, v * Mat3::Identity()); }
  void hessian_theta(int e, int i, const Vec3& v) {
    H.block<3, 1>(3 * i, 3 * n + e) += v;
    H.block<1, 3>(3 * n + e, 3 * i) += v.transpose();
  }
  void hessian_theta_theta(int e, int f, double v) {
    H(3 * n + e, 3 * n + f) += v;
    if (e != f) H(3 * n + f, 3 * n + e) += v;
  }
};

/// Gradient of the free nodes: block k holds x and, for D = 4, theta of node first + k.
template <int D>
struct FreeSink {
  static constexpr bool kHessian = false;
  int first, last;
  WirePass& pass;
  Eigen::VectorXd& g;

  bool is_free(int i) const { return i >= first && i < last; }
  void add_to(Eigen::VectorXd& vector, int i, const Vec3& v) {
    if (is_free(i)) vector.template segment<3>(D * (i - first)) += v;
  }
  void gradient(int i, const Vec3& v) { add_to(g, i, v); }
  void gradient_theta(int e, double v) {
    if (D == 4 && is_free(e)) g[D * (e - first) + 3] += v;
  }
  WirePass::Energy add_wire(const Rod& rod, const RodState& state) {
    return pass.add_gradient<D>(rod, first, last, state.x, g);
  }
};

/// And their banded Hessian.
template <int D>
struct BandSink : FreeSink<D> {
  static constexpr bool kHessian = true;
  using FreeSink<D>::first;
  using FreeSink<D>::is_free;
  BlockBand<D>& H;

  WirePass::Energy add_wire(const Rod& rod, const RodState& state) {
    const WirePass::Energy energy = FreeSink<D>::add_wire(rod, state);
    this->pass.set_hessian(H);
    return energy;
  }
  typename BlockBand<D>::Block& block(int i, int j) {  // i >= j
    return i == j ? H.own(i - first) : i == j + 1 ? H.one(i - first) : H.two(i - first);
  }
  void hessian(int i, int j, const Mat3& v) { hessian_scaled(i, j, 1.0, v); }
  void hessian_scaled(int i, int j, double scale, const Mat3& v) {
    if (!is_free(i) || !is_free(j)) return;
    auto& target = block(i, j);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) target(r, c) += scale * v(r, c);
    }
  }
  void hessian_of_edge(int i, const Mat3& v) {
    if (!is_free(i) || !is_free(i + 1)) {
      hessian(i, i, v);
      hessian(i + 1, i + 1, v);
      return;
    }
    auto& own = H.own(i - first);
    auto& next = H.own(i + 1 - first);
    auto& one = H.one(i + 1 - first);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) {
        own(r, c) += v(r, c);
        next(r, c) += v(r, c);
        one(r, c) -= v(r, c);
      }
    }
  }
  void hessian_scaled_identity(int i, int j, double v) {
    if (is_free(i) && is_free(j))
      block(i, j).template topLeftCorner<3, 3>().diagonal().array() += v;
  }
  void hessian_theta(int e, int i, const Vec3& v) {
    if constexpr (D == 4) {
      if (!is_free(e) || !is_free(i)) return;
      if (e >= i) {
        block(e, i).template block<1, 3>(3, 0) += v.transpose();
      }
      if (i >= e) {
        block(i, e).template block<3, 1>(0, 3) += v;
      }
    }
  }
  void hessian_theta_theta(int e, int f, double v) {
    if constexpr (D == 4) {
      if (is_free(e) && is_free(f)) block(e, f)(3, 3) += v;
    }
  }
};

// ---------------------------------------------------------------- supports

/// Takes what a support holds out of the Hessian: rows and columns of block k are projected and the
/// held directions get a unit pivot.
template <int D>
void hold(const Mat3& P, bool hold_theta, int k, BlockBand<D>& H) {
  typename BlockBand<D>::Block Q = BlockBand<D>::Block::Identity();
  Q.template topLeftCorner<3, 3>() = P;
  if constexpr (D == 4) {
    if (hold_theta) Q(3, 3) = 0.0;
  }
  H.own(k) = (Q * H.own(k).template selfadjointView<Eigen::Lower>() * Q).eval();
  H.own(k) += BlockBand<D>::Block::Identity() - Q;
  if (k >= 1) H.one(k) = (Q * H.one(k)).eval();
  if (k >= 2) H.two(k) = (Q * H.two(k)).eval();
  if (k + 1 < H.size()) H.one(k + 1) = (H.one(k + 1) * Q).eval();
  if (k + 2 < H.size()) H.two(k + 2) = (H.two(k + 2) * Q).eval();
}

/// Takes what the supports hold out of a vector of the free nodes.
template <int D>
void project(const Problem& problem, Eigen::VectorXd& v) {
  const int n = problem.rod->nodes();
  const auto project_end = [&](const EndSupport& support, int node, int edge) {
    v.segment<3>(D * node) = (free_directions(support) * v.segment<3>(D * node)).eval();
    if (D == 4 && support.hold_roll && edge >= 0) v[D * edge + 3] = 0.0;
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
    if (D == 4 && problem.distal.hold_roll && n - 2 >= problem.first) {
      hold<D>(Mat3::Identity(), true, n - 2 - problem.first, H);
    }
  }
}

// ---------------------------------------------------------------- line search

/// Energy along a step as far as it is a polynomial: all but contact, twist and moments.
template <int D>
Quartic elastic_along(const Problem& problem, const RodState& state, const Eigen::VectorXd& step) {
  const Rod& rod = *problem.rod;
  const int n = rod.nodes();
  const auto move = [&](int i) -> Vec3 {
    if (i < problem.first || i >= problem.last) return Vec3::Zero();
    return step.segment<3>(D * (i - problem.first));
  };
  Quartic q;
  for (int i = std::max(0, problem.first - 1); i <= std::min(n - 2, problem.last - 1); ++i) {
    const double l = rod.rest_length[i], k = rod.stretch[i] / (8.0 * l * l * l);
    const Vec3 e = state.x.col(i + 1) - state.x.col(i), p = move(i + 1) - move(i);
    const double A = e.squaredNorm() - l * l, B = 2.0 * e.dot(p), C = p.squaredNorm();
    q.a1 += k * 2.0 * A * B;
    q.a2 += k * (B * B + 2.0 * A * C);
    q.a3 += k * 2.0 * B * C;
    q.a4 += k * C * C;
  }
  const auto add_quadratic = [&q](double B, const Vec3& u, const Vec3& p) {
    q.a1 += B * u.dot(p);
    q.a2 += 0.5 * B * p.squaredNorm();
  };
  for (int i = std::max(1, problem.first - 1); i <= std::min(n - 2, problem.last); ++i) {
    const double a = 1.0 / rod.rest_length[i - 1], c = 1.0 / rod.rest_length[i], b = -(a + c);
    add_quadratic(rod.twisted ? rod.bend[i] * std::cos(rod.rest_angle[i]) : rod.bend[i],
                  a * state.x.col(i - 1) + b * state.x.col(i) + c * state.x.col(i + 1),
                  a * move(i - 1) + b * move(i) + c * move(i + 1));
  }
  const auto add_end = [&](int edge, double B, const Vec3& tangent) {
    const double l = rod.rest_length[edge];
    add_quadratic(B, (state.x.col(edge + 1) - state.x.col(edge)) / l - tangent,
                  (move(edge + 1) - move(edge)) / l);
  };
  if (problem.first == 0 && problem.proximal.tangent) {
    add_end(0, rod.proximal_bend, *problem.proximal.tangent);
  }
  if (problem.last == n && problem.distal.tangent) {
    add_end(n - 2, rod.distal_bend, *problem.distal.tangent);
  }
  if (problem.load != nullptr) {
    for (int i = problem.first; i < problem.last; ++i) q.a1 -= problem.load->col(i).dot(move(i));
  }
  return q;
}

/// A twisted rod's directors are carried along by parallel transport, which is lost where an edge
/// turns back: no edge changes by more than half of its length in one step.
template <int D>
double largest_turning_step(const Problem& problem, const Eigen::VectorXd& step) {
  double cap = std::numeric_limits<double>::infinity();
  for (int i = problem.first; i + 1 < problem.last; ++i) {
    const int k = D * (i - problem.first);
    const double change = (step.segment<3>(k + D) - step.segment<3>(k)).norm();
    const double allowed = 0.5 * problem.rod->rest_length[i];
    if (change > allowed) cap = std::min(cap, allowed / change);
  }
  return cap;
}

/// The step with second-order lengthening taken out: each edge gets the direction that the step
/// gives it, and the length whose tension is the one that the step predicts to first order. Nodes
/// are laid out anew from the proximal end; what that moves a held distal end by is spread over the
/// wire. A step that turns stiff edges by an angle a would else stretch them by a^2/2, and Newton
/// would spend its iterations on undoing that.
template <int D>
void turn_edges(const Problem& problem, const RodState& state, const Eigen::VectorXd& step,
                double s, RodState& trial) {
  constexpr double kTangent = 1e-7;  // up to here the root is its tangent, to 1e-15
  const Rod& rod = *problem.rod;
  const int n = rod.nodes();
  const auto move = [&](int i) -> Vec3 {
    if (i < problem.first || i >= problem.last) return Vec3::Zero();
    return s * step.segment<3>(D * (i - problem.first));
  };
  const int start = std::max(0, problem.first - 1), end = std::min(n - 1, problem.last);
  trial.x.col(start) = state.x.col(start) + move(start);
  for (int i = start; i < end; ++i) {
    const Vec3 e = state.x.col(i + 1) - state.x.col(i), p = move(i + 1) - move(i);
    const Vec3 turned = e + p;
    // The length that it gets is sqrt(|turned|^2 - |p|^2).
    const double change = p.squaredNorm() * rod.per_length[i] * rod.per_length[i];
    double part = 1.0 - 0.5 * change;
    if (change > kTangent) {
      const double smallest = 0.25 * rod.rest_length[i] * rod.rest_length[i];
      part = std::sqrt(std::max(smallest, e.squaredNorm() + 2.0 * e.dot(p)) / turned.squaredNorm());
    }
    trial.x.col(i + 1) = trial.x.col(i) + part * turned;
  }
  const bool held = problem.last < n || problem.distal.hold_along || problem.distal.hold_across;
  if (held) {
    const Vec3 gap = state.x.col(end) + move(end) - trial.x.col(end);
    for (int i = start; i <= end; ++i) trial.x.col(i) += (double(i - start) / (end - start)) * gap;
  }
}

}  // namespace

Mat3 free_directions(const EndSupport& support) {
  const Mat3 along = support.axis * support.axis.transpose();
  Mat3 P = Mat3::Zero();
  if (!support.hold_along) P += along;
  if (!support.hold_across) P += Mat3::Identity() - along;
  return P;
}

// ---------------------------------------------------------------- Newton

template <int D>
NewtonResult Statics::solve_with(BlockBand<D>& hessian, BlockBand<D>& factored,
                                 const Problem& problem, RodState& state,
                                 const NewtonOptions& options) {
  const int count = problem.last - problem.first;
  const int n = problem.rod->nodes();
  gradient_.resize(D * count);
  step_.resize(D * count);
  constexpr double kSmallestShift = 1e-7, kLargestShift = 1e30;  // [N/mm]
  constexpr double kFirstShift = 1e-4;  // of a step that is too long [N/mm]
  constexpr int kMostShifts = 6;        // of those
  // Iterations that refresh the lag, at first and after one that met the residual with an old lag;
  // others only where they meet the residual.
  constexpr int kEagerRefreshes = 25, kEagerAgain = 8;
  int eager_until = kEagerRefreshes;
  // Looks along the wall for how far a step is safe: more after steps that were too long and well.
  constexpr int kMostLooks = 32, kMoreLooks = 4;
  int looks = 1;
  // So many steps in a row of which a vessel lets no more than this part be taken: the energy jumps
  // there, as where the field of the wall begins, and no equilibrium is near.
  constexpr double kStalled = 0.01;
  constexpr int kMostStalled = 5;
  int stalled = 0;
  // After a full step in a vessel from a residual of no more than this the Hessian is not built
  // anew. Mostly the wire is then in equilibrium; and where it is not, but the residual fell to
  // a small part of itself, the factor of before does for one more step.
  constexpr double kNearlyThere = 0.01;  // [N]
  double last_residual = 0.0;  // before the last step                                       [N]
  WallContact* contact = problem.contact;
  const bool twisted = D == 4;
  const bool polynomial = contact == nullptr && !twisted && !problem.tip_moment && !problem.plane;
  const auto motion = [&] { return WallContact::Motion{problem.first, problem.last, D, step_}; };
  const bool out_of_introducer = problem.first > 0 && problem.last == n;
  const TwistChain chain =
      twisted && out_of_introducer ? find_chain(*problem.rod, problem.first) : TwistChain{};
  gather_chain(chain, state);
  // What contact leaves out of the symmetric Hessian may fit into an unsymmetric one, which needs
  // no GMRES.
  const bool banded = D == 3 && out_of_introducer && !problem.distal.hold_along &&
                      !problem.distal.hold_across && contact != nullptr &&
                      contact->remainder_is_banded();
  bool unsymmetric = false;  // the last factor
  bool old_hessian = false;

  // Gradient and, unless the old one does, Hessian of the wire, and of contact as it was sampled
  // last; energy of the wire.
  const auto add_wire = [&](const RodState& where, auto& sink) {
    gradient_.setZero();
    double sum = assemble(problem, where, sink, chain).total();
    if (chain.exists()) {
      coupled_.psi.setZero(D * count);
      sum += add_chain(chain, *problem.rod, where, sink, coupled_.psi, gradient_);
    }
    return sum;
  };
  const auto add_contact = [&](auto& sink) {
    if (contact != nullptr) contact->add(sink);
    project<D>(problem, gradient_);
  };
  FreeSink<D> gradient_sink{problem.first, problem.last, pass_, gradient_};
  const auto differentiate = [&](const RodState& where) {
    double sum;
    if (old_hessian) {
      sum = add_wire(where, gradient_sink);
      add_contact(gradient_sink);
    } else {
      if constexpr (D == 3) {
        hessian.resize(count);  // the wire's blocks are set, all of each
      } else {
        hessian.reset(count, chain.edges());
      }
      BandSink<D> both{gradient_sink, hessian};
      sum = add_wire(where, both);
      add_contact(both);
      apply_supports<D>(problem, hessian);
    }
    return sum;
  };
  const auto largest_force = [&] {
    double residual = 0.0;
    for (int k = 0; k < count; ++k) {
      residual = std::max(residual, gradient_.segment<3>(D * k).squaredNorm());
    }
    residual = std::sqrt(residual);
    if constexpr (D == 4) {  // a torque out of balance counts as a force at the wire's radius
      for (int k = 0; k < count; ++k) {
        residual = std::max(residual, std::abs(gradient_[D * k + 3]) / problem.rod->radius);
      }
    }
    return residual;
  };

  NewtonResult result;
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const double extent = state.x.cwiseAbs().maxCoeff();
  const Rod& rod = *problem.rod;
  const double shortest = rod.rest_length.minCoeff();
  result.rounding_floor = 8.0 * kEpsilon * extent *
                          (rod.stretch.cwiseProduct(rod.per_length).maxCoeff() +
                           4.0 * rod.largest_bend() / (shortest * shortest));
  double shift = 0.0;                                            // of the Hessian's diagonal
  double last_halved = std::numeric_limits<double>::infinity();  // see below                [N]
  double wire_energy;                                            // without contact
  double energy;  // that falls: of wire, contact and lagged friction
  trial_ = state;
  if (contact != nullptr) contact->begin(state.x);
  wire_energy = differentiate(state);
  const auto finish = [&](bool converged) {
    spread_chain(chain, rod, state);
    result.converged = converged;
    result.energy = wire_energy;
    if (contact != nullptr) result.energy += contact->energy().contact + contact->energy().wall;
    return result;
  };
  for (;; ++result.iterations) {
    if (contact != nullptr && result.iterations == kEagerRefreshes) contact->hold_feet();
    energy = wire_energy + (contact != nullptr ? contact->energy().total() : 0.0);
    result.residual = largest_force();
    if (result.residual <= options.residual_tolerance && contact != nullptr &&
        !contact->lag_is_fresh()) {
      contact->refresh(true);
      eager_until = result.iterations + kEagerAgain;
      wire_energy = differentiate(state);
      energy = wire_energy + contact->energy().total();
      result.residual = largest_force();
    }
    if (result.residual <= options.residual_tolerance) return finish(true);
    if (result.iterations == options.max_iterations || !std::isfinite(result.residual))
      return finish(false);

    // 1. Direction: with the factor of before, or Newton's, with the Hessian shifted just far
    // enough to be positive definite, and for the whole step to be safe: a floppy wire would else
    // go far and be cut short.
    double slope, cap;  // of the energy along the step; largest part of the step that is safe
    const auto refine_and_bound = [&] {
      slope = gradient_.dot(step_);
      cap = std::numeric_limits<double>::infinity();
      if (contact != nullptr) {
        if (shift == 0.0 && !unsymmetric && contact->has_remainder()) {
          slope = refine_step<D>(problem, factored, slope);
        }
        cap = contact->largest_safe_part(motion(), looks);
      }
      if (twisted) cap = std::min(cap, largest_turning_step<D>(problem, step_));
    };
    bool found = false;
    const double fallen = unsymmetric ? 0.03 : 0.003;  // a wall that yields has kinks
    if (old_hessian && result.residual <= fallen * last_residual) {
      step_ = -gradient_;
      if (unsymmetric) {
        unsymmetric_.solve(step_);
      } else {
        coupled_.solve(factored, step_);
      }
      refine_and_bound();
      found = slope < 0.0 && cap >= 1.0;
    }
    if (!found && old_hessian) {
      old_hessian = false;
      differentiate(state);
    }
    const double last_shift = shift;
    shift = 0.0;
    bool shortened = false;
    for (int shifts = 0; !found; ++shifts) {
      const auto solve = [&] {
        if constexpr (D == 3) {
          unsymmetric = banded && shift == 0.0 && contact->lag_is_fresh();
          if (unsymmetric) {
            unsymmetric_.take(hessian);
            contact->add_remainder(problem.first, unsymmetric_);
            if (!unsymmetric_.factor()) return false;
            step_ = -gradient_;
            unsymmetric_.solve(step_);
            return gradient_.dot(step_) < 0.0;
          }
        }
        step_ = -gradient_;
        return factored.factor(hessian, shift) &&
               coupled_.solve_first(chain, factored, chain.last - problem.first, step_);
      };
      while (!solve()) {
        shift = shift == 0.0 ? std::max(kSmallestShift, 0.1 * last_shift) : 4.0 * shift;
        if (!(shift < kLargestShift)) return finish(false);  // a number in it is not finite
      }
      refine_and_bound();
      if (contact == nullptr || cap >= 1.0) break;
      shortened = true;
      if (shifts == kMostShifts) break;
      shift = std::max(last_shift > 0.0 ? 0.25 * last_shift : kFirstShift, 4.0 * shift);
    }
    if (step_.cwiseAbs().maxCoeff() < 64.0 * kEpsilon * extent &&
        result.residual <= result.rounding_floor) {
      return finish(true);
    }

    if (contact != nullptr) contact->expect_after(motion());

    // 2. Full step, edges turned rather than lengthened; most steps end here.
    constexpr double kTooShort = 0.75;  // fall of the energy, of what the slope says
    // Rounding may hide the fall of the energy close to the minimum.
    const double rounding = 1e-13 * (1.0 + std::abs(energy));
    bool accepted = false;
    double trial_wire_energy = 0.0;
    // Where a whole step makes a new Hessian needless, the gradient is found with the energy.
    const bool keep_hessian = contact != nullptr && shift == 0.0 && result.residual <= kNearlyThere;
    const auto try_trial = [&](double length) {
      if constexpr (D == 4) {
        for (int k = chain.edges(); k < count && problem.first + k < n - 1; ++k) {
          trial_.theta[problem.first + k] =
              state.theta[problem.first + k] + length * step_[D * k + 3];
        }
        transport_frames(state, trial_, std::max(0, problem.first - 1),
                         std::min(n - 2, problem.last - 1), chain.first, chain.edges());
      }
      double trial_energy;
      if (contact == nullptr) {
        trial_energy = trial_wire_energy = differentiate(trial_);
      } else {
        if (keep_hessian) {
          trial_wire_energy = add_wire(trial_, gradient_sink);
        } else {
          EnergySink sink;
          trial_wire_energy = assemble(problem, trial_, sink, chain).total() + chain.energy(trial_);
        }
        trial_energy = trial_wire_energy + contact->sample(trial_.x).energy.total();
      }
      accepted = trial_energy <= energy + 1e-4 * length * slope + rounding;
      if (accepted) {
        result.worst_energy_rise = std::max(result.worst_energy_rise, trial_energy - energy);
      }
      return trial_energy;
    };
    double part = std::min(1.0, cap);
    const auto go = [&] {
      turn_edges<D>(problem, state, step_, part, trial_);
      return try_trial(part);
    };
    double lowest = go();
    // Where the energy falls nearly as fast all along the step as at its start, as it does while a
    // wire jumps, the Hessian's shift or what it folds made the step too short.
    const auto may_go_as_far_again = [&] {
      if (2.0 * part > cap) return false;
      direction_ = part * step_;
      return contact->largest_safe_part({problem.first, problem.last, D, direction_}, looks) >= 1.0;
    };
    while (accepted && contact != nullptr &&
           energy - lowest > std::max(-kTooShort * part * slope, 10.0 * rounding) &&
           may_go_as_far_again()) {
      part *= 2.0;
      const double further = go();
      if (accepted && further < lowest) {
        lowest = further;
        continue;
      }
      part *= 0.5;
      go();
      break;
    }
    // What friction and yielding lag has no energy: a full step may be a good one all the same. The
    // residual of each such step is no more than half of the last one's, so that none goes round.
    bool refreshed = false;
    if (!accepted && shift == 0.0 && contact != nullptr && contact->has_remainder()) {
      contact->save_lag();
      contact->refresh(false);
      old_hessian = false;
      trial_wire_energy = differentiate(trial_);
      const double force = largest_force();
      accepted = refreshed = force <= 0.5 * std::min(result.residual, last_halved);
      if (accepted) last_halved = force;
      if (!accepted) contact->restore_lag();
    }

    if (!accepted) looks = 1;
    if (accepted && shortened) looks = std::min(kMoreLooks * looks, kMostLooks);

    // 3. Else straight along the step to the lowest point of the exact quartic, plus a parabola for
    // the terms that are no polynomial; shorter until the energy falls.
    double length = 0.0;
    if (!accepted) {
      Quartic along = elastic_along<D>(problem, state, step_);
      if (!polynomial) {
        const double second = std::max(0.0, -slope - shift * step_.squaredNorm() - 2.0 * along.a2);
        along.a1 = slope;
        along.a2 += 0.5 * second;
      }
      length = lowest_point(along, contact != nullptr ? std::min(1.0, cap) : cap);
    }
    for (int cut = 0; cut < 40 && !accepted; ++cut) {
      for (int k = 0; k < count; ++k) {
        trial_.x.col(problem.first + k) =
            state.x.col(problem.first + k) + length * step_.segment<3>(D * k);
      }
      const double trial_energy = try_trial(length);
      if (accepted) break;
      // Lowest point of the parabola through both energies and the slope, within a safe bracket.
      const double curvature = (trial_energy - energy - length * slope) / (length * length);
      const double parabola = curvature > 0.0 ? -slope / (2.0 * curvature) : 0.5 * length;
      length = std::clamp(parabola, 0.1 * length, 0.5 * length);
    }
    stalled = contact != nullptr && length > 0.0 && length < kStalled ? stalled + 1 : 0;
    if (!accepted || stalled == kMostStalled) return finish(false);
    std::swap(state, trial_);
    if (problem.tip_moment) {
      state.tip_angle = tip_angle(*problem.tip_moment, state, last_edge(state));
      trial_.tip_angle = state.tip_angle;
    }
    if constexpr (D == 4) {
      trial_.director = state.director;
      trial_.reference_twist = state.reference_twist;
    }
    wire_energy = trial_wire_energy;
    if (contact != nullptr && !refreshed) {
      if (result.iterations < eager_until) contact->refresh(false);
      old_hessian = keep_hessian && length == 0.0;
      last_residual = result.residual;
      if (old_hessian) {
        add_contact(gradient_sink);
      } else {
        differentiate(state);
      }
    }
  }
}

template <int D>
double Statics::refine_step(const Problem& problem, const BlockBand<D>& factored, double slope) {
  // What the banded Hessian H lacks of the exact one, R: (I + H^-1 R) step = -H^-1 gradient, by
  // GMRES (Saad & Schultz 1986) from the banded step, as few directions as it takes.
  constexpr double kEnough = 0.01;  // of the first residual
  const Eigen::Index size = step_.size();
  krylov_.resize(size, kKrylov + 1);
  constexpr double kSmall = 5e-4;  // of the gradient: not worth a solve
  const auto find_rest = [&](const Eigen::VectorXd& v) {
    refined_.setZero(size);
    problem.contact->add_remainder({problem.first, problem.last, D, v}, refined_);
    project<D>(problem, refined_);
  };
  first_step_ = step_;
  find_rest(step_);
  if (refined_.norm() <= kSmall * gradient_.norm()) return slope;
  coupled_.solve(factored, refined_);
  const double start = refined_.norm();
  if (start <= kEnough * step_.norm()) {
    step_ -= refined_;
  } else {
    Eigen::Matrix<double, kKrylov + 1, kKrylov> upper;  // the operator on the directions so far
    Eigen::Matrix<double, kKrylov + 1, 1> right;
    std::array<Eigen::JacobiRotation<double>, kKrylov> rotations;
    upper.setZero();
    right.setZero();
    right[0] = -start;
    krylov_.col(0) = refined_ / start;
    int count = 0;
    while (count < kKrylov && std::abs(right[count]) > kEnough * start) {
      const int k = count++;
      direction_ = krylov_.col(k);
      find_rest(direction_);
      coupled_.solve(factored, refined_);
      refined_ += direction_;
      for (int i = 0; i <= k; ++i) {
        upper(i, k) = krylov_.col(i).dot(refined_);
        refined_ -= upper(i, k) * krylov_.col(i);
      }
      upper(k + 1, k) = refined_.norm();
      if (upper(k + 1, k) > 0.0) krylov_.col(k + 1) = refined_ / upper(k + 1, k);
      for (int i = 0; i < k; ++i) {
        upper.col(k).applyOnTheLeft(i, i + 1, rotations[static_cast<std::size_t>(i)].adjoint());
      }
      Eigen::JacobiRotation<double>& rotation = rotations[static_cast<std::size_t>(k)];
      rotation.makeGivens(upper(k, k), upper(k + 1, k));
      upper.col(k).applyOnTheLeft(k, k + 1, rotation.adjoint());
      right.applyOnTheLeft(k, k + 1, rotation.adjoint());
    }
    for (int i = count - 1; i >= 0; --i) {
      for (int j = i + 1; j < count; ++j) right[i] -= upper(i, j) * right[j];
      right[i] /= upper(i, i);
      step_ += right[i] * krylov_.col(i);
    }
  }
  // The energy falls along the banded Hessian's step; it must do so along the refined one.
  const double refined_slope = gradient_.dot(step_);
  if (refined_slope <= 0.1 * slope) return refined_slope;
  step_.swap(first_step_);
  return slope;
}

NewtonResult Statics::solve(const Problem& problem, RodState& state, const NewtonOptions& options) {
  expects(problem.rod != nullptr && problem.first >= 0 && problem.first < problem.last &&
          problem.last <= problem.rod->nodes());
  if (problem.rod->twisted) return solve_with<4>(hessian4_, factored4_, problem, state, options);
  return solve_with<3>(hessian3_, factored3_, problem, state, options);
}

Energy Statics::evaluate(const Problem& problem, const RodState& state,
                         Eigen::Ref<Eigen::Matrix3Xd> gradient) {
  gradient.setZero();
  GradientSink sink{gradient};
  return assemble_with_contact(problem, state, sink);
}

HeldEnd Statics::held_end(const Problem& problem, const RodState& state) {
  // Elements that reach from the free nodes to those before.
  HeldSink sink{problem.first};
  Problem near;
  near.rod = problem.rod;
  near.first = problem.first;
  near.last = std::min(problem.first + 1, problem.rod->nodes());
  assemble(near, state, sink);
  return sink.sum;
}

void Statics::derivatives(const Problem& problem, const RodState& state, Eigen::VectorXd& gradient,
                          Eigen::MatrixXd& hessian) {
  const int n = problem.rod->nodes();
  gradient.setZero(4 * n - 1);
  hessian.setZero(4 * n - 1, 4 * n - 1);
  DenseSink sink{n, gradient, hessian};
  assemble_with_contact(problem, state, sink);
}

}  // namespace wireplan::simulate
