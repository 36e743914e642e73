#include "simulate/equilibrium/newton.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/assemble.h"
#include "simulate/equilibrium/krylov.h"
#include "simulate/equilibrium/line_search.h"

namespace wireplan::simulate {
namespace {

constexpr NewtonTuning kTuning;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// Residual that 64 bit numbers leave in the stiffest element.
double find_rounding_floor(const Problem& problem, double extent) {
  const Rod& rod = *problem.rod;
  const double shortest = rod.rest_length.minCoeff();
  double floor = 0.0;
  if (problem.tools != nullptr) {  // of angles of a turn and more
    floor = 8.0 * kEpsilon * 2.0 * kPi / rod.radius *
            std::max(problem.tools->twist.maxCoeff(), problem.tools->lead.maxCoeff());
  }
  return floor + 8.0 * kEpsilon * extent *
                     (rod.stretch.cwiseProduct(rod.per_length).maxCoeff() +
                      4.0 * rod.largest_bend() / (shortest * shortest));
}

/// One solve: the iterate, and what is remembered from step to step.
template <int D>
class Newton {
 public:
  Newton(const Problem& problem, RodState& state, const NewtonOptions& options, SolveMemory& memory,
         BandMemory<D>& bands)
      : problem_(problem),
        rod_(*problem.rod),
        contact_(problem.contact),
        options_(options),
        count_(problem.last - problem.first),
        polynomial_(problem.contact == nullptr && D == 3 && !problem.tip_moment && !problem.plane &&
                    problem.springs == nullptr),
        sections_(contact_ != nullptr && contact_->chain() != nullptr ? contact_->chain()->nodes()
                                                                      : 0),
        banded_(D == 3 && sections_ == 0 && problem.first > 0 && problem.last == rod_.nodes() &&
                !problem.distal.hold_along && !problem.distal.hold_across && contact_ != nullptr &&
                contact_->remainder_is_banded()),
        chain_(find_chain_of(problem, state)),
        extent_(state.x.cwiseAbs().maxCoeff()),
        state_(state),
        memory_(memory),
        gradient_(memory.gradient),
        step_(memory.step),
        trial_(memory.trial),
        hessian_(bands.hessian),
        factored_(bands.factored) {}

  NewtonResult solve() {
    start();
    for (;; ++result_.iterations) {
      measure();
      const bool met = result_.residual <= options_.residual_tolerance;
      const bool leaves = (met || shifted_ == kTuning.most_shifted) && find_way_down();
      if (met && !leaves) return finish(true);
      if (result_.iterations == options_.max_iterations || !std::isfinite(result_.residual)) {
        result_.at_saddle = met;
        return finish(false);
      }
      if (leaves) {
        move_on();
        continue;
      }
      if (!find_step()) return finish(false);
      const bool is_rounding =
          step_.cwiseAbs().maxCoeff() < kTuning.last_places * kEpsilon * extent_;
      if (is_rounding && result_.residual <= result_.rounding_floor) return finish(true);

      if (contact_ != nullptr) contact_->expect_after(motion());
      take_full_step();
      if (!accepted_) try_with_fresh_lag();
      choose_looks();
      if (!accepted_) search_line();
      if (!accepted_ || has_stalled()) return finish(false);
      shifted_ = shift_ > 0.0 ? shifted_ + 1 : 0;
      move_on();
    }
  }

 private:
  // ---- the iterate

  void start() {
    expects(state_.sections.cols() == sections_);
    gradient_.resize(D * count_ + 3 * sections_);
    step_.resize(D * count_ + 3 * sections_);
    gather_chain(chain_, state_);
    result_.rounding_floor = find_rounding_floor(problem_, extent_);
    trial_ = state_;
    if (contact_ != nullptr) contact_->begin(state_);
    wire_energy_ = differentiate(state_);
  }

