#include "pipeline/files/result_file.h"

#include <algorithm>
#include <cmath>

namespace wireplan::pipeline {
namespace {

constexpr const char* kResultSchema = "wireplan.result/1";
constexpr const char* kNotFinite = "the solver left no finite number here";

/// Adds the value, or null and the reason where it is not finite.
void put(Json& object, const std::string& key, double value, const char* reason = kNotFinite) {
  object[key] = std::isfinite(value) ? Json(value) : Json();
  if (!std::isfinite(value)) object[key + "_reason"] = reason;
}

/// The same for angles; `reason` tells why there are none.
void put_angles(Json& object, const std::string& key, const Eigen::VectorXd& angles,
                const char* reason) {
  const bool given = angles.size() > 0 && angles.allFinite();
  object[key] = given ? Json(std::vector<double>(angles.begin(), angles.end())) : Json();
  if (!given) object[key + "_reason"] = angles.size() == 0 ? reason : kNotFinite;
}

template <typename Matrix>
void put_points(Json& object, const std::string& key, const Matrix& points) {
  object[key] = points.allFinite() ? to_json(points) : Json();
  if (!points.allFinite()) object[key + "_reason"] = kNotFinite;
}

Json energy_json(const simulate::SceneResult& result) {
  Json json = Json::object();
  put(json, "stretch", result.energy.stretch);
  put(json, "bend", result.energy.bend);
  put(json, "twist", result.energy.twist);
  put(json, "gravity", result.gravity_energy);
  put(json, "tip_force", result.energy.load - result.gravity_energy - result.moment_energy);
  put(json, "tip_moment", result.moment_energy);
  put(json, "contact", result.energy.contact);
  put(json, "wall", result.energy.wall);
  put(json, "total", result.energy.total());
  return json;
}

Json reaction_json(const simulate::Reaction& reaction) {
  Json json = {{"at", reaction.at == simulate::WireEnd::kProximal ? "proximal" : "distal"}};
  put_points(json, "force_n", reaction.force);
  put_points(json, "moment_n_mm", reaction.moment);
  return json;
}

Json contact_json(const simulate::WireContact& contact) {
  Json json = {{"node", contact.node}, {"part", contact.part}};
  if (contact.triangle >= 0) {
    json["triangle"] = contact.triangle;
  } else {
    json["triangle"] = nullptr;
    json["triangle_reason"] = "none lies within reach of the point";
  }
  put_points(json, "point_mm", contact.point);
  put_points(json, "normal_force_n", contact.normal_force);
  put_points(json, "friction_force_n", contact.friction_force);
  put(json, "penetration_mm", contact.penetration);
  put(json, "wall_displacement_mm", contact.wall_displacement);
  return json;
}

Json contacts_json(const std::vector<simulate::WireContact>& contacts) {
  Json rows = Json::array();
  for (const simulate::WireContact& contact : contacts) rows.push_back(contact_json(contact));
  return rows;
}

/// Of an insertion after a push.
Json energy_json(const simulate::Energy& energy) {
  Json json = Json::object();
  put(json, "stretch", energy.stretch);
  put(json, "bend", energy.bend);
  put(json, "twist", energy.twist);
  if (energy.load != 0.0) put(json, "gravity", energy.load);
  put(json, "contact", energy.contact);
  put(json, "wall", energy.wall);
  put(json, "total", energy.total());
  return json;
}

// ---- of several tools

Json tool_json(const simulate::ToolReport& tool, const std::string& name, double roll_zero) {
  Json json = {{"name", name}};
  put(json, "insertion_mm", tool.place.insertion);
  put(json, "hub_angle_deg", (tool.place.roll - roll_zero) / kRadPerDeg);
  put(json, "push_force_n", tool.push_force);
  put(json, "hub_torque_n_mm", tool.hub_torque);
  put_points(json, "tip_mm", tool.tip);
  put(json, "twist_deg", tool.twist / kRadPerDeg);
  put(json, "wall_force_n", tool.wall_force);
  return json;
}

/// What the tools do to each other, and the hands to all of them.
void put_record(Json& json, const simulate::ToolRecord& record,
                const std::vector<std::string>& names, double roll_zero) {
  json["tools"] = Json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    json["tools"].push_back(tool_json(record.tools[i], names[i], roll_zero));
  }
  json["between_tools"] = Json::array();
  for (std::size_t i = 0; i + 1 < names.size(); ++i) {
    const simulate::ToolContact& contact = record.contacts[i];
    Json row = {{"outer", names[i]}, {"inner", names[i + 1]}};
    put(row, "normal_force_n", contact.normal_force);
    put(row, "friction_force_n", contact.friction_force);
    put(row, "friction_torque_n_mm", contact.friction_torque);
    json["between_tools"].push_back(row);
  }
  json["energy_n_mm"] = energy_json(record.energy);
  put(json["energy_n_mm"], "load", record.energy.load);
  put(json, "hand_work_n_mm", record.work);
  put(json, "friction_work_n_mm", record.heat);
  put(json, "energy_released_n_mm", record.released);
  put(json, "energy_unbalanced_n_mm", record.unbalanced);
  put(json, "residual_n", record.residual);
  json["iterations"] = record.iterations;
}

/// What the hand does to the wire after a push, and what became of it at the tip.
void put_hand(Json& json, const simulate::Push& push, const simulate::PushTerms& terms) {
  put(json, "push_force_n", push.push_force);
  put(json, "hub_torque_n_mm", push.hub_torque);
  put(json, "tip_roll_deg", terms.tip_roll / kRadPerDeg);
}

void put_work(Json& json, const simulate::Push& push) {
  put(json, "push_work_n_mm", push.push_work);
  put(json, "stored_energy_n_mm", push.stored_energy);
  put(json, "friction_work_n_mm", push.friction_work);
  put(json, "energy_released_n_mm", push.push_work - push.stored_energy - push.friction_work);
  put(json, "energy_unbalanced_n_mm", push.unbalanced);
}

/// How far the hand went until after each push: as far as the wire is in, and twice what it pulled
/// back, and for each turn by 30 degrees as far as one row is from the next [mm].
std::vector<double> ways_of_hand(const std::vector<simulate::Push>& pushes, double every_mm) {
  std::vector<double> ways;
  double back = 0.0, turned = 0.0;
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    if (i > 0) {
      back += std::max(0.0, pushes[i - 1].insertion - pushes[i].insertion);
      turned += std::abs(pushes[i].hub_angle - pushes[i - 1].hub_angle);
    }
    ways.push_back(pushes[i].insertion + 2.0 * back + turned / (30.0 * kRadPerDeg) * every_mm);
  }
  return ways;
}

