#include "pipeline/files/trial_file.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>
#include <variant>

#include "pipeline/files/json_reader.h"
#include "pipeline/files/text.h"
#include "preprocess/files/vessel_io.h"
#include "simulate/insertion/start_line.h"

namespace wireplan::pipeline {
namespace {

using simulate::Outcome;
using simulate::Push;
using simulate::TrialResult;
using simulate::TriangleForce;
using simulate::WireContact;

constexpr const char* kSchema = "wireplan.trial/3";
constexpr std::size_t kVesselStates = 12;  // of a vessel that moves, about: each is a whole surface
constexpr std::string_view kShapesMagic = "wireplan.shapes/1\n";
constexpr std::string_view kToolShapesMagic = "wireplan.shapes/2\n";   // and tools' insertions
constexpr std::string_view kMovedShapesMagic = "wireplan.shapes/3\n";  // and the vessel's sections

constexpr std::array kOutcomes = {
    Outcome::kReached,   Outcome::kMissed,        Outcome::kPassedBy,     Outcome::kWrongBranch,
    Outcome::kLeftImage, Outcome::kStuck,         Outcome::kProlapsed,    Outcome::kAnotherWay,
    Outcome::kLeftLumen, Outcome::kCrossesItself, Outcome::kNotConverged, Outcome::kFailed};

// Numbers of a trial that failed may not be finite: null, with the trial's reason beside them.
Json value_json(double value) { return value; }
Json value_json(int value) { return value; }
Json value_json(const Vec3& value) { return to_json(value); }

void take(double& value, const Json& json) { value = number_of(json); }
void take(int& value, const Json& json) { value = json; }
void take(Vec3& value, const Json& json) { value = point_of(json); }

// A column for each field of a push.
Json pushes_to_json(const std::vector<Push>& pushes) {
  Json columns;
  for (const simulate::PushField& field : simulate::kPushFields) {
    Json column = Json::array();
    std::visit(
        [&](auto member) {
          for (const Push& push : pushes) column.push_back(value_json(push.*member));
        },
        field.member);
    columns[field.name] = std::move(column);
  }
  return columns;
}

std::vector<Push> pushes_from_json(const Json& columns) {
  std::vector<Push> pushes(columns.at(simulate::kPushFields.back().name).size());
  for (const simulate::PushField& field : simulate::kPushFields) {
    const Json& column = columns.at(field.name);
    std::visit(
        [&](auto member) {
          for (std::size_t k = 0; k < pushes.size(); ++k) take(pushes[k].*member, column.at(k));
        },
        field.member);
  }
  return pushes;
}

Json contacts_to_json(const std::vector<WireContact>& contacts) {
  Json rows = Json::array();
  for (const WireContact& contact : contacts) {
    rows.push_back({{"node", contact.node},
                    {"part", contact.part},
                    {"triangle", contact.triangle},
                    {"point_mm", to_json(contact.point)},
                    {"normal_force_n", to_json(contact.normal_force)},
                    {"friction_force_n", to_json(contact.friction_force)},
                    {"penetration_mm", contact.penetration},
                    {"wall_displacement_mm", contact.wall_displacement}});
  }
  return rows;
}

std::vector<WireContact> contacts_from_json(const Json& rows) {
  std::vector<WireContact> contacts;
  for (const Json& row : rows) {
    contacts.push_back({.node = row.at("node"),
                        .part = number_of(row.at("part")),
                        .triangle = row.at("triangle"),
                        .point = point_of(row.at("point_mm")),
                        .normal_force = point_of(row.at("normal_force_n")),
                        .friction_force = point_of(row.at("friction_force_n")),
                        .penetration = number_of(row.at("penetration_mm")),
                        .wall_displacement = number_of(row.at("wall_displacement_mm"))});
  }
  return contacts;
}

// Two columns: triangles of surface.vtp and their forces.
Json peaks_to_json(const std::vector<TriangleForce>& peaks) {
  Json triangles = Json::array(), forces = Json::array();
  for (const TriangleForce& peak : peaks) {
    triangles.push_back(peak.triangle);
    forces.push_back(peak.force);
  }
  return {{"triangle", std::move(triangles)}, {"force_n", std::move(forces)}};
}

std::vector<TriangleForce> peaks_from_json(const Json& columns) {
  std::vector<TriangleForce> peaks(columns.at("triangle").size());
  for (std::size_t k = 0; k < peaks.size(); ++k) {
    peaks[k] = {columns.at("triangle").at(k), number_of(columns.at("force_n").at(k))};
  }
  return peaks;
}

struct TrackField {
  const char* name;
  std::vector<double> simulate::ToolTrack::*column;
};
constexpr std::array kTrackFields = {
    TrackField{"insertion_mm", &simulate::ToolTrack::insertion},
    TrackField{"roll_rad", &simulate::ToolTrack::roll},
    TrackField{"push_force_n", &simulate::ToolTrack::push_force},
    TrackField{"hub_torque_n_mm", &simulate::ToolTrack::hub_torque},
    TrackField{"tip_force_n", &simulate::ToolTrack::tip_force},
    TrackField{"wall_force_n", &simulate::ToolTrack::wall_force}};

// What each tool did, a column for each of its numbers.
Json tracks_to_json(const std::vector<simulate::ToolTrack>& tools) {
  Json list = Json::array();
  for (const simulate::ToolTrack& track : tools) {
    Json own = {{"name", track.name}};
    for (const TrackField& field : kTrackFields) own[field.name] = track.*field.column;
    for (const auto& [from, name] : track.changes) {
      own["changes"].push_back({{"from", from}, {"name", name}});
    }
    list.push_back(std::move(own));
  }
  return list;
}

std::vector<simulate::ToolTrack> tracks_from_json(const Json& list) {
  std::vector<simulate::ToolTrack> tools;
  for (const Json& own : list) {
    simulate::ToolTrack& track = tools.emplace_back();
    track.name = own.at("name");
    for (const TrackField& field : kTrackFields) {
      for (const Json& value : own.at(field.name)) {
        (track.*field.column).push_back(number_of(value));
      }
    }
    for (const Json& change : own.value("changes", Json::array())) {
      track.changes.push_back({.from = change.at("from"), .name = change.at("name")});
    }
  }
  return tools;
}

constexpr std::array kToolNames = {"both", "catheter", "wire"};  // of ToolStep::tool, from -1
constexpr std::array kUntilNames = {"level_mm", "in_branch_mm", "facing_deg",
                                    "back_deg"};  // from kLevel on

const char* until_name(simulate::Until until) {
  return kUntilNames.at(static_cast<std::size_t>(until) - 1);
}

simulate::Until until_of(const std::string& name) {
  const auto found = std::find(kUntilNames.begin(), kUntilNames.end(), name);
  expects(found != kUntilNames.end());
  return static_cast<simulate::Until>(found - kUntilNames.begin() + 1);
}

// One key of the root per line: compact, and still to be read and compared by eye.
std::string to_lines(const Json& object) {
  std::ostringstream stream;
  const char* separator = "{";
  for (const auto& [key, value] : object.items()) {
    stream << separator << "\n" << Json(key) << ": " << value;
    separator = ",";
  }
  stream << "\n}\n";
  return stream.str();
}

}  // namespace

simulate::Outcome outcome_of(const std::string& name) {
  for (const Outcome outcome : kOutcomes) {
    if (name == simulate::outcome_name(outcome)) return outcome;
  }
  throw Error("outcome is " + name + ", expected one that this program knows");
}

std::string shapes_to_bytes(const std::vector<simulate::Shape>& shapes) {
  const bool moved = !shapes.empty() && shapes.front().sections.size() > 0,
             tools = moved || (!shapes.empty() && !shapes.front().tools.empty());
  std::string bytes(moved ? kMovedShapesMagic : tools ? kToolShapesMagic : kShapesMagic);
  const auto add = [&](const void* data, std::size_t count) {
    bytes.append(static_cast<const char*>(data), count);
  };
  const auto add_count = [&](Eigen::Index count) {
    const auto fixed = static_cast<std::uint64_t>(count);
    add(&fixed, sizeof fixed);
  };
  add_count(std::ssize(shapes));
  for (const simulate::Shape& shape : shapes) {
    expects(shape.contact_force.size() == shape.nodes.cols());
    add_count(shape.nodes.cols());
    add(&shape.insertion, sizeof(double));
    add(&shape.hub_angle, sizeof(double));
    add(shape.nodes.data(), sizeof(double) * static_cast<std::size_t>(shape.nodes.size()));
    add(shape.contact_force.data(),
        sizeof(double) * static_cast<std::size_t>(shape.contact_force.size()));
  }
  if (!tools) return bytes;
  add_count(std::ssize(shapes.front().tools));
  for (const simulate::Shape& shape : shapes) {
    expects(shape.tools.size() == shapes.front().tools.size());
    add(shape.tools.data(), sizeof(double) * shape.tools.size());
  }
  if (!moved) return bytes;
  add_count(shapes.front().sections.cols());
  for (const simulate::Shape& shape : shapes) {
    expects(shape.sections.cols() == shapes.front().sections.cols());
    add(shape.sections.data(), sizeof(double) * static_cast<std::size_t>(shape.sections.size()));
  }
  return bytes;
}

std::optional<std::vector<simulate::Shape>> shapes_from_bytes(const std::string& bytes) {
  const bool moved = bytes.starts_with(kMovedShapesMagic),
             tools = moved || bytes.starts_with(kToolShapesMagic);
  if (!tools && !bytes.starts_with(kShapesMagic)) return {};
  std::size_t at = kShapesMagic.size();
  const auto take = [&](void* data, std::size_t count) {
    if (bytes.size() - at < count) return false;
    if (count > 0) std::memcpy(data, bytes.data() + at, count);
    at += count;
    return true;
  };
  std::uint64_t count = 0;
  if (!take(&count, sizeof count)) return {};
  std::vector<simulate::Shape> shapes;
  for (std::uint64_t k = 0; k < count; ++k) {
    simulate::Shape shape;
    std::uint64_t nodes = 0;
    if (!take(&nodes, sizeof nodes) || nodes > bytes.size() / sizeof(double)) return {};
    shape.nodes.resize(3, static_cast<Eigen::Index>(nodes));
    shape.contact_force.resize(static_cast<Eigen::Index>(nodes));
    const bool whole = take(&shape.insertion, sizeof(double)) &&
                       take(&shape.hub_angle, sizeof(double)) &&
                       take(shape.nodes.data(), 3 * nodes * sizeof(double)) &&
                       take(shape.contact_force.data(), nodes * sizeof(double));
    if (!whole) return {};
    shapes.push_back(std::move(shape));
  }
  std::uint64_t each = 0;
  if (tools && (!take(&each, sizeof each) || each > simulate::kMostTools)) return {};
  for (simulate::Shape& shape : shapes) {
    shape.tools.resize(each);
    if (!take(shape.tools.data(), each * sizeof(double))) return {};
  }
  std::uint64_t sections = 0;
  if (moved && (!take(&sections, sizeof sections) || sections > bytes.size() / sizeof(double))) {
    return {};
  }
  for (simulate::Shape& shape : shapes) {
    shape.sections.resize(3, static_cast<Eigen::Index>(sections));
    if (!take(shape.sections.data(), 3 * sections * sizeof(double))) return {};
  }
  if (at != bytes.size()) return {};
  return shapes;
}

std::string trial_file_name(int id) { return format("trials/%04d.json", id); }

std::string trial_text(const plan::Study& study, const plan::Candidate& candidate,
                       const TrialResult& trial) {
  Json file;
  file["schema"] = kSchema;
  file["wire"] = study.wires[static_cast<std::size_t>(candidate.wire)].name;
  file["inclination_deg"] = clean(candidate.inclination / kRadPerDeg);
  file["azimuth_deg"] = clean(candidate.azimuth / kRadPerDeg);
  file["roll_deg"] = clean(candidate.roll / kRadPerDeg);
  if (!candidate.moves.empty()) file["moves"] = moves_json(candidate.moves);
  if (candidate.catheter >= 0) {
    file["catheter"] = study.catheters[static_cast<std::size_t>(candidate.catheter)].tool.wire.name;
    if (candidate.first_wire >= 0) {
      file["first_wire"] = study.wires[static_cast<std::size_t>(candidate.first_wire)].name;
    }
    file["steps"] = steps_json(candidate.steps);
    file["tools"] = tracks_to_json(trial.tools);
    file["step"] = trial.steps;
    if (trial.reshaped) file["reshaped"] = true;
    if (trial.support) {
      file["support"] = {{"push_n", trial.support->push}, {"more", trial.support->more}};
    }
  }
  file["outcome"] = simulate::outcome_name(trial.outcome);
  file["reason"] = trial.reason;
  file["terms"] = trial.terms;
  file["pushes"] = pushes_to_json(trial.pushes);
  file["nodes_mm"] = to_json(trial.nodes);
  if (trial.sections.size() > 0) file["sections_mm"] = to_json(trial.sections);
  if (!trial.tips_at_rest.empty()) {
    file["nodes_at_rest_mm"] = to_json(trial.nodes_at_rest);
    for (const Vec3& tip : trial.tips_at_rest) file["tips_at_rest_mm"].push_back(to_json(tip));
  }
  file["contacts"] = contacts_to_json(trial.contacts);
  file["peak_forces"] = peaks_to_json(trial.peak_forces);
  return to_lines(file);
}

Json moves_json(const std::vector<simulate::Move>& moves) {
  Json list = Json::array();
  for (const simulate::Move& move : moves) {
    Json row = Json::object();
    if (move.push != 0.0 || move.turn == 0.0) row["push_mm"] = clean(move.push);
    if (move.turn != 0.0) row["turn_deg"] = clean(move.turn / kRadPerDeg);
    list.push_back(std::move(row));
  }
  return list;
}

std::vector<simulate::Move> moves_of(const Json& list) {
  std::vector<simulate::Move> moves;
  for (const Json& move : list) {
    moves.push_back(
        {.push = move.value("push_mm", 0.0), .turn = move.value("turn_deg", 0.0) * kRadPerDeg});
  }
  return moves;
}

Json steps_json(const std::vector<simulate::ToolStep>& steps) {
  Json list = Json::array();
  for (const simulate::ToolStep& step : steps) {
    Json row = {{"tool", kToolNames.at(static_cast<std::size_t>(step.tool + 1))}};
    if (step.spare >= 0) {
      row["exchange"] = {{"wire", step.spare}, {"behind_mm", clean(step.at)}};
    } else if (step.turn != 0.0) {
      row["turn_deg"] = clean(step.turn / kRadPerDeg);
    } else {
      row["push_mm"] = clean(step.push);
    }
    if (step.until != simulate::Until::kMade) {
      const bool angle = simulate::ends_by_angle(step.until);
      row["until"] = {{until_name(step.until), clean(angle ? step.at / kRadPerDeg : step.at)}};
    }
    if (step.tries > 0) {
      row["tries"] = {{"most", step.tries},
                      {"pull_mm", clean(step.try_pull)},
                      {"turn_deg", clean(step.try_turn / kRadPerDeg)}};
    }
    if (step.steers > 0) row["steers"] = step.steers;
    if (step.side >= 0) row["side_branch"] = step.side + 1;
    if (step.seats) row["seats"] = true;
    list.push_back(std::move(row));
  }
  return list;
}

std::vector<simulate::ToolStep> steps_of(const Json& list) {
  std::vector<simulate::ToolStep> steps;
  for (const Json& row : list) {
    const std::string name = row.at("tool");
    const auto found = std::find(kToolNames.begin(), kToolNames.end(), name);
    expects(found != kToolNames.end());
    steps.push_back({.tool = static_cast<int>(found - kToolNames.begin()) - 1,
                     .push = row.value("push_mm", 0.0),
                     .turn = row.value("turn_deg", 0.0) * kRadPerDeg,
                     .until = {},
                     .at = 0.0});
    simulate::ToolStep& step = steps.back();
    step.steers = row.value("steers", 0);
    step.side = row.value("side_branch", 0) - 1;
    step.seats = row.value("seats", false);
    if (row.contains("exchange")) {
      step.spare = row.at("exchange").at("wire");
      step.at = number_of(row.at("exchange").at("behind_mm"));
    }
    if (row.contains("tries")) {
      step.tries = row.at("tries").at("most");
      step.try_pull = number_of(row.at("tries").at("pull_mm"));
      step.try_turn = number_of(row.at("tries").at("turn_deg")) * kRadPerDeg;
    }
    if (!row.contains("until")) continue;
    const Json::const_iterator until = row.at("until").begin();
    step.until = until_of(until.key());
    step.at = number_of(until.value()) * (simulate::ends_by_angle(step.until) ? kRadPerDeg : 1.0);
  }
  return steps;
}

std::optional<TrialResult> find_trial(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  const Json file = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  if (!file.is_object() || file.value("schema", "") != kSchema) return {};
  TrialResult trial;
  trial.outcome = outcome_of(file.at("outcome"));
  trial.reason = file.at("reason");
  trial.terms = file.at("terms").get<std::vector<std::string>>();
  trial.pushes = pushes_from_json(file.at("pushes"));
  trial.nodes = points_of(file.at("nodes_mm"));
  if (file.contains("sections_mm")) trial.sections = points_of(file.at("sections_mm"));
  if (file.contains("tips_at_rest_mm")) {
    trial.nodes_at_rest = points_of(file.at("nodes_at_rest_mm"));
    const Eigen::Matrix3Xd tips = points_of(file.at("tips_at_rest_mm"));
    for (Eigen::Index k = 0; k < tips.cols(); ++k) trial.tips_at_rest.emplace_back(tips.col(k));
  }
  trial.contacts = contacts_from_json(file.at("contacts"));
  trial.peak_forces = peaks_from_json(file.at("peak_forces"));
  if (file.contains("tools")) {
    trial.tools = tracks_from_json(file.at("tools"));
    trial.steps = file.at("step").get<std::vector<int>>();
    trial.reshaped = file.value("reshaped", false);
    if (file.contains("support")) {
      const Json& support = file.at("support");
      trial.support = {.push = support.at("push_n"), .more = support.at("more")};
    }
  }
  return trial;
}

TrialResult read_trial_file(const std::filesystem::path& path) {
  std::optional<TrialResult> trial = find_trial(path);
  expects(trial.has_value());
  return std::move(*trial);
}

namespace {

/// When each shape is shown: at its insertion. Where pulls, turns and tools by turns bring one up
/// again, which a viewer would show as one, at its number.
std::vector<double> times_of(const std::vector<simulate::Shape>& shapes) {
  bool ascends = shapes.empty() || shapes.front().tools.empty();
  for (std::size_t k = 1; k < shapes.size(); ++k) {
    ascends = ascends && shapes[k].insertion > shapes[k - 1].insertion;
  }
  std::vector<double> times;
  for (const simulate::Shape& shape : shapes) {
    times.push_back(ascends ? shape.insertion : static_cast<double>(times.size()));
  }
  return times;
}

}  // namespace

void write_tool_shapes(const std::vector<simulate::Shape>& shapes, std::size_t tool,
                       const std::string& name, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / name);
  std::vector<std::filesystem::path> files;
  for (const simulate::Shape& shape : shapes) {
    files.push_back(folder / name / (std::to_string(files.size()) + ".vtp"));
    preprocess::write_polyline(simulate::line_up_to(shape.nodes, shape.tools.at(tool)), {},
                               files.back());
  }
  preprocess::write_time_series(files, times_of(shapes), folder / (name + ".pvd"));
}