  /// Energy and residual of the iterate; where it is met with an old lag, with its own.
  void measure() {
    if (contact_ != nullptr && result_.iterations == kTuning.eager_refreshes) contact_->hold_feet();
    energy_ = wire_energy_ + (contact_ != nullptr ? contact_->energy().total() : 0.0);
    result_.residual = largest_force();
    const bool met = result_.residual <= options_.residual_tolerance;
    if (!met || contact_ == nullptr || contact_->lag_is_fresh()) return;
    contact_->refresh(true);
    // Curved tools in one another went round between two lags.
    if (problem_.tools == nullptr) eager_until_ = result_.iterations + kTuning.eager_again;
    wire_energy_ = differentiate(state_);
    energy_ = wire_energy_ + contact_->energy().total();
    result_.residual = largest_force();
  }

  NewtonResult finish(bool converged) {
    spread_chain(chain_, problem_, state_);
    result_.converged = converged;
    result_.energy = wire_energy_;
    if (contact_ != nullptr) {
      result_.wall_energy = contact_->energy().wall;
      result_.wall_energy += contact_->energy().support;
      result_.energy += contact_->energy().contact + result_.wall_energy;
    }
    return result_;
  }

  WallContact::Motion motion() const { return {problem_.first, problem_.last, D, step_}; }

  double largest_force() const {
    double residual = 0.0;
    for (int k = 0; k < count_; ++k) {
      residual = std::max(residual, gradient_.template segment<3>(D * k).squaredNorm());
    }
    for (int j = 0; j < sections_; ++j) {
      residual =
          std::max(residual, gradient_.template segment<3>(D * count_ + 3 * j).squaredNorm());
    }
    residual = std::sqrt(residual);
    if constexpr (D > 3) {  // a torque out of balance counts as a force at the wire's radius
      for (int k = 0; k < count_; ++k) {
        for (int r = 3; r < D; ++r) {
          residual = std::max(residual, std::abs(gradient_[D * k + r]) / rod_.radius);
        }
      }
    }
    return residual;
  }

  // ---- derivatives

  FreeSink<D> gradient_sink() { return {problem_.first, problem_.last, memory_.pass, gradient_}; }

  template <class Sink>
  double add_wire(const RodState& where, Sink& sink) {
    gradient_.setZero();
    double sum = assemble(problem_, where, sink, chain_).total();
    if (chain_.exists()) {
      memory_.coupled.psi.setZero(D * count_);
      sum += add_chain(chain_, rod_, where, sink, memory_.coupled.psi, gradient_);
      project<D>(problem_, memory_.coupled.psi);
    }
    return sum;
  }

  template <class Sink>
  void add_contact(Sink& sink) {
    if (contact_ != nullptr) contact_->add(sink);
    project<D>(problem_, gradient_);
  }

  /// Gradient and, unless the old one does, Hessian of the wire, and of contact as it was sampled
  /// last; returns the energy of the wire.
  double differentiate(const RodState& where) {
    FreeSink<D> gradient = gradient_sink();
    if (old_hessian_) {
      const double sum = add_wire(where, gradient);
      add_contact(gradient);
      return sum;
    }
    if constexpr (D == 3) {
      hessian_.resize(count_);  // the wire's blocks are set, all of each
    } else {
      hessian_.reset(count_, chain_.without_theta(), chain_.loose);
    }
    if (sections_ > 0) memory_.sections.reset(count_, sections_);
    BandSink<D> both{gradient, hessian_, memory_.sections};
    const double sum = add_wire(where, both);
    add_contact(both);
    apply_supports<D>(problem_, hessian_);
    if (sections_ > 0) hold_sections(problem_, memory_.sections);
    return sum;
  }

  // ---- 1. direction