Json crossing_json(const std::optional<simulate::SelfCrossing>& crossing) {
  if (!crossing) return nullptr;
  Json json;
  json["insertion_mm"] = crossing->insertion > 0.0 ? Json(crossing->insertion) : Json(nullptr);
  json["point_mm"] = to_json(crossing->point);
  json["from_tip_mm"] = {crossing->from_tip, crossing->other_from_tip};
  json["distance_mm"] = crossing->distance;
  return json;
}

/// One row per `every_mm` of the hand's way, and one for the last push.
Json history_json(const simulate::TrialResult& result, double every_mm) {
  const std::vector<simulate::Push>& pushes = result.pushes;
  Json rows = Json::array();
  const std::vector<double> ways = ways_of_hand(pushes, every_mm);
  double next = every_mm, peak = 0.0, peak_tip = 0.0, penetration = 0.0, displacement = 0.0;
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    const simulate::Push& push = pushes[i];
    peak = std::max(peak, push.peak_contact_force);
    peak_tip = std::max(peak_tip, push.tip_force);
    penetration = std::max(penetration, push.max_penetration);
    displacement = std::max(displacement, push.wall_displacement);
    if (ways[i] < next && i + 1 < pushes.size()) continue;
    Json row;
    put(row, "insertion_mm", push.insertion);
    put(row, "hub_turn_deg", push.hub_angle / kRadPerDeg);
    put_hand(row, push, result.push_terms.at(i));
    put_points(row, "tip_mm", push.tip);
    put(row, "peak_tip_force_n", peak_tip);
    put(row, "peak_contact_force_n", peak);
    put(row, "total_contact_force_n", push.total_contact_force);
    put(row, "friction_force_n", push.friction_force);
    put(row, "max_penetration_mm", penetration);
    put(row, "wall_displacement_mm", displacement);
    put_work(row, push);
    row["energy_n_mm"] = energy_json(result.push_terms.at(i).energy);
    put(row, "residual_n", push.residual);
    row["iterations"] = push.iterations;
    rows.push_back(row);
    peak = peak_tip = penetration = displacement = 0.0;
    while (next <= ways[i]) next += every_mm;
  }
  return rows;
}

}  // namespace

Json result_json(const simulate::SceneResult& result,
                 const std::vector<simulate::WireContact>& contacts) {
  Json json = {{"schema", kResultSchema}, {"outcome", simulate::outcome_name(result.outcome)}};
  if (!result.reason.empty()) json["reason"] = result.reason;
  json["terms"] = result.terms;
  put_points(json, "nodes_mm", result.nodes);
  put_angles(json, "twist_rad", result.twist,
             "the wire is straight at rest, so no twist was solved for");
  put_angles(json, "roll_rad", result.roll, "only decoupled twist gives it");
  json["energy_n_mm"] = energy_json(result);
  put(json, "residual_n", result.residual);
  json["iterations"] = result.iterations;
  json["steps"] = result.steps;
  put(json, "simulated_time_s", result.time);
  put(json, "critical_time_step_s", result.critical_time_step,
      "the method is stable at any time step");
  put(json, "worst_energy_rise_n_mm", result.worst_energy_rise);
  put(json, "cpu_time_s", result.cpu_time_s);
  json["reactions"] = Json::array();
  for (const simulate::Reaction& reaction : result.reactions) {
    json["reactions"].push_back(reaction_json(reaction));
  }
  json["contacts"] = contacts_json(contacts);
  json["crosses_itself"] = crossing_json(result.crossing);
  put(json, "friction_work_n_mm", result.friction_work);
  return json;
}