void write_shapes(const TrialResult& trial, const std::string& name,
                  const std::filesystem::path& folder) {
  if (!trial.shapes.empty() && !trial.shapes.front().tools.empty()) {
    write_tool_shapes(trial.shapes, 0, name + "-catheter", folder);
    write_tool_shapes(trial.shapes, trial.shapes.front().tools.size() - 1, name, folder);
    return;
  }
  std::filesystem::create_directories(folder / name);
  std::vector<std::filesystem::path> files;
  for (const simulate::Shape& shape : trial.shapes) {
    const std::vector<double> force(shape.contact_force.begin(), shape.contact_force.end());
    files.push_back(folder / name / (std::to_string(files.size()) + ".vtp"));
    preprocess::write_polyline(shape.nodes, {{"contact_force_n", force}}, files.back());
  }
  preprocess::write_time_series(files, times_of(trial.shapes), folder / (name + ".pvd"));
}

void write_moved_vessel(const std::vector<simulate::Shape>& shapes, const Surface& vessel,
                        const simulate::SectionChain& chain, const std::string& name,
                        const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / name);
  std::vector<std::filesystem::path> files;
  const std::vector<double> all_times = times_of(shapes);
  std::vector<double> times;
  // The last, and so many before it at even steps.
  const std::size_t count = shapes.size(), step = std::max<std::size_t>(1, count / kVesselStates);
  for (std::size_t k = (count - 1) % step; k < count; k += step) {
    const simulate::Shape& shape = shapes[k];
    if (shape.sections.cols() != chain.nodes()) continue;
    Surface moved = vessel;
    moved.vertices = chain.carried(vessel.vertices, shape.sections);
    files.push_back(folder / name / (std::to_string(files.size()) + ".vtp"));
    preprocess::write_surface(moved, files.back());
    times.push_back(all_times[k]);
  }
  preprocess::write_time_series(files, times, folder / (name + ".pvd"));
}

}  // namespace wireplan::pipeline
