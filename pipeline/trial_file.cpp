#include "pipeline/trial_file.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <utility>

#include "pipeline/json_reader.h"

namespace wireplan::pipeline {
namespace {

using simulate::NodeContact;
using simulate::Outcome;
using simulate::Push;
using simulate::TrialResult;

constexpr const char* kSchema = "wireplan.trial/1";

constexpr std::array kOutcomes = {Outcome::kReached,   Outcome::kMissed,       Outcome::kStuck,
                                  Outcome::kLeftLumen, Outcome::kNotConverged, Outcome::kFailed};

// The numbers of a push, each a column of the file.
constexpr std::array<std::pair<const char*, double Push::*>, 8> kColumns = {{
    {"insertion_mm", &Push::insertion},
    {"push_force_n", &Push::push_force},
    {"tip_force_n", &Push::tip_force},
    {"peak_contact_force_n", &Push::peak_contact_force},
    {"total_contact_force_n", &Push::total_contact_force},
    {"max_penetration_mm", &Push::max_penetration},
    {"peak_curvature_per_mm", &Push::peak_curvature},
    {"residual_n", &Push::residual},
}};

// A number of a trial that failed may not be finite: null, with the trial's reason beside it.
double number(const Json& value) { return value.is_null() ? std::nan("") : value.get<double>(); }

Vec3 point(const Json& row) { return {number(row.at(0)), number(row.at(1)), number(row.at(2))}; }

Outcome outcome_of(const std::string& name) {
  for (const Outcome outcome : kOutcomes) {
    if (name == simulate::outcome_name(outcome)) return outcome;
  }
  throw Error("outcome is " + name + ", expected one that this program knows");
}

Json pushes_to_json(const std::vector<Push>& pushes) {
  Json columns;
  for (const auto& [name, member] : kColumns) {
    Json column = Json::array();
    for (const Push& push : pushes) column.push_back(push.*member);
    columns[name] = std::move(column);
  }
  Json tips = Json::array(), iterations = Json::array();
  for (const Push& push : pushes) {
    tips.push_back(to_json(push.tip));
    iterations.push_back(push.iterations);
  }
  columns["tip_mm"] = std::move(tips);
  columns["iterations"] = std::move(iterations);
  return columns;
}

std::vector<Push> pushes_from_json(const Json& columns) {
  std::vector<Push> pushes(columns.at("iterations").size());
  for (std::size_t k = 0; k < pushes.size(); ++k) {
    for (const auto& [name, member] : kColumns) pushes[k].*member = number(columns.at(name).at(k));
    pushes[k].tip = point(columns.at("tip_mm").at(k));
    pushes[k].iterations = columns.at("iterations").at(k);
  }
  return pushes;
}

Json contacts_to_json(const std::vector<NodeContact>& contacts) {
  Json rows = Json::array();
  for (const NodeContact& contact : contacts) {
    rows.push_back({{"node", contact.node},
                    {"point_mm", to_json(contact.point)},
                    {"force_n", to_json(contact.force)},
                    {"penetration_mm", contact.penetration}});
  }
  return rows;
}

std::vector<NodeContact> contacts_from_json(const Json& rows) {
  std::vector<NodeContact> contacts;
  for (const Json& row : rows) {
    contacts.push_back({row.at("node"), point(row.at("point_mm")), point(row.at("force_n")),
                        number(row.at("penetration_mm"))});
  }
  return contacts;
}

// One key of the root per line: compact, and still to be read and compared by eye. Renamed into
// place, so that a file of that name is whole.
void write_lines(const Json& object, const std::filesystem::path& path) {
  std::filesystem::path beside = path;
  beside += ".part-" + std::to_string(::getpid());
  std::ofstream stream(beside, std::ios::binary);
  const char* separator = "{";
  for (const auto& [key, value] : object.items()) {
    stream << separator << "\n" << Json(key) << ": " << value;
    separator = ",";
  }
  stream << "\n}\n";
  stream.close();
  if (stream) std::filesystem::rename(beside, path);
  if (!stream) {
    throw Error(path.string() + ": cannot be written (" + std::strerror(errno) +
                "); free some space or choose another folder with --cache");
  }
}

}  // namespace

std::string trial_file_name(int id) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "trials/%04d.json", id);
  return name.data();
}

void write_trial(int id, const plan::Study& study, const plan::Candidate& candidate,
                 const TrialResult& trial, const std::filesystem::path& path) {
  Json file;
  file["schema"] = kSchema;
  file["id"] = id;
  file["wire"] = study.wires[static_cast<std::size_t>(candidate.wire)].name;
  file["inclination_deg"] = clean(candidate.inclination / kRadPerDeg);
  file["azimuth_deg"] = clean(candidate.azimuth / kRadPerDeg);
  file["roll_deg"] = clean(candidate.roll / kRadPerDeg);
  file["outcome"] = simulate::outcome_name(trial.outcome);
  file["reason"] = trial.reason;
  file["terms"] = trial.terms;
  file["pushes"] = pushes_to_json(trial.pushes);
  file["nodes_mm"] = to_json(trial.nodes);
  file["contacts"] = contacts_to_json(trial.contacts);
  write_lines(file, path);
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
  const Json& nodes = file.at("nodes_mm");
  trial.nodes.resize(3, static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    trial.nodes.col(static_cast<Eigen::Index>(k)) = point(nodes[k]);
  }
  trial.contacts = contacts_from_json(file.at("contacts"));
  return trial;
}

}  // namespace wireplan::pipeline
