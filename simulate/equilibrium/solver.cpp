#include "simulate/equilibrium/solver.h"

#include "simulate/equilibrium/assemble.h"
#include "simulate/equilibrium/newton.h"

namespace wireplan::simulate {
namespace {

/// Energy and derivatives of a state with its own lag, contact included.
template <class Sink>
Energy assemble_with_contact(const Problem& problem, const RodState& state, Sink& sink) {
  Energy energy = assemble(problem, state, sink);
  if (problem.contact == nullptr) return energy;
  problem.contact->expect_nothing();
  problem.contact->begin(state);
  const ContactEnergy contact = problem.contact->refresh(true).energy;
  problem.contact->add(sink);
  energy.contact += contact.contact;
  energy.wall += contact.wall + contact.support;
  return energy;
}

}  // namespace

Mat3 free_directions(const EndSupport& support) {
  const Mat3 along = support.axis * support.axis.transpose();
  Mat3 P = Mat3::Zero();
  if (!support.hold_along) P += along;
  if (!support.hold_across) P += Mat3::Identity() - along;
  return P;
}

std::vector<std::string> name_terms(const Rod& rod, const std::vector<std::string>& own,
                                    const VesselModel* vessel, double friction) {
  std::vector<std::string> terms = name_elements(rod);
  terms.insert(terms.end(), own.begin(), own.end());
  if (vessel == nullptr) return terms;
  terms.push_back("contact");
  if (friction > 0.0) terms.push_back("friction");
  if (vessel->compliance) terms.push_back("yielding_wall");
  if (vessel->sections) terms.push_back("moving_vessel");
  return terms;
}

NewtonResult Statics::solve(const Problem& problem, RodState& state, const NewtonOptions& options) {
  expects(problem.rod != nullptr && problem.first >= 0 && problem.first < problem.last &&
          problem.last <= problem.rod->nodes());
  switch (problem.twists()) {
    case 0:
      return solve_newton<3>(problem, state, options, memory_, bands3_);
    case 1:
      return solve_newton<4>(problem, state, options, memory_, bands4_);
    case 2:
      return solve_newton<5>(problem, state, options, memory_, bands5_);
    default:
      return solve_newton<6>(problem, state, options, memory_, bands6_);
  }
}

Energy Statics::evaluate(const Problem& problem, const RodState& state,
                         Eigen::Ref<Eigen::Matrix3Xd> gradient) {
  gradient.setZero();
  GradientSink sink{gradient};
  return assemble_with_contact(problem, state, sink);
}

double Statics::energy(const Problem& problem, const RodState& state) {
  EnergySink sink;
  return assemble(problem, state, sink).total();
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

double Statics::bend_per_length(const Rod& rod, const RodState& state, int i, double length) {
  // W is EI / length times a function of the rest angle, which grows with the length too.
  const double r = rod.rest_angle[i], r_per_length = r / length;
  const Vec3 u = (state.x.col(i + 1) - state.x.col(i)) * rod.per_length[i] -
                 (state.x.col(i) - state.x.col(i - 1)) * rod.per_length[i - 1];
  const double half = 0.5 * u.squaredNorm();
  if (r == 0.0 && rod.strip[i] == 0.0) return -rod.bend[i] * half / length;
  const double cosine = std::cos(r), sine = std::sin(r);
  const double toward_m = Lean(rod, state, i, wireplan::simulate::toward_m).s;
  const double turned = cosine * half + 1.0 - cosine - sine * toward_m;
  const double by_r = sine * (1.0 - half) - cosine * toward_m;
  double slope = rod.bend[i] * (by_r * r_per_length - turned / length);
  if (const double strip = rod.strip[i]; strip != 0.0) {
    const Lean lean(rod, state, i, [strip](const Edge& e) { return toward_stiff(e, strip); });
    const double excess = lean.s - (strip > 0.0 ? 0.0 : sine);
    const double rest_by_r = strip > 0.0 ? 0.0 : cosine;
    slope -= std::abs(strip) * excess * (0.5 * excess / length + rest_by_r * r_per_length);
  }
  return slope;
}

void Statics::derivatives(const Problem& problem, const RodState& state, Eigen::VectorXd& gradient,
                          Eigen::MatrixXd& hessian) {
  const int n = problem.rod->nodes();
  const int wire = 3 * n + std::max(1, problem.twists()) * (n - 1);
  const int size = wire + static_cast<int>(state.sections.size());
  gradient.setZero(size);
  hessian.setZero(size, size);
  DenseSink sink{n, gradient, hessian, wire};
  assemble_with_contact(problem, state, sink);
}

}  // namespace wireplan::simulate
