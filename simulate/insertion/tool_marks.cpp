// Places of ToolBench and ToolTrial that are gone back to, the centreline divided anew, and tips
// that are pressed.
#include <algorithm>
#include <cmath>
#include <utility>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::simulate {

bool ToolBench::divide(double longest) {
  const int before = elements_;
  elements_ = elements_over(longest, scene_.element_length);
  if (elements_ == before) return true;
  State next;
  place(now_.places, next);
  next.state = guess(next, follow(next), {}, 0.0);
  if (scene_.vessel != nullptr) next.memory = spread_contact(now_, next);
  if (!settle_from(next)) {
    elements_ = before;
    return false;
  }
  now_ = std::move(next);
  going_ = {};
  return true;
}

bool ToolBench::press(int tool, const Vec3& force) {
  expects(settled_ && tool >= 0 && tool < std::ssize(scene_.tools));
  const Vec3 pressed_before = std::exchange(pressed_, force);
  const int tool_before = std::exchange(pressed_tool_, tool);
  State next = now_;
  set_load(next.places, next.composite.rod, next.load);
  if (!settle_from(next)) {
    pressed_ = pressed_before;
    pressed_tool_ = tool_before;
    return false;
  }
  now_ = std::move(next);
  going_ = {};
  return true;
}

/// Finds the equilibrium near a state, in which friction holds what touched, and what is felt
/// there. False where there is none: contact is that of now again.
bool ToolBench::settle_from(State& next) {
  touch(next);
  double rubbed = 0.0;
  if (!solve(next) && !follow_jump(next, rubbed)) {
    touch(now_);
    return false;
  }
  if (contact_ != nullptr) {
    contact_->settle();
    next.memory = contact_->memory();
  }
  feel_at_rest(next);
  return true;
}

/// Energy and forces of a state that touched last, where no tool moves.
void ToolBench::feel_at_rest(State& at) {
  const std::vector<double> none(scene_.tools.size(), 0.0);
  find_energy(at);
  find_slopes(at, {none, none}, true);
  feel(at, {none, none});
}

ToolBench::ToolBench(const ToolBench& other) : scene_(other.scene_) {
  expects(other.settled_);
  restore(other.save());
}

ToolBench::Mark ToolBench::save() const {
  return {.elements = elements_,
          .tools = scene_.tools,
          .places = now_.places,
          .state = now_.state,
          .memory = now_.memory,
          .going = going_,
          .record = record_,
          .pressed = pressed_,
          .pressed_tool = pressed_tool_};
}

void ToolBench::restore(const Mark& mark) {
  elements_ = mark.elements;
  pressed_ = mark.pressed;
  pressed_tool_ = mark.pressed_tool;
  take(mark.tools);
  State at;
  place(mark.places, at);
  at.state = mark.state;
  at.memory = mark.memory;
  stand(std::move(at));
  going_ = mark.going;
  record_ = mark.record;
  settled_ = true;
  through_wall_ = false;
}

/// In an equilibrium that was found before.
void ToolBench::stand(State at) {
  touch(at);
  if (contact_ != nullptr) contact_->forget();
  feel_at_rest(at);
  now_ = std::move(at);
}

/// What the nodes remember, at the nodes of another division of the same centreline: of the nearest
/// node, for their share of length.
ContactMemory ToolBench::spread_contact(const State& from, const State& to) const {
  const ContactMemory& known = from.memory;
  const double h = from.composite.rod.rest_length[0], h_new = to.composite.rod.rest_length[0];
  const Eigen::Index last = from.state.x.cols() - 1, n = to.state.x.cols();
  ContactMemory memory{.x = to.state.x,
                       .sections = known.sections,
                       .normal_force = Eigen::VectorXd::Zero(n),
                       .anchor = at_rest(to.state.x),
                       .triangle = {}};
  if (!known.triangle.empty()) memory.triangle.assign(static_cast<std::size_t>(n), -1);
  const Eigen::Matrix3Xd known_at_rest = at_rest(known.x);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index nearest =
        std::min(last, static_cast<Eigen::Index>(std::lround(static_cast<double>(i) * h_new / h)));
    memory.normal_force[i] = known.normal_force[nearest] * h_new / h;
    memory.anchor.col(i) += known.anchor.col(nearest) - known_at_rest.col(nearest);
    if (known.triangle.empty()) continue;
    memory.triangle[static_cast<std::size_t>(i)] =
        known.triangle[static_cast<std::size_t>(nearest)];
  }
  return memory;
}

ToolTrial::Mark ToolTrial::save() const {
  expects(!ended());
  return {.bench = bench_.save(),
          .pushes = record_.pushes.size(),
          .shapes = record_.shapes.size(),
          .step = step_,
          .tries = tries_,
          .reshaped = record_.reshaped,
          .since_shape = since_shape_,
          .best_distance = best_distance_,
          .start_energy = start_energy_,
          .changes = record_.tools.back().changes};
}

void ToolTrial::restore(const Mark& mark) {
  bench_.restore(mark.bench);
  record_.pushes.resize(mark.pushes);
  if (vessel_.sections) record_.tips_at_rest.resize(mark.pushes, Vec3::Zero());
  record_.steps.resize(mark.pushes);
  step_ = mark.step;
  tries_ = mark.tries;
  record_.reshaped = mark.reshaped;
  record_.shapes.resize(mark.shapes);
  for (ToolTrack& track : record_.tools) {
    for (auto* column : {&track.insertion, &track.roll, &track.push_force, &track.hub_torque,
                         &track.tip_force, &track.wall_force}) {
      column->resize(mark.pushes);
    }
  }
  record_.tools.back().changes = mark.changes;
  since_shape_ = mark.since_shape;
  best_distance_ = mark.best_distance;
  start_energy_ = mark.start_energy;
  outcome_.reset();
  record_.outcome = Outcome::kFailed;
  record_.reason.clear();
}

}  // namespace wireplan::simulate
