#include "plan/settings.h"

#include <algorithm>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::plan {
namespace {

// Far below what a hand can set and a coating is known to; chosen.
constexpr double kTinyRoll = 0.01 * kRadPerDeg;
constexpr double kTinyFriction = 1.001;
constexpr double kTighter = 0.1;  // of the residual

}  // namespace

const char* setting_name(Setting setting) {
  switch (setting) {
    case Setting::kStep:
      return "step";
    case Setting::kRoll:
      return "roll";
    case Setting::kFriction:
      return "friction";
    case Setting::kTolerance:
      return "tolerance";
  }
  throw LogicError("a setting without a name");
}

std::string describe_setting(Setting setting) {
  switch (setting) {
    case Setting::kStep:
      return "with pushes half as long";
    case Setting::kRoll:
      return "with the hub turned by 0.01 deg";
    case Setting::kFriction:
      return "with 0.1 % more friction";
    case Setting::kTolerance:
      return "with a tenth of the residual";
  }
  throw LogicError("a setting without words");
}

std::vector<Setting> settings_that_act(const Study& study, const Candidate& candidate) {
  bool rolls = false, rubs = false;
  for (const int k : wires_of(candidate)) {
    const simulate::Wire& wire = study.wires.at(static_cast<std::size_t>(k));
    rolls = rolls || !wire.straight() || !wire.round();
    rubs = rubs || simulate::friction_of(wire, study.insertion) > 0.0;
  }
  std::vector<Setting> settings = {Setting::kStep, Setting::kTolerance};
  if (rolls) settings.push_back(Setting::kRoll);
  if (rubs) settings.push_back(Setting::kFriction);
  return settings;
}

void change_setting(Setting setting, Study& study, Candidate& candidate) {
  switch (setting) {
    case Setting::kStep:
      study.insertion.step *= 0.5;
      if (candidate.catheter >= 0) {  // whose parts are half as long as a step, up to that
        study.insertion.step = std::min(study.insertion.step, simulate::kLongestToolPart);
      }
      return;
    case Setting::kRoll:
      candidate.roll += kTinyRoll;
      return;
    case Setting::kFriction:
      study.insertion.friction_factor *= kTinyFriction;
      return;
    case Setting::kTolerance:
      study.insertion.residual_tolerance *= kTighter;
      return;
  }
}

}  // namespace wireplan::plan
