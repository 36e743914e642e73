#include "plan/candidates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "plan/catheter_choice.h"
#include "plan/side_vessels.h"
#include "plan/tool_neighbours.h"

namespace wireplan::plan {
namespace {

constexpr double kSameAngle = 1e-9;  // far below what a hand can set                    [rad]

bool same_angle(double a, double b) {
  return std::abs(std::remainder(a - b, 2.0 * kPi)) < kSameAngle;
}

/// The angles in their order, without those that repeat an earlier one up to full turns.
std::vector<double> distinct_angles(const std::vector<double>& angles) {
  std::vector<double> kept;
  for (const double angle : angles) {
    const bool seen =
        std::any_of(kept.begin(), kept.end(), [&](double k) { return same_angle(k, angle); });
    if (!seen) kept.push_back(angle);
  }
  return kept;
}

/// "15", "22.5": degrees without the rounding of the conversion, and never "-0".
std::string degrees(double angle) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", angle / kRadPerDeg + 0.0);
  return text;
}

}  // namespace

std::vector<Candidate> list_candidates(const Study& study) {
  expects(!study.wires.empty() && !study.inclinations.empty() && !study.azimuths.empty() &&
          !study.rolls.empty());
  const std::vector<double> inclinations = distinct_angles(study.inclinations);
  const std::vector<double> azimuths = distinct_angles(study.azimuths);
  const std::vector<double> rolls = distinct_angles(study.rolls);

  std::vector<Candidate> candidates;
  for (int wire = 0; wire < std::ssize(study.wires); ++wire) {
    const bool symmetric = study.wires[wire].straight() && study.wires[wire].round();
    const std::size_t roll_count = symmetric ? 1 : rolls.size();
    for (const double inclination : inclinations) {
      const std::size_t azimuth_count = same_angle(inclination, 0.0) ? 1 : azimuths.size();
      for (std::size_t a = 0; a < azimuth_count; ++a) {
        for (std::size_t r = 0; r < roll_count; ++r) {
          candidates.push_back({wire, inclination, azimuths[a], rolls[r]});
        }
      }
    }
  }
  return candidates;
}

Vec3 introducer_direction(const Vec3& tangent, double inclination, double azimuth) {
  expects(tangent.allFinite() && tangent.norm() > 0.0);
  const Vec3 t = tangent.normalized();
  const Vec3 u = simulate::reference_normal(t);
  const Vec3 side = std::cos(azimuth) * u + std::sin(azimuth) * t.cross(u);
  return (std::cos(inclination) * t + std::sin(inclination) * side).normalized();
}

simulate::Introducer make_introducer(const Study& study, const Candidate& candidate) {
  return {
      .point = study.access,
      .direction = introducer_direction(study.tangent, candidate.inclination, candidate.azimuth),
      .roll = candidate.roll};
}

Candidate first_candidate(const Study& study, const ToolPair& pair) {
  return {.wire = pair.wire,
          .inclination = study.inclinations.front(),
          .azimuth = study.azimuths.front(),
          .roll = study.rolls.front(),
          .catheter = pair.catheter};
}

std::vector<simulate::Tool> tools_of(const Study& study, const Candidate& candidate) {
  const int first = wires_of(candidate).front();
  return {study.catheters.at(static_cast<std::size_t>(candidate.catheter)).tool,
          {.wire = study.wires.at(static_cast<std::size_t>(first))}};
}

std::vector<int> wires_of(const Candidate& candidate) {
  if (candidate.first_wire < 0) return {candidate.wire};
  return {candidate.first_wire, candidate.wire};
}

int count_exchanges(const Candidate& candidate) {
  return static_cast<int>(
      std::count_if(candidate.steps.begin(), candidate.steps.end(),
                    [](const simulate::ToolStep& step) { return step.spare >= 0; }));
}

StepNames step_names(const Study& study, const Candidate& candidate) {
  StepNames names{.spare = study.wires.at(static_cast<std::size_t>(candidate.wire)).name};
  if (!is_reshaped(candidate.steps)) return names;
  for (const simulate::SideVessel& side : tool_options(study, candidate).sides) {
    names.sides[side.branch] = branch_name(study.goal.way->tree(), side.branch, side.from);
  }
  return names;
}

std::vector<ToldStep> describe_steps(const Study& study, const Candidate& candidate,
                                     double insertion) {
  return describe_steps(candidate.steps, insertion, step_names(study, candidate));
}

std::string describe_script(const Study& study, const Candidate& candidate, double insertion) {
  return describe_script(candidate.steps, insertion, step_names(study, candidate));
}

simulate::ToolTrialOptions tool_options(const Study& study, const Candidate& candidate) {
  simulate::ToolTrialOptions options{.friction_between = study.tool_rules.friction,
                                     .insertion = study.insertion,
                                     .take_off = find_ostium(study.goal)};
  if (candidate.first_wire >= 0) {
    options.spares = {study.wires.at(static_cast<std::size_t>(candidate.wire))};
  }
  const simulate::Wire& tube =
      study.catheters.at(static_cast<std::size_t>(candidate.catheter)).tool.wire;
  if (options.take_off && find_shape(tube).kind == CurveKind::kReversed) {
    options.sides = find_side_vessels(*study.goal.way, options.take_off->arc);
  }
  options.insertion.element_length *= kToolElements;
  return options;
}

double element_length_of(const Study& study, const Candidate& candidate) {
  return study.insertion.element_length * (candidate.catheter >= 0 ? kToolElements : 1.0);
}

std::string describe(const Study& study, const Candidate& candidate) {
  expects(candidate.wire >= 0 && candidate.wire < std::ssize(study.wires));
  std::string through;
  if (candidate.catheter >= 0) {
    through = " in " + study.catheters[static_cast<std::size_t>(candidate.catheter)].tool.wire.name;
  }
  if (candidate.first_wire >= 0) {
    through +=
        " in exchange for " + study.wires[static_cast<std::size_t>(candidate.first_wire)].name;
  }
  return study.wires[candidate.wire].name + through + ", inclination " +
         degrees(candidate.inclination) + " deg, azimuth " + degrees(candidate.azimuth) +
         " deg, roll " + degrees(candidate.roll) + " deg";
}

}  // namespace wireplan::plan
