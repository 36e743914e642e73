#include "pipeline/files/hand_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "pipeline/files/text.h"

namespace wireplan::pipeline {
namespace {

constexpr Range kMoreThanNothing{.min = 0.0, .open_min = true};
constexpr Range kHubTurn{.min = -36000.0, .max = 36000.0};
constexpr Range kHubRoll{.min = -360.0, .max = 360.0};
constexpr double kFarFromEntry = 10.0;   // that a line of the scene may pass it by           [mm]
constexpr double kLeastMeasured = 30.0;  // of wire that tells how a vessel is held; chosen    [mm]
constexpr std::size_t kMostRolls = 360, kMostMoves = 10000;
constexpr double kMostSteps = 1e6;  // hours

/// One roll, or a list of them; none where a wire that starts from a line is to tell its own.
void read_rolls(JsonReader& insertion, bool starts, InsertionScene& scene) {
  scene.roll_zero = roll_of_anterior(scene.introducer.direction);
  scene.introducer.roll = scene.roll_zero;
  if (scene.start) scene.start->find_roll = !insertion.has("roll_deg");
  if (starts && !insertion.has("roll_deg")) return;
  if (!insertion.raw("roll_deg").is_array()) {
    scene.introducer.roll += insertion.number("roll_deg", 0.0, kHubRoll) * kRadPerDeg;
    return;
  }
  const std::vector<double> given = insertion.numbers("roll_deg", std::nullopt, kHubRoll);
  constexpr double kSameName = 1e-6;  // degrees
  for (std::size_t k = 0; k < given.size(); ++k) {
    const auto is_same = [&](double roll) { return std::abs(roll - given[k]) < kSameName; };
    if (std::any_of(given.begin(), given.begin() + static_cast<std::ptrdiff_t>(k), is_same)) {
      insertion.problems().add(insertion.path_of("roll_deg") + "[" + std::to_string(k) + "]",
                               Json(given[k]).dump() + " again", "each roll once",
                               "its result has the roll's name");
    }
    scene.rolls.push_back(scene.roll_zero + given[k] * kRadPerDeg);
  }
  if (given.size() > kMostRolls) {
    insertion.problems().add(insertion.path_of("roll_deg"), std::to_string(given.size()) + " rolls",
                             "at most " + std::to_string(kMostRolls));
  }
  if (!scene.rolls.empty()) scene.introducer.roll = scene.rolls.front();
}

/// {"push_mm": 50}, {"pull_mm": 10}, {"turn_deg": 90}, or a turn beside one of the others.
simulate::Move read_move(JsonReader& reader) {
  simulate::Move move;
  const bool pushes = reader.has("push_mm"), pulls = reader.has("pull_mm");
  const bool turns = reader.has("turn_deg");
  if (pushes) move.push = reader.number("push_mm", std::nullopt, kMoreThanNothing);
  if (pulls) {
    const double pull = reader.number("pull_mm", std::nullopt, kMoreThanNothing);
    if (!pushes) move.push = -pull;
  }
  if (turns) {
    move.turn = reader.number("turn_deg", std::nullopt, kHubTurn) * kRadPerDeg;
    if (move.turn == 0.0) {
      reader.problems().add(reader.path_of("turn_deg"), "0", "an angle other than 0",
                            "right-handed about the direction; leave it out for no turn");
    }
  }
  if (pushes && pulls) {
    reader.problems().add(reader.path_of("pull_mm"), "given beside push_mm", "one of both",
                          "make two moves of it");
  }
  reader.finish();
  if (!pushes && !pulls && !turns) {
    reader.problems().add(reader.path_of("push_mm"), "missing",
                          "push_mm, pull_mm, turn_deg, or a turn beside a push or a pull");
  }
  return move;
}

/// Follows the wire in the vessel through the moves, from `depth` on: some stays there, and no more
/// goes in than there is.
void check_moves(JsonReader& insertion, double depth, InsertionScene& scene) {
  const double whole = scene.wire.length(), least = scene.options.step;
  scene.options.length = std::max(scene.options.length, depth);
  for (std::size_t k = 0; k < scene.moves.size(); ++k) {
    const simulate::Move& move = scene.moves[k];
    const std::string key = insertion.path_of("moves") + "[" + std::to_string(k) + "]";
    const double before = depth;
    depth += move.push;
    if (move.push < 0.0 && depth < least - 1e-9) {
      insertion.problems().add(key + ".pull_mm", Json(-move.push).dump(),
                               "at most " + format("%.6g", std::max(0.0, before - least)) +
                                   ", so that step_mm of the wire stays in the vessel",
                               format("%.6g mm are in it by then", before));
      return;
    }
    if (depth > whole + 1e-9) {
      insertion.problems().add(
          key + ".push_mm", Json(move.push).dump(), "at most " + format("%.6g", whole - before),
          format("the wire is %.6g mm long, and %.6g mm are in by then", whole, before));
      return;
    }
    if (depth <= 0.0) {
      insertion.problems().add(key + ".turn_deg", "given before a push", "a push first",
                               "the wire is not in the vessel yet; roll_deg rolls the hub");
      return;
    }
    scene.options.length = std::max(scene.options.length, depth);
  }
}

void read_moves(JsonReader& insertion, InsertionScene& scene) {
  if (insertion.raw("moves").is_array() && insertion.raw("moves").empty()) {
    insertion.problems().add(insertion.path_of("moves"), "[]", "one move at least",
                             "for a straight push give length_mm");
  }
  std::vector<JsonReader> readers = insertion.objects("moves", true);
  if (readers.size() > kMostMoves) {
    insertion.problems().add(insertion.path_of("moves"), std::to_string(readers.size()) + " moves",
                             "at most " + std::to_string(kMostMoves));
    return;
  }
  for (JsonReader& reader : readers) scene.moves.push_back(read_move(reader));
  if (insertion.has("length_mm")) {
    insertion.problems().add(insertion.path_of("length_mm"), "given beside moves", "no such key",
                             "the moves tell how far; delete either");
  }
}

/// "nodes_mm"; what the line is to the entry is checked once that is known.
Eigen::Matrix3Xd read_line(JsonReader& reader) {
  const std::vector<Vec3> nodes = reader.points("nodes_mm", true);
  Eigen::Matrix3Xd line(3, static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t k = 0; k < nodes.size(); ++k) line.col(static_cast<Eigen::Index>(k)) = nodes[k];
  if (nodes.size() == 1) {
    reader.problems().add(reader.path_of("nodes_mm"), "one point",
                          "two points at least, proximal to distal");
  }
  return line;
}

/// The line that the wire starts from.
simulate::StartLine read_start(JsonReader& root) {
  simulate::StartLine line;
  JsonReader start = root.object("start", true);
  line.nodes = read_line(start);
  if (start.has("length_mm"))
    line.length = start.number("length_mm", std::nullopt, kMoreThanNothing);
  start.finish();
  return line;
}

MeasuredWire read_measured(JsonReader& root) {
  MeasuredWire wire;
  JsonReader measured = root.object("measured", true);
  wire.line = read_line(measured);
  wire.sigma = measured.number("sigma_mm", wire.sigma, {.min = 0.01, .max = 100.0});
  measured.finish();
  return wire;
}

/// The part of a line of the scene ("start", "measured") from the entry on; empty, and told, where
/// it does not come by there.
Eigen::Matrix3Xd line_from(const Eigen::Matrix3Xd& nodes, const Vec3& entry, const char* key,
                           double least, Problems& problems) {
  const double off = (simulate::nearest_on_line(nodes, entry) - entry).norm();
  if (off > kFarFromEntry) {
    problems.add(key, format("%.1f mm from insertion.point_mm at the nearest", off),
                 format("a line that comes within %.0f mm of it", kFarFromEntry),
                 "the wire goes from there on along the line; move the point onto it");
    return {};
  }
  Eigen::Matrix3Xd line = simulate::line_from_entry(nodes, entry);
  const double length = simulate::arc_length(line);
  if (length >= least) return line;
  problems.add(key, format("%.3g mm long from insertion.point_mm on", length),
               format("at least %.3g mm", least),
               "points go from proximal to distal; give the other order?");
  return {};
}

/// Makes the length that is in the vessel at the start sure.
void check_start(Problems& problems, InsertionScene& scene) {
  simulate::StartLine& start = *scene.start;
  const double whole = scene.wire.length();
  if (start.length > whole) {
    problems.add("start.length_mm", Json(start.length).dump(),
                 "at most the wire's length, " + Json(whole).dump());
  }
  if (!problems.empty()) return;
  const Eigen::Matrix3Xd line = line_from(start.nodes, scene.introducer.point, "start.nodes_mm",
                                          4.0 * scene.options.step, problems);
  if (line.cols() == 0) return;
  const double length = simulate::arc_length(line);
  if (start.length == 0.0) start.length = length;
  if (start.length > whole) {
    problems.add("start.nodes_mm", format("%.6g mm long from insertion.point_mm on", length),
                 "at most the wire's length, " + Json(whole).dump(),
                 "make the wire longer, or say with start.length_mm how much of it lies there");
  } else if (std::abs(length - start.length) > 0.05 * start.length) {
    problems.add("start.length_mm", Json(start.length).dump(),
                 format("the line's length from insertion.point_mm on, %.6g, within 5 %%", length),
                 "leave it out to take that");
  }
}

/// Expects to know where the wire is in the end.
void check_measured(Problems& problems, double depth, InsertionScene& scene) {
  MeasuredWire& wire = *scene.measured;
  wire.line =
      line_from(wire.line, scene.introducer.point, "measured.nodes_mm", kLeastMeasured, problems);
  if (wire.line.cols() == 0) return;
  const double length = simulate::arc_length(wire.line);
  if (std::abs(length - depth) > 0.05 * depth) {
    problems.add("measured.nodes_mm", format("%.6g mm long from insertion.point_mm on", length),
                 format("as much as is in the vessel in the end, %.6g mm, within 5 %%", depth),
                 "push in as much of the wire as was measured");
  }
  if (!scene.rolls.empty()) {
    problems.add("insertion.roll_deg", std::to_string(scene.rolls.size()) + " rolls",
                 "one roll where \"measured\" is given", "the support is sought for one wire");
  }
}

/// So many steps that nobody waits for their end are a slip in step_mm.
void check_steps(Problems& problems, const InsertionScene& scene) {
  double way = scene.depth ? std::abs(*scene.depth - scene.start->length) : 0.0;
  if (scene.moves.empty() && !scene.start) way = scene.options.length;
  for (const simulate::Move& move : scene.moves) way += std::abs(move.push);
  if (way <= kMostSteps * scene.options.step) return;
  problems.add("insertion.step_mm", Json(scene.options.step).dump(),
               format("at least %.3g, of which a million make all moves", way / kMostSteps));
}

}  // namespace

double roll_of_anterior(const Vec3& direction) {
  constexpr double kAlongY = 1e-6;  // sine
  const Vec3 anterior = -Vec3::UnitY(), from = simulate::reference_normal(direction);
  const Vec3 square = anterior - anterior.dot(direction) * direction;
  if (square.norm() < kAlongY || from.isApprox(square.normalized(), 1e-12)) return 0.0;
  return std::atan2(square.dot(direction.cross(from)), square.dot(from));
}

void read_hand(JsonReader& root, InsertionScene& scene) {
  if (root.has("start")) scene.start = read_start(root);
  if (root.has("measured")) scene.measured = read_measured(root);
  JsonReader insertion = root.object("insertion", true);
  scene.introducer.point = insertion.point("point_mm", std::nullopt);
  scene.introducer.direction = insertion.direction("direction", std::nullopt);
  read_rolls(insertion, scene.start.has_value(), scene);
  scene.options.step = insertion.number("step_mm", scene.options.step, kMoreThanNothing);
  const bool moves = insertion.has("moves");
  if (moves) read_moves(insertion, scene);
  const bool pushed = insertion.has("length_mm") || (!moves && !scene.start);
  if (pushed) {
    scene.options.length = insertion.number("length_mm", std::nullopt, kMoreThanNothing);
  }
  scene.options.push_on = insertion.choice("when_stuck", "stop", {"stop", "push_on"}) == "push_on";
  insertion.finish();
  if (scene.start) check_start(root.problems(), scene);
  if (!root.problems().empty()) return;
  if (pushed && !moves && scene.options.length > scene.wire.length()) {
    root.problems().add("insertion.length_mm", Json(scene.options.length).dump(),
                        "at most the wire's length, " + Json(scene.wire.length()).dump());
  }
  double depth = scene.start ? scene.start->length : 0.0;
  if (moves) {
    scene.options.length = 0.0;
    check_moves(insertion, depth, scene);
    for (const simulate::Move& move : scene.moves) depth += move.push;
  } else if (scene.start) {
    scene.depth = pushed ? scene.options.length : depth;
    scene.options.length = std::max(depth, *scene.depth);
    depth = *scene.depth;
  } else {
    depth = scene.options.length;
  }
  if (scene.measured) check_measured(root.problems(), depth, scene);
  check_steps(root.problems(), scene);
}

}  // namespace wireplan::pipeline