  /// With the factor of before, or Newton's, with the Hessian shifted just far enough to be
  /// positive definite, and for the whole step to be safe. False where a number is not finite.
  bool find_step() {
    shortened_ = false;
    const bool found = step_with_old_factor();
    if (!found && old_hessian_) {
      old_hessian_ = false;
      differentiate(state_);
    }
    const double last_shift = shift_;
    shift_ = 0.0;
    for (int shifts = 0; !found; ++shifts) {
      while (!factor_and_solve()) {
        shift_ = shift_ == 0.0 ? std::max(kTuning.smallest_shift, kTuning.kept_shift * last_shift)
                               : kTuning.shift_growth * shift_;
        if (!(shift_ < kTuning.largest_shift)) return false;
      }
      refine_and_bound();
      if (contact_ == nullptr || cap_ >= 1.0) break;
      shortened_ = true;
      if (shifts == kTuning.most_long_shifts) break;
      shift_ = std::max(
          last_shift > 0.0 ? kTuning.kept_long_shift * last_shift : kTuning.first_long_shift,
          kTuning.shift_growth * shift_);
    }
    return true;
  }

  bool step_with_old_factor() {
    const double fallen = unsymmetric_ ? kTuning.fell_banded : kTuning.fell_folded;
    if (!old_hessian_ || result_.residual > fallen * last_residual_) return false;
    step_ = -gradient_;
    if (unsymmetric_) {
      memory_.unsymmetric.solve(step_);
    } else {
      solve_again(step_);
    }
    refine_and_bound();
    return slope_ < 0.0 && cap_ >= 1.0;
  }

  /// False where the Hessian is not positive definite, or not of use.
  bool factor_and_solve() {
    if constexpr (D == 3) {
      unsymmetric_ = banded_ && shift_ == 0.0 && contact_->lag_is_fresh();
      if (unsymmetric_) {
        UnsymmetricBand& band = memory_.unsymmetric;
        band.take(hessian_);
        contact_->add_remainder(problem_.first, band);
        if (!band.factor()) return false;
        step_ = -gradient_;
        band.solve(step_);
        return gradient_.dot(step_) < 0.0;
      }
    }
    step_ = -gradient_;
    if (sections_ > 0) {
      if (!memory_.moving.factor(hessian_, memory_.sections, shift_)) return false;
      memory_.moving.solve(step_);
      return true;
    }
    return factored_.factor(hessian_, shift_) &&
           memory_.coupled.solve_first(chain_, factored_, chain_.last - problem_.first, step_);
  }

  /// With the factors of the symmetric matrix.
  void solve_again(Eigen::VectorXd& v) {
    if (sections_ > 0) {
      memory_.moving.solve(v);
    } else {
      memory_.coupled.solve(factored_, v);
    }
  }

  /// The slope of the energy along the step, and the largest part of the step that is safe.
  void refine_and_bound() {
    slope_ = gradient_.dot(step_);
    cap_ = std::numeric_limits<double>::infinity();
    if (contact_ != nullptr) {
      if (shift_ == 0.0 && !unsymmetric_ && contact_->has_remainder()) slope_ = refine_step();
      cap_ = contact_->largest_safe_part(motion(), looks_);
    }
    if (D > 3) cap_ = std::min(cap_, largest_turning_step<D>(problem_, step_));
  }

  double refine_step();
  void find_rest(const Eigen::VectorXd& v);

  // ---- away from saddles

  /// Where the Hessian has a direction of negative curvature: goes along it by so much that the
  /// energy falls, and by more each time. False where it has none, or nothing falls.
  bool find_way_down() {
    if (!options_.leave_saddles || contact_ != nullptr) return false;
    shifted_ = 0;
    if (factored_.factor(hessian_)) return false;
    memory_.direction = lowest_mode();
    const double most = memory_.direction.cwiseAbs().maxCoeff();
    const double side = gradient_.dot(memory_.direction) > 0.0 ? -1.0 : 1.0;
    for (nudge_ = std::max(nudge_, kTuning.first_nudge); nudge_ <= kTuning.largest_nudge;) {
      step_ = side * nudge_ * rod_.radius / most * memory_.direction;
      nudge_ *= kTuning.nudge_growth;
      cap_ = D > 3 ? largest_turning_step<D>(problem_, step_)
                   : std::numeric_limits<double>::infinity();
      rounding_ = kTuning.rounding * (1.0 + std::abs(energy_));
      // With edges turned, and straight: between ends that are held no edge turns but by stretch.
      const double part = std::min(1.0, cap_), enough = kTuning.roundings * rounding_;
      if (energy_ - go(part) > enough) return true;
      go_straight(part);
      if (energy_ - try_trial(part) > enough) return true;
    }
    differentiate(state_);
    return false;
  }

