// One tool in the place of another: of ToolBench, and of ToolTrial as a step of a script.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::simulate {

/// Has these be the tools. The wall is as rough as the roughest of them finds it.
void ToolBench::take(const std::vector<Tool>& tools) {
  double most = 0.0;
  for (const Tool& tool : tools) most = std::max(most, tool.wire.friction.value_or(0.0));
  if (most != scene_.contact.friction) contact_.reset();  // which holds a copy
  scene_.contact.friction = most;
  scene_.tools = tools;
}

void ToolBench::replace(int tool, const Tool& with, double roll) {
  const auto slot = static_cast<std::size_t>(tool);
  expects(settled_ && now_.places.at(slot).insertion == 0.0);
  expects(scene_.vessel == nullptr || with.wire.friction);
  const std::vector<int> twisted = now_.composite.terms.tool;
  const Shape before = shape();
  std::vector<Tool> tools = scene_.tools;
  tools[slot] = with;
  if (!with.wire.friction) tools[slot].wire.friction = 0.0;
  take(tools);

  // All lies as it did; a curve that is out of the body does not act.
  State at;
  std::vector<ToolPlace> places = now_.places;
  places[slot].roll = roll;
  place(places, at);
  at.state = now_.state;
  const std::vector<int>& now_twisted = at.composite.terms.tool;
  Eigen::MatrixXd angles(at.state.x.cols() - 1, std::ssize(now_twisted));
  for (std::size_t k = 0; k < now_twisted.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const auto known = std::find(twisted.begin(), twisted.end(), now_twisted[k]);
    if (now_twisted[k] == tool || known == twisted.end()) {
      angles.col(column).setConstant(places[static_cast<std::size_t>(now_twisted[k])].roll);
    } else {
      angles.col(column) = before.angles.col(known - twisted.begin());
    }
  }
  set_frames(angles, at.state);
  at.memory = now_.memory;
  stand(std::move(at));
  going_ = {};
  const std::vector<double> none(scene_.tools.size(), 0.0);
  report({none, none});
}

/// Whether the wire for which the goal counts is yet to be brought in.
bool ToolTrial::awaits_spare() const {
  return !options_.spares.empty() && record_.tools.back().changes.empty();
}

void ToolTrial::exchange(const ToolStep& step) {
  const int inner = static_cast<int>(record_.tools.size()) - 1;
  expects(inner > 0 && step.tool == inner && step.push == 0.0 && step.turn == 0.0);
  const Wire& spare = options_.spares.at(static_cast<std::size_t>(step.spare));
  advance({.tool = inner, .push = -insertion(inner)}, false, false);
  if (ended()) return;
  if (insertion(inner) > 0.0) {
    char text[96];
    std::snprintf(text, sizeof text,
                  "the tool outside the wire is %.1f mm in, too little to "
                  "exchange the wire through it",
                  insertion(inner - 1));
    return end_where_it_is(Outcome::kMissed, text);
  }
  Tool with{.wire = spare};
  with.wire.friction = friction_of(spare, options_.insertion);
  const double stored = bench_.record().energy.total();
  bench_.replace(inner, with, start_roll_);
  start_energy_ += bench_.record().energy.total() - stored;
  record_.tools.back().changes.push_back({.from = record_.pushes.size(), .name = spare.name});
  best_distance_ = (foremost_tip() - goal_.point).norm();
  advance({.tool = inner, .push = insertion(inner - 1) - step.at}, false, false);
}

}  // namespace wireplan::simulate
