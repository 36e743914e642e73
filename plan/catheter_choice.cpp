#include "plan/catheter_choice.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "plan/number_text.h"

namespace wireplan::plan {
namespace {

constexpr double kShapeStep = 0.25;  // along a shape [mm]

double in_degrees(double angle) { return angle / kRadPerDeg; }

/// Of branches that ask for a hooked curve [deg].
constexpr double kHookedFrom = 60.0, kHookedTo = 120.0;

/// How far a branch's take-off is from those that ask for that kind, in whole degrees, as well as
/// it is known.
double angle_off(CurveKind kind, double take_off) {
  const double angle = std::round(in_degrees(take_off));
  if (kind == CurveKind::kSimple) return std::max(0.0, angle - kHookedFrom);
  if (kind == CurveKind::kReversed) return std::max(0.0, kHookedTo - angle);
  return std::max({0.0, kHookedFrom - angle, angle - kHookedTo});
}

}  // namespace

const char* kind_name(CurveKind kind) {
  switch (kind) {
    case CurveKind::kStraight:
      return "straight tip";
    case CurveKind::kSimple:
      return "simple curve";
    case CurveKind::kHooked:
      return "hooked curve";
    case CurveKind::kReversed:
      return "reversed curve";
    case CurveKind::kRing:
      return "ring";
  }
  return "";
}

CurveShape find_shape(const simulate::Wire& tube) {
  // Sections are listed from the tip; the shape is laid out from the shaft on, along x.
  CurveShape shape;
  double angle = 0.0, across = 0.0, low = 0.0, high = 0.0;
  for (auto section = tube.sections.rbegin(); section != tube.sections.rend(); ++section) {
    if (section->rest_curvature == 0.0 && angle == 0.0) continue;  // the shaft
    const int steps = std::max(1, static_cast<int>(std::ceil(section->length / kShapeStep)));
    const double h = section->length / steps;
    for (int k = 0; k < steps; ++k) {
      angle += 0.5 * h * section->rest_curvature;
      across += h * std::sin(angle);
      angle += 0.5 * h * section->rest_curvature;
      shape.turn = std::max(shape.turn, std::abs(angle));
      low = std::min(low, across);
      high = std::max(high, across);
    }
  }
  // Curves that turn back first (Cobra) turn the tip by what they do from there.
  double from_tip = 0.0;
  for (const simulate::Section& section : tube.sections) {
    from_tip += section.length * section.rest_curvature;
    shape.turn = std::max(shape.turn, std::abs(from_tip));
  }
  shape.reach = high - low;
  const double turn = in_degrees(shape.turn);
  shape.kind = turn < 20.0    ? CurveKind::kStraight
               : turn < 75.0  ? CurveKind::kSimple
               : turn < 150.0 ? CurveKind::kHooked
               : turn < 300.0 ? CurveKind::kReversed
                              : CurveKind::kRing;
  return shape;
}

double curved_length(const simulate::Wire& tube, bool first) {
  double length = 0.0, end = 0.0;
  for (const simulate::Section& section : tube.sections) {
    length += section.length;
    if (section.rest_curvature == 0.0) continue;
    end = length;
    if (first) break;
  }
  return end;
}

double take_off_of(const Ostium& ostium) {
  return std::acos(std::clamp(ostium.trunk.dot(ostium.branch), -1.0, 1.0));
}

CurveKind asked_for(double take_off) {
  return in_degrees(take_off) < kHookedFrom ? CurveKind::kSimple
         : in_degrees(take_off) > kHookedTo ? CurveKind::kReversed
                                            : CurveKind::kHooked;
}

std::vector<Suggestion> suggest_catheters(const std::vector<Catheter>& catheters,
                                          const Ostium& ostium, std::size_t most) {
  const double take_off = take_off_of(ostium);
  const CurveKind kind = asked_for(take_off);
  struct Row {
    double angle_off = 0.0;  // from what is asked for
    double misfit = 0.0;
    int catheter = 0;
    CurveShape shape;
  };
  std::vector<Row> rows;
  for (int c = 0; c < std::ssize(catheters); ++c) {
    const simulate::Wire& tube = catheters[static_cast<std::size_t>(c)].tool.wire;
    const CurveShape shape = find_shape(tube);
    if (shape.kind == CurveKind::kStraight || shape.kind == CurveKind::kRing) continue;
    if (2.0 * tube.radius >= ostium.branch_diameter) continue;
    rows.push_back(
        {angle_off(shape.kind, take_off), std::abs(shape.reach - ostium.trunk_diameter), c, shape});
  }
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return std::tie(a.angle_off, a.misfit, a.catheter) <
           std::tie(b.angle_off, b.misfit, b.catheter);
  });
  std::vector<Suggestion> suggestions;
  for (const Row& row : rows) {
    if (suggestions.size() == most) break;
    std::string reason = "the branch turns by " + three_digits(in_degrees(take_off)) +
                         " degrees from its trunk, which asks for a " + kind_name(kind);
    if (row.shape.kind != kind) {
      reason += rows.front().shape.kind != kind ? ", of which none is there" : "";
      reason += std::string("; a ") + kind_name(row.shape.kind) + " comes next";
    }
    reason += "; this one's whole shape is " + three_digits(row.shape.reach) +
              " mm across, the trunk " + three_digits(ostium.trunk_diameter) +
              " mm and the branch " + three_digits(ostium.branch_diameter) + " mm";
    suggestions.push_back({row.catheter, std::move(reason)});
  }
  return suggestions;
}

void keep_suggested(Study& study) {
  std::vector<Catheter> kept;
  study.suggested.clear();
  if (const std::optional<Ostium> ostium = find_ostium(study.goal)) {
    for (Suggestion& suggestion : suggest_catheters(study.catheters, *ostium)) {
      kept.push_back(study.catheters[static_cast<std::size_t>(suggestion.catheter)]);
      study.suggested.push_back(std::move(suggestion.reason));
    }
  }
  study.catheters = std::move(kept);
}

}  // namespace wireplan::plan