  /// The direction of least curvature, or one of negative curvature near to it.
  Eigen::VectorXd lowest_mode() {
    for (shift_ = kTuning.smallest_shift; !factored_.factor(hessian_, shift_);) {
      shift_ *= kTuning.shift_growth;
      if (!(shift_ < kTuning.largest_shift)) break;
    }
    Eigen::VectorXd mode(step_.size());
    for (Eigen::Index k = 0; k < mode.size(); ++k) mode[k] = std::sin(1.0 + 2.4 * double(k));
    project<D>(problem_, mode);
    for (int k = 0; k < kTuning.saddle_solves; ++k) {
      factored_.solve(mode);
      mode.normalize();
    }
    return mode;
  }

  // ---- 2. full step, edges turned rather than lengthened; most steps end here

  void take_full_step() {
    // Rounding may hide the fall of the energy close to the minimum.
    rounding_ = kTuning.rounding * (1.0 + std::abs(energy_));
    // Where a whole step makes a new Hessian needless, the gradient is found with the energy.
    keep_hessian_ =
        contact_ != nullptr && shift_ == 0.0 && result_.residual <= kTuning.nearly_there;
    refreshed_ = false;
    length_ = 0.0;
    double part = std::min(1.0, cap_);
    double lowest = go(part);

    // Where the energy falls nearly as fast all along the step as at its start, as it does while a
    // wire jumps, the Hessian's shift or what it folds made the step too short.
    while (accepted_ && contact_ != nullptr &&
           energy_ - lowest >
               std::max(-kTuning.doubled_from * part * slope_, kTuning.roundings * rounding_) &&
           may_go_as_far_again(part)) {
      part *= 2.0;
      const double further = go(part);
      if (accepted_ && further < lowest) {
        lowest = further;
        continue;
      }
      part *= 0.5;
      go(part);
      break;
    }
  }

  double go(double part) {
    turn_edges<D>(problem_, state_, step_, part, trial_);
    move_sections(part);
    return try_trial(part);
  }

  void go_straight(double part) {
    for (int k = 0; k < count_; ++k) {
      trial_.x.col(problem_.first + k) =
          state_.x.col(problem_.first + k) + part * step_.template segment<3>(D * k);
    }
    move_sections(part);
  }

  void move_sections(double part) {
    for (int j = 0; j < sections_; ++j) {
      trial_.sections.col(j) =
          state_.sections.col(j) + part * step_.template segment<3>(D * count_ + 3 * j);
    }
  }

  bool may_go_as_far_again(double part) {
    if (2.0 * part > cap_) return false;
    memory_.direction = part * step_;
    return contact_->largest_safe_part({problem_.first, problem_.last, D, memory_.direction},
                                       looks_) >= 1.0;
  }

  /// The trial state's energy, and whether it falls as it should.
  double try_trial(double length) {
    if constexpr (D > 3) {
      const int n = rod_.nodes();
      const int last_edge = std::min({n - 2, problem_.last - 1, chain_.loose - 1});
      for (int k = chain_.without_theta(); problem_.first + k <= last_edge; ++k) {
        for (int r = 3, e = problem_.first + k; r < D; ++r, e += n - 1) {
          trial_.theta[e] = state_.theta[e] + length * step_[D * k + r];
        }
      }
      transport_frames(state_, trial_, std::max(0, problem_.first - 1), last_edge, chain_.first,
                       chain_.edges());
    }
    double trial_energy;
    if (contact_ == nullptr) {
      trial_energy = trial_wire_energy_ = differentiate(trial_);
    } else {
      if (keep_hessian_) {
        FreeSink<D> gradient = gradient_sink();
        trial_wire_energy_ = add_wire(trial_, gradient);
      } else {
        EnergySink sink;
        trial_wire_energy_ =
            assemble(problem_, trial_, sink, chain_).total() + chain_.energy(trial_);
      }
      trial_energy = trial_wire_energy_ + contact_->sample(trial_).energy.total();
    }
    accepted_ = trial_energy <= energy_ + kTuning.armijo * length * slope_ + rounding_;
    if (accepted_) {
      result_.worst_energy_rise = std::max(result_.worst_energy_rise, trial_energy - energy_);
    }
    return trial_energy;
  }