Json result_json(const simulate::TrialResult& result, double every_mm, double cpu_time_s) {
  Json json = {{"schema", kResultSchema}, {"outcome", simulate::outcome_name(result.outcome)}};
  if (!result.reason.empty()) json["reason"] = result.reason;
  json["terms"] = result.terms;
  put_points(json, "nodes_mm", result.nodes);
  long iterations = 0;
  double residual = 0.0, penetration = 0.0, displacement = 0.0;
  for (const simulate::Push& push : result.pushes) {
    iterations += push.iterations;
    residual = std::max(residual, push.residual);
    penetration = std::max(penetration, push.max_penetration);
    displacement = std::max(displacement, push.wall_displacement);
  }
  const simulate::Push last = result.pushes.empty() ? simulate::Push() : result.pushes.back();
  const simulate::PushTerms terms =
      result.push_terms.empty() ? simulate::PushTerms() : result.push_terms.back();
  json["energy_n_mm"] = energy_json(terms.energy);
  put_hand(json, last, terms);
  put_work(json, last);
  put(json, "residual_n", residual);
  json["iterations"] = iterations;
  json["steps"] = result.pushes.size();
  put(json, "cpu_time_s", cpu_time_s);
  json["contacts"] = contacts_json(result.contacts);
  put(json, "max_penetration_mm", penetration);
  put(json, "max_wall_displacement_mm", displacement);
  json["crosses_itself"] = crossing_json(result.crossing);
  if (!result.stuck.empty()) json["stuck_mm"] = result.stuck;
  json["history"] = history_json(result, every_mm);
  return json;
}

Json start_json(const simulate::TrialResult& result, const simulate::StartLine& line,
                const Vec3& entry, double roll_zero) {
  Json json = {{"length_mm", line.length}};
  put(json, "roll_deg", std::remainder(result.roll - roll_zero, 2.0 * kPi) / kRadPerDeg);
  json["roll_found"] = line.find_roll;
  if (!result.start) {
    json["distance_mm"] = nullptr;
    json["distance_mm_reason"] = "no equilibrium was found near the line";
    return json;
  }
  Eigen::Matrix3Xd wire(3, result.start->nodes.cols() + 1);
  wire << entry, result.start->nodes;
  const simulate::LineDistance distance =
      simulate::find_distance(wire, simulate::line_from_entry(line.nodes, entry));
  json["distance_mm"] = {
      {"mean", distance.mean}, {"largest", distance.largest}, {"tip", distance.tip}};
  put_points(json, "nodes_mm", result.start->nodes);
  return json;
}

Json result_json(const simulate::ToolSceneResult& result, const simulate::ToolScene& scene,
                 const std::vector<simulate::WireContact>& contacts, double roll_zero,
                 double cpu_time_s) {
  Json json = {{"schema", kResultSchema}, {"outcome", simulate::outcome_name(result.outcome)}};
  if (!result.reason.empty()) json["reason"] = result.reason;
  json["terms"] = result.terms;
  put_points(json, "nodes_mm", result.nodes);
  std::vector<std::string> names;
  for (const simulate::Tool& tool : scene.tools) names.push_back(tool.wire.name);
  const simulate::ToolRecord& last = result.history.back();
  put_record(json, last, names, roll_zero);
  int iterations = 0;
  for (const simulate::ToolRecord& record : result.history) iterations += record.iterations;
  json["iterations"] = iterations;
  json["steps"] = result.history.size() - 1;
  put(json, "cpu_time_s", cpu_time_s);

  // Nodes lie evenly up to the foremost tip.
  double foremost = 0.0;
  for (const simulate::ToolReport& tool : last.tools) {
    foremost = std::max(foremost, tool.place.insertion);
  }
  const Eigen::Index edges = result.nodes.cols() - 1;
  json["tools_at_nodes"] = Json::array();
  for (Eigen::Index k = 0; k <= edges; ++k) {
    const double s = foremost * static_cast<double>(k) / static_cast<double>(edges);
    Json present = Json::array();
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (last.tools[i].place.insertion >= s - 1e-9 * foremost) present.push_back(names[i]);
    }
    json["tools_at_nodes"].push_back(present);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    put_angles(json["tools"][i], "angle_rad", result.angles[i],
               "the tool is straight at rest, so no twist was solved for");
  }
  put_points(json, "introducer_force_n", result.introducer_force);
  if (result.distal_force) put_points(json, "distal_force_n", *result.distal_force);
  json["contacts"] = contacts_json(contacts);
  json["crosses_itself"] = crossing_json(result.crossing);
  json["moves"] = Json::array();
  for (const simulate::ToolRecord& record : result.history) {
    Json row = Json::object();
    put_record(row, record, names, roll_zero);
    json["moves"].push_back(row);
  }
  return json;
}

}  // namespace wireplan::pipeline
