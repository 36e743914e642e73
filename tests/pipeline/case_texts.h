#pragma once
/// Case files as texts, for the tests of what reads them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "pipeline/files/case_file.h"
#include "pipeline/files/catalogue.h"
#include "pipeline/files/scene_file.h"
#include "tests/pipeline/small_case.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::pipeline {

namespace fs = std::filesystem;

inline const fs::path kSource = WIREPLAN_SOURCE_DIR;

/// A folder of its own for each test, with an empty image and surface that files can name.
class CaseFile : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ =
        fs::temp_directory_path() / ("wireplan-case-" + name + "-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    write("ct.nrrd", "");
    write("vessel.stl", "");
    write("vessel.vtp", "");
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  Case read(const Json& json, const std::vector<std::string>& overrides = {}) const {
    return read_case(write("case.json", json.dump()), overrides);
  }

  /// The case with the points of these accesses and targets in a file of markups.
  Json marked_points(Json json, const std::vector<std::string>& places) const {
    Json controls = Json::array();
    for (const std::string& place : places) {
      Json& end = json[Json::json_pointer(place)];
      controls.push_back({{"label", place}, {"position", end["point_mm"]}});
      end.erase("point_mm");
      end["point"] = {{"markups", "points.mrk.json"}, {"label", place}};
    }
    const Json list = {{"coordinateSystem", "LPS"}, {"controlPoints", controls}};
    write("points.mrk.json", Json{{"markups", Json::array({list})}}.dump());
    return json;
  }

  /// What read_case says; empty where it accepts.
  std::string problem(const Json& json, const std::vector<std::string>& overrides = {}) const {
    try {
      read(json, overrides);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  /// At labels, with accesses and targets by the names of branches: one of each and several, each
  /// at an end and beyond an ostium.
  std::vector<Json> cases_at_branches() const;

  std::string scene_problem(const Json& json) const {
    try {
      read_scene(write("scene.json", json.dump()));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

inline Json volume_case();
inline Json labels_case();
inline Json own_wire();

inline std::vector<Json> CaseFile::cases_at_branches() const {
  write("names.csv", "1,aorta\n2,renal\n");
  write("tree.nii", preprocess::branched_labels());
  const Json at_end = {{"branch", "aorta"}, {"end", "inferior"}},
             beyond = {{"branch", "renal"}, {"beyond_ostium_mm", 10}};
  std::vector<Json> cases;
  for (const bool turned : {false, true}) {
    const Json &from = turned ? beyond : at_end, &to = turned ? at_end : beyond;
    Json one = labels_case();
    one["wires"] = Json::array({own_wire()});
    Json lists = one;
    lists["accesses"] = Json::array({lists["access"]});
    lists["targets"] = Json::array({lists["target"]});
    for (const auto& [end, list] :
         {std::pair("access", "accesses"), std::pair("target", "targets")}) {
      lists[list][0]["name"] = end;
      lists.erase(end);
    }
    for (Json* json : {&one, &lists}) {
      (*json)["labels"] = {{"path", "tree.nii"}, {"values", {1, 2}}, {"table", "names.csv"}};
    }
    one["labels"]["names"] = {"aorta", "renal"};
    for (const auto& [end, branch] :
         {std::pair(&one["access"], &from), std::pair(&one["target"], &to),
          std::pair(&lists["accesses"][0], &from), std::pair(&lists["targets"][0], &to)}) {
      end->erase("point_mm");
      end->update(*branch);
    }
    cases.push_back(one);
    cases.push_back(lists);
  }
  return cases;
}

inline Json volume_case() {
  return {{"schema", "wireplan.case/1"},
          {"volume", {{"path", "ct.nrrd"}}},
          {"segmentation", {{"lower_hu", 150}, {"upper_hu", 600}}},
          {"access", {{"point_mm", {1, 2, 3}}}},
          {"target", {{"point_mm", {1, 2, 100}}}},
          {"wires", {"amplatz"}}};
}

inline Json surface_case() {
  Json json = volume_case();
  json.erase("volume");
  json.erase("segmentation");
  json["surface"] = {{"path", "vessel.stl"}, {"unit", "mm"}, {"frame", "LPS"}};
  return json;
}

/// At labels alone; the tests write the file.
inline Json labels_case() {
  Json json = volume_case();
  json.erase("volume");
  json.erase("segmentation");
  json["labels"] = {{"path", "labels.nii"}, {"names", {"aorta"}}};
  return json;
}

/// A wire of the user's own, with every key.
inline Json own_wire() {
  return {{"name", "mine"},
          {"title", "My wire"},
          {"source", "measured"},
          {"diameter_mm", 0.889},
          {"coating", "ptfe"},
          {"friction", 0.1},
          {"mass_kg_per_m", 0.004},
          {"sections",
           {{{"length_mm", 3000},
             {"bending_stiffness_n_mm2", 5},
             {"axial_stiffness_n", 100},
             {"twist_stiffness_n_mm2", 4},
             {"mass_kg_per_m", 0.005},
             {"rest_radius_mm", 12},
             {"source", "measured"}}}}};
}

/// The case with every key that goes with its input.
inline Json full_case(Json json) {
  json["name"] = "full";
  if (json.contains("segmentation")) {
    if (!json["segmentation"].contains("lower_hu")) json["segmentation"]["reach_mm"] = 120;
    json["volume"]["series"] = "4";
    json["segmentation"].update(Json{
        {"seeds_mm", Json::array({{1, 2, 3}})}, {"smoothing_mm", 0.8}, {"neck_opening_mm", 1.5}});
  }
  json["surface"]["edge_length_mm"] = 1.5;
  if (!json["surface"].contains("path")) {
    json["mask"] = {{"most_handles", 20}, {"most_faces", 100000}};
  }
  json["wall"] = {
      {"model", "rigid"},
      {"thickness_mm", 2},
      {"young_modulus_kpa", 56},
      {"poisson_ratio", 0.4},
      {"support_kpa_per_mm", 2},
      {"held",
       Json::array({{{"at", "point"}, {"point_mm", {1, 2, 3}}, {"radius_mm", 8}, {"factor", 30}},
                    {{"at", "ostia"}}})}};
  json["access"].update(Json{{"inclination_deg", {0, 15}}, {"azimuth_deg", {0, 90}}});
  json["target"]["radius_mm"] = 5;
  json["wires"] = {own_wire(), "amplatz"};
  json["catheters"][0] = {{"name", "own hook"}, {"title", "A hook"},        {"shape", "hook"},
                          {"diameter_mm", 1.6}, {"inner_diameter_mm", 1.0}, {"coating", "ptfe"},
                          {"friction", 0.1}};
  json["catheters"][0]["sections"][0] = {{"length_mm", 600}, {"bending_stiffness_n_mm2", 99}};
  json["catheters"][1] = "cobra-c2";
  json["tool_rules"] = {{"soft_tip_n_mm2", 90},  {"hold_mm", 80},
                        {"outside_mm", 40},      {"most_turn_deg", 170},
                        {"turn_deg_per_mm", 60}, {"friction_between_tools", 0.1},
                        {"exchange", false},     {"seat_mm", 12}};
  json["tip_roll_deg"] = {0, 180};
  json["friction"] = 0.12;
  json["friction_factor"] = 0.9;
  json["insertion"] = {{"length_mm", 250},
                       {"step_mm", 2},
                       {"element_length_mm", 0.5},
                       {"contact_spacing_mm", 2},
                       {"residual_tolerance_n", 1e-5},
                       {"max_iterations", 50},
                       {"record_every_mm", 10}};
  json["axes"] = "unknown";
  json["access_limits"] = {
      {"device_diameter_mm", 2},  {"sheath_diameter_mm", 3}, {"sheath_length_mm", 90},
      {"max_sheath_ratio", 1},    {"tortuosity", {1, 2, 3}}, {"angle_deg", {150, 100, 80}},
      {"calcium_hu", 900},        {"calcium_within_mm", 1},  {"catheter_length_mm", 650},
      {"working_length_mm", 150}, {"arm_rotation_deg", 90},  {"arm_tilt_deg", 40}};
  json["limits"] = {{"tip_force_warn_n", 0.2},
                    {"tip_force_fail_n", 1},
                    {"penetration_fail_mm", 0.5},
                    {"off_path_fail_mm", 20}};
  json["search"] = {{"exhaustive", true}};
  json["manoeuvres"] = "always";
  json["robustness"] = {{"repeats", 32},
                        {"plans", 3},
                        {"seed", 7},
                        {"friction_factor", {0.25, 4}},
                        {"stiffness_factor", {0.9, 1.2}},
                        {"wall_factor", {1, 1}},
                        {"support_factor", {0.5, 4}},
                        {"angle_deg", 3},
                        {"entry_mm", 0.5},
                        {"lumen_mm", 0.1}};
  json["ranking"]["weights"] = {{"reach", 2}, {"peak_force", 3}, {"mean_force", 0}, {"margin", 1}};
  json["ranking"]["script_weights"] = {{"support", 1},    {"hook", 2},       {"wire_beyond", 0},
                                       {"hand_force", 1}, {"hub_torque", 1}, {"moves", 0.5},
                                       {"exchanges", 3}};
  return json;
}

inline void expect_mentions(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) {
    EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" is not in: " << text;
  }
}

/// From a surface, with two accesses and three targets that have every key.
inline Json listed_case() {
  Json json = full_case(surface_case());
  Json access = json["access"];
  json.erase("access");
  json.erase("target");
  access["name"] = "right femoral";
  json["accesses"] = Json::array({access, access});
  json["accesses"][1].update(Json{{"name", "left femoral"}, {"point_mm", {1, 2, 4}}});
  json["targets"] = Json::array({{{"name", "sac"}, {"point_mm", {1, 2, 100}}, {"radius_mm", 5}},
                                 {{"name", "beyond"}, {"point_mm", {1, 2, 90}}, {"beyond_mm", 10}},
                                 {{"name", "renal"}, {"point_mm", {1, 2, 80}}}});
  return json;
}

/// A volume's case whose points are voxels, also as lists of one.
inline Json voxel_case(bool listed) {
  Json json = full_case(volume_case());
  json["volume"].erase("series");  // of a file there is none
  Json& held = json["wall"]["held"][0];
  held["point"] = {{"ijk", held["point_mm"]}};
  held.erase("point_mm");
  for (const auto& [end, list] :
       {std::pair("access", "accesses"), std::pair("target", "targets")}) {
    json[end]["point"] = {{"ijk", json[end]["point_mm"]}};
    json[end].erase("point_mm");
    if (!listed) continue;
    json[list] = Json::array({json[end]});
    json[list][0]["name"] = end;
    json.erase(end);
  }
  return json;
}

/// Scenes in order but for one value.
class SceneMistakes : public CaseFile {
 protected:
  struct Mistake {
    Json scene;
    std::string pointer;
    Json value;
    std::vector<std::string> told;
  };

  void expect_each_told(const std::vector<Mistake>& mistakes) const {
    for (const Mistake& mistake : mistakes) {
      SCOPED_TRACE(mistake.pointer);
      Json scene = mistake.scene;
      EXPECT_EQ(scene_problem(scene), "");
      scene[Json::json_pointer(mistake.pointer)] = mistake.value;
      expect_mentions(scene_problem(scene), mistake.told);
    }
  }
};

}  // namespace wireplan::pipeline
