#pragma once
/// A log of planning in memory, and one that knows what every run would come to, so that decisions
/// are tested without simulating.
#include <cstdio>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "plan/trial_log.h"

namespace wireplan::plan {

inline std::string text_of(const Run& run) {
  const Candidate& c = run.candidate;
  std::string text = std::string(level_name(run.level)) + " " + std::to_string(c.wire);
  const auto add = [&](double value) {
    char part[40];
    std::snprintf(part, sizeof part, " %.17g", value);
    text += part;
  };
  for (const double value : {c.inclination, c.azimuth, c.roll}) add(value);
  for (const simulate::Move& move : c.moves) {
    add(move.push);
    add(move.turn);
  }
  for (const simulate::ToolStep& step : c.steps) {
    text += " tool " + std::to_string(step.tool);
    add(step.push);
    add(step.turn);
    text += " until " + std::to_string(static_cast<int>(step.until));
    add(step.at);
    text += " tries " + std::to_string(step.tries) + " steers " + std::to_string(step.steers);
    text += " spare " + std::to_string(step.spare) + " side " + std::to_string(step.side);
  }
  text += " in " + std::to_string(c.catheter) + " after " + std::to_string(c.first_wire);
  if (run.elements) {
    text += " elements";
    add(run.elements->factor);
    add(run.elements->insertion);
    if (run.elements->setting) text += std::string(" ") + setting_name(*run.elements->setting);
  }
  if (run.disturbance) {
    const Disturbance& d = *run.disturbance;
    text += " disturbed";
    for (const double part : d.stiffness) add(part);
    for (const double value :
         {d.friction, d.wall_factor, d.tilt.x(), d.tilt.y(), d.shift.x(), d.shift.y(), d.inward}) {
      add(value);
    }
  }
  return text;
}

class MemoryLog : public TrialLog {
 public:
  std::optional<Measured> find(const Run& run) override {
    const auto found = known.find(text_of(run));
    if (found == known.end() || (run.shapes && !found->second.shapes)) return {};
    return found->second.measured;
  }
  void keep(const Run& run, const simulate::TrialResult& trial, const Measured& measured) override {
    const std::scoped_lock lock(mutex_);
    known[text_of(run)] = {measured, !trial.shapes.empty()};
    ++kept;
  }
  std::optional<Scripts> find_scripts() override { return scripts; }
  void keep_scripts(const Scripts& found) override { scripts = found; }

  struct Entry {
    Measured measured;
    bool shapes = false;
  };
  std::map<std::string, Entry> known;
  std::optional<Scripts> scripts;
  int kept = 0;  // runs that were simulated

 private:
  std::mutex mutex_;
};

class KnowingLog : public TrialLog {
 public:
  using Truth = std::function<Measured(const Run&)>;
  explicit KnowingLog(Truth truth) : truth_(std::move(truth)) {}

  std::optional<Measured> find(const Run& run) override {
    asked.push_back(run);
    return truth_(run);
  }
  void keep(const Run&, const simulate::TrialResult&, const Measured&) override {
    throw LogicError("nothing is left to be simulated");
  }
  std::optional<Scripts> find_scripts() override { return scripts; }
  void keep_scripts(const Scripts& found) override { scripts = found; }

  std::vector<Run> asked;
  std::optional<Scripts> scripts;

 private:
  Truth truth_;
};

}  // namespace wireplan::plan