  /// What friction and yielding lag has no energy: a full step may be a good one all the same. The
  /// residual of each such step is no more than half of the last one's, so that none goes round.
  void try_with_fresh_lag() {
    if (shift_ != 0.0 || contact_ == nullptr || !contact_->has_remainder()) return;
    contact_->save_lag();
    contact_->refresh(false);
    old_hessian_ = false;
    trial_wire_energy_ = differentiate(trial_);
    const double force = largest_force();
    accepted_ = refreshed_ = force <= kTuning.halved * std::min(result_.residual, last_halved_);
    if (accepted_) {
      last_halved_ = force;
    } else {
      contact_->restore_lag();
    }
  }

  void choose_looks() {
    if (!accepted_) looks_ = 1;
    if (accepted_ && shortened_) {
      looks_ = std::min(kTuning.more_looks * looks_, kTuning.most_looks);
    }
  }

  // ---- 3. straight along the step

  /// To the lowest point of the exact quartic, plus a parabola for the terms that are no
  /// polynomial; shorter until the energy falls.
  void search_line() {
    Quartic along = elastic_along<D>(problem_, state_, step_);
    if (!polynomial_) {
      const double second = std::max(0.0, -slope_ - shift_ * step_.squaredNorm() - 2.0 * along.a2);
      along.a1 = slope_;
      along.a2 += 0.5 * second;
    }
    length_ = lowest_point(along, contact_ != nullptr ? std::min(1.0, cap_) : cap_);
    for (int cut = 0; cut < kTuning.most_cuts; ++cut) {
      go_straight(length_);
      const double trial_energy = try_trial(length_);
      if (accepted_) return;
      // Lowest point of the parabola through both energies and the slope, within a safe bracket.
      const double curvature = (trial_energy - energy_ - length_ * slope_) / (length_ * length_);
      const double parabola = curvature > 0.0 ? -slope_ / (2.0 * curvature) : 0.5 * length_;
      length_ = std::clamp(parabola, kTuning.least_cut * length_, kTuning.most_cut * length_);
    }
  }

  bool has_stalled() {
    const bool short_step = contact_ != nullptr && length_ > 0.0 && length_ < kTuning.stalled_part;
    stalled_ = short_step ? stalled_ + 1 : 0;
    return stalled_ == kTuning.most_stalled;
  }

  // ---- 4. on to the next iterate

  void move_on() {
    std::swap(state_, trial_);
    if (problem_.tip_moment) {
      state_.tip_angle = tip_angle(*problem_.tip_moment, state_, last_edge(state_));
      trial_.tip_angle = state_.tip_angle;
    }
    if constexpr (D > 3) {
      trial_.director = state_.director;
      trial_.reference_twist = state_.reference_twist;
    }
    wire_energy_ = trial_wire_energy_;
    if (contact_ == nullptr || refreshed_) return;
    if (result_.iterations < eager_until_) contact_->refresh(false);
    old_hessian_ = keep_hessian_ && length_ == 0.0;
    last_residual_ = result_.residual;
    if (old_hessian_) {
      FreeSink<D> gradient = gradient_sink();
      add_contact(gradient);
    } else {
      differentiate(state_);
    }
  }

  // What does not change in a solve.
  const Problem& problem_;
  const Rod& rod_;
  WallContact* const contact_;
  const NewtonOptions& options_;
  const int count_;        // free nodes
  const bool polynomial_;  // the energy along a step is a quartic
  const int sections_;     // of the vessel, that move
  const bool banded_;      // what contact leaves out fits into an unsymmetric band: no GMRES
  const TwistChain chain_;
  const double extent_;  // largest coordinate at the start                        [mm]

  // The iterate, and memory that is reused.
  RodState& state_;
  SolveMemory& memory_;
  Eigen::VectorXd &gradient_, &step_;
  RodState& trial_;
  BlockBand<D>&hessian_, &factored_;
  NewtonResult result_;
  double wire_energy_ = 0.0;  // without contact                                      [N mm]
  double energy_ = 0.0;       // that falls: of wire, contact and lagged friction     [N mm]

  // The step under way.
  double shift_ = 0.0;              // of the Hessian's diagonal                            [N/mm]
  double slope_ = 0.0, cap_ = 0.0;  // see refine_and_bound()
  bool shortened_ = false;          // it was found anew, since it was not safe
  bool accepted_ = false, refreshed_ = false, keep_hessian_ = false;
  double rounding_ = 0.0;           // of the energy                                        [N mm]
  double trial_wire_energy_ = 0.0;  //                                                      [N mm]
  double length_ = 0.0;             // of the straight step; 0: edges were turned

  // Remembered from step to step.
  bool unsymmetric_ = false;    // the last factor
  bool old_hessian_ = false;    // the factor of before does
  double last_residual_ = 0.0;  // before the last step                                 [N]
  double last_halved_ = std::numeric_limits<double>::infinity();  // see try_with_fresh_lag() [N]
  int eager_until_ = kTuning.eager_refreshes;
  int looks_ = 1;
  int stalled_ = 0;
  int shifted_ = 0;     // steps in a row
  double nudge_ = 0.0;  // off a saddle, the next one; of the radius
};

/// What the banded Hessian H leaves out of the exact one, times a motion: R v.
template <int D>
void Newton<D>::find_rest(const Eigen::VectorXd& v) {
  memory_.refined.setZero(step_.size());
  contact_->add_remainder({problem_.first, problem_.last, D, v}, memory_.refined);
  project<D>(problem_, memory_.refined);
}

/// Brings back what the banded Hessian H lacks of the exact one, R: (I + H^-1 R) step = -H^-1
/// gradient, by GMRES (Saad & Schultz 1986) from the banded step, as few directions as it takes.
/// Returns the slope of the energy along the step.
template <int D>
double Newton<D>::refine_step() {
  Eigen::VectorXd& refined = memory_.refined;
  memory_.krylov.resize(step_.size(), kMostDirections + 1);
  memory_.first_step = step_;
  find_rest(step_);
  if (refined.norm() <= kTuning.not_worth * gradient_.norm()) return slope_;
  solve_again(refined);
  const double start = refined.norm();
  if (start <= kTuning.enough * step_.norm()) {
    step_ -= refined;
  } else {
    add_krylov(memory_, start, kTuning.enough, step_, [this](const Eigen::VectorXd& v) {
      find_rest(v);
      solve_again(memory_.refined);
    });
  }
  // The energy falls along the banded Hessian's step; it must do so along the refined one.
  const double refined_slope = gradient_.dot(step_);
  if (refined_slope <= kTuning.kept_slope * slope_) return refined_slope;
  step_.swap(memory_.first_step);
  return slope_;
}

}  // namespace

template <int D>
NewtonResult solve_newton(const Problem& problem, RodState& state, const NewtonOptions& options,
                          SolveMemory& memory, BandMemory<D>& bands) {
  return Newton<D>(problem, state, options, memory, bands).solve();
}

template NewtonResult solve_newton<3>(const Problem&, RodState&, const NewtonOptions&, SolveMemory&,
                                      BandMemory<3>&);
template NewtonResult solve_newton<4>(const Problem&, RodState&, const NewtonOptions&, SolveMemory&,
                                      BandMemory<4>&);
template NewtonResult solve_newton<5>(const Problem&, RodState&, const NewtonOptions&, SolveMemory&,
                                      BandMemory<5>&);
template NewtonResult solve_newton<6>(const Problem&, RodState&, const NewtonOptions&, SolveMemory&,
                                      BandMemory<6>&);

}  // namespace wireplan::simulate
