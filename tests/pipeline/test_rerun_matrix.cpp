// Which stages run again for each parameter of a case.
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "pipeline/files/case_file.h"
#include "pipeline/files/plan_file.h"
#include "pipeline/stages/stages.h"
#include "tests/pipeline/finished_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// Stages that do nothing and come out the same whatever they read: then what reruns is what reads
// the changed parameter itself.
void make_nothing(Workspace&, const fs::path& folder) { write_text("same", folder / "made.txt"); }

class RerunMatrix : public testing::Test {
 protected:
  std::vector<std::string> not_cached(const Json& file) {
    write_json(file, folder_ / "case.json");
    const Case given = read_case(folder_ / "case.json");
    std::vector<Stage> stages = stages_of(given);
    for (Stage& stage : stages) stage.make = make_nothing;
    RunOptions options;
    options.cache = folder_ / "cache";
    std::vector<std::string> names;
    for (const StageOutcome& outcome : run_stages(given, options, stages).stages) {
      if (outcome.state != StageState::kCached) names.push_back(outcome.stage);
    }
    return names;
  }

  // Runs the case, then with each parameter changed in turn: an entry of the table for every
  // parameter that the case has.
  void expect_reruns(const Json& file, std::map<std::string, std::vector<std::string>> table,
                     const Json& changes) {
    write_json(file, folder_ / "case.json");
    Json all = case_parameters(read_case(folder_ / "case.json"));
    for (const char* end : {"lower_hu", "upper_hu"}) {  // null where no band is given
      if (all.contains("segmentation") && all["segmentation"][end].is_null()) {
        all["segmentation"].erase(end);
      }
    }
    not_cached(all);
    const Json leaves = all.flatten();
    for (const auto& [pointer, value] : leaves.items()) {
      if (pointer == "/schema") continue;
      SCOPED_TRACE(pointer);
      const auto row = table.find(pointer);
      ASSERT_NE(row, table.end()) << "a new parameter: say which stages read it";
      Json changed = all;
      Json& place = changed[Json::json_pointer(pointer)];
      place = changes.contains(pointer) ? changes.at(pointer)
              : value.is_number()       ? Json(value.get<double>() + 0.25)
                                        : Json("other");
      EXPECT_EQ(not_cached(changed), row->second);
      table.erase(row);
    }
    for (const auto& [pointer, stages] : table) ADD_FAILURE() << pointer << " is no parameter";
  }

  TemporaryFolder folder_;
};

// What every case has, whatever it starts from.
std::map<std::string, std::vector<std::string>> common_table() {
  using Names = std::vector<std::string>;
  const Names report = {"report"}, trials = {"trials", "manoeuvres", "plans", "report"},
              wall = {"wall", "report"};
  const Names ends = {"centerline", "trials", "manoeuvres", "plans", "report"};
  std::map<std::string, Names> table = {{"/name", report},
                                        {"/surface/edge_length_mm", {"surface", "report"}},
                                        {"/wall/model", trials},
                                        {"/wall/thickness_mm", wall},
                                        {"/wall/young_modulus_kpa", wall},
                                        {"/wall/poisson_ratio", wall},
                                        {"/wall/support_kpa_per_mm", trials},
                                        {"/wall/held/0/at", trials},
                                        {"/wall/held/0/radius_mm", trials},
                                        {"/wall/held/0/factor", trials},
                                        {"/target/radius_mm", trials},
                                        {"/access/inclination_deg/0", trials},
                                        {"/access/azimuth_deg/0", trials},
                                        {"/tip_roll_deg/0", trials},
                                        {"/friction", trials},
                                        {"/friction_factor", trials},
                                        {"/manoeuvres", {"manoeuvres", "plans", "report"}},
                                        {"/search/exhaustive", report}};
  for (const char* k : {"0", "1", "2"}) {
    table[std::string("/access/point_mm/") + k] = ends;
    table[std::string("/target/point_mm/") + k] = ends;
  }
  for (const char* key :
       {"name", "diameter_mm", "coating", "friction", "sections/0/length_mm",
        "sections/0/bending_stiffness_n_mm2/value/0", "sections/0/bending_stiffness_n_mm2/value/1",
        "sections/0/bending_stiffness_n_mm2/spread/0",
        "sections/0/bending_stiffness_n_mm2/spread/1", "sections/0/bending_stiffness_n_mm2/source",
        "sections/0/bending_stiffness_n_mm2/confidence", "sections/0/taper",
        "sections/0/axial_stiffness_n", "sections/0/twist_stiffness_n_mm2",
        "sections/0/mass_kg_per_m"}) {
    table[std::string("/wires/0/") + key] = trials;
  }
  for (const char* key : {"length_mm", "step_mm", "element_length_mm", "contact_spacing_mm",
                          "residual_tolerance_n", "max_iterations", "record_every_mm"}) {
    table[std::string("/insertion/") + key] = trials;
  }
  for (const char* key :
       {"device_diameter_mm", "sheath_diameter_mm", "sheath_length_mm", "max_sheath_ratio",
        "tortuosity/0", "tortuosity/1", "tortuosity/2", "angle_deg/0", "angle_deg/1", "angle_deg/2",
        "calcium_hu", "calcium_within_mm", "catheter_length_mm", "working_length_mm",
        "arm_rotation_deg", "arm_tilt_deg"}) {
    table[std::string("/access_limits/") + key] = {"anatomy", "report"};
  }
  table["/axes"] = {"anatomy", "report"};
  // What judges, and simulates nothing.
  for (const char* key :
       {"limits/tip_force_warn_n", "limits/tip_force_fail_n", "limits/penetration_fail_mm",
        "limits/off_path_fail_mm", "ranking/weights/reach", "ranking/weights/peak_force",
        "ranking/weights/mean_force", "ranking/weights/margin"}) {
    table[std::string("/") + key] = report;
  }
  const Names tried = {"manoeuvres", "plans", "report"};  // under disturbances
  for (const char* key :
       {"seed", "friction_factor/0", "friction_factor/1", "stiffness_factor/0",
        "stiffness_factor/1", "wall_factor/0", "wall_factor/1", "support_factor/0",
        "support_factor/1", "angle_deg", "entry_mm", "lumen_mm"}) {
    table[std::string("/robustness/") + key] = tried;
  }
  table["/robustness/repeats"] = table["/robustness/plans"] = {"plans", "report"};
  return table;
}

// Of a case that starts from voxels, at access and target too.
void segment_reads_points(std::map<std::string, std::vector<std::string>>& table) {
  for (const char* end : {"/access/point_mm/", "/target/point_mm/"}) {
    for (const char* k : {"0", "1", "2"}) {
      auto& stages = table[std::string(end) + k];
      stages.insert(stages.begin(), "segment");
    }
  }
}

Json common_changes() {
  return {{"/wall/model", "rigid"},
          {"/wall/held/0/at", "ostia"},
          {"/wall/poisson_ratio", 0.4},
          {"/axes", "unknown"},
          {"/mask/most_handles", 60},
          {"/mask/most_faces", 300000},
          {"/insertion/residual_tolerance_n", 1e-5},
          {"/insertion/max_iterations", 150},
          {"/manoeuvres", "never"},
          {"/search/exhaustive", true},
          {"/wires/0/coating", "bare"},
          {"/wires/0/sections/0/taper", "cone"},
          {"/wires/0/sections/0/bending_stiffness_n_mm2/confidence", "assumed"},
          {"/robustness/repeats", 17},
          {"/robustness/plans", 4},
          {"/robustness/seed", 8},
          {"/access_limits/tortuosity/1", 1.55}};
}

Json case_with_every_list_of_one(const fs::path& folder) {
  Json file = write_tube_case(folder);
  file["access"]["inclination_deg"] = {20};
  file["tip_roll_deg"] = {0};
  file["robustness"]["friction_factor"] = {0.5, 2};
  file["robustness"]["stiffness_factor"] = {0.8, 1.5};
  file["wall"]["support_kpa_per_mm"] = 1;
  // A wire with every kind of value.
  Json& wire = file["wires"][0];
  wire["coating"] = "ptfe";
  wire["friction"] = 0.1;
  Json& section = wire["sections"][0];
  section["bending_stiffness_n_mm2"] = {
      {"value", {20, 30}}, {"spread", {1, 2}}, {"source", "own"}, {"confidence", "measured"}};
  section["taper"] = "linear";
  return file;
}

TEST_F(RerunMatrix, OfACaseThatStartsFromASurface) {
  Json file = case_with_every_list_of_one(folder_.path());
  fs::copy(folder_ / "tube.stl", folder_ / "other.stl");
  auto table = common_table();
  table["/surface/path"] = {"report"};  // its contents count, not where it lies
  table["/surface/unit"] = table["/surface/frame"] = {"surface", "report"};
  file["target"].erase("radius_mm");  // a cross-section is where the centerline ends
  table.erase("/target/radius_mm");
  table["/target/beyond_mm"] = {"centerline", "trials", "manoeuvres", "plans", "report"};
  file["catheters"][0] = {{"name", "hook"},
                          {"diameter_mm", 1.6},
                          {"inner_diameter_mm", 1.0},
                          {"friction", 0.1},
                          {"sections", Json::array()}};
  file["catheters"][0]["sections"][0] = {{"length_mm", 300}, {"bending_stiffness_n_mm2", 90}};
  for (const char* key :
       {"catheters/0/name", "catheters/0/diameter_mm", "catheters/0/inner_diameter_mm",
        "catheters/0/friction", "catheters/0/sections/0/length_mm",
        "catheters/0/sections/0/bending_stiffness_n_mm2", "tool_rules/soft_tip_n_mm2",
        "tool_rules/hold_mm", "tool_rules/outside_mm", "tool_rules/most_turn_deg",
        "tool_rules/turn_deg_per_mm", "tool_rules/friction_between_tools", "tool_rules/exchange",
        "tool_rules/seat_mm"}) {
    table[std::string("/") + key] = {"manoeuvres", "plans", "report"};
  }
  for (const plan::ScorePart& part : plan::kScoreParts) {  // these judge
    if (part.of_script) table[std::string("/ranking/script_weights/") + part.name] = {"report"};
  }
  Json changes = common_changes();
  changes["/surface/path"] = "other.stl";
  changes["/surface/unit"] = "cm";
  changes["/surface/frame"] = "RAS";
  changes["/tool_rules/exchange"] = false;
  expect_reruns(file, table, changes);
}

TEST_F(RerunMatrix, OfACaseThatStartsFromAVolume) {
  for (const bool band : {true, false}) {
    SCOPED_TRACE(band);
    Json file = case_with_every_list_of_one(folder_.path());
    fs::remove_all(folder_ / "cache");
    for (const char* name : {"ct.nrrd", "other.nrrd"}) write_text("values", folder_ / name);
    file["volume"] = {{"path", "ct.nrrd"}, {"series", "7"}};
    file["surface"] = {{"edge_length_mm", 1.5}};
    file["segmentation"] =
        band ? Json{{"lower_hu", 150}, {"upper_hu", 500}} : Json{{"reach_mm", 100}};
    file["segmentation"].update(Json{
        {"seeds_mm", Json::array({{10, 20, 18}})}, {"smoothing_mm", 0}, {"neck_opening_mm", 0}});
    auto table = common_table();
    table["/volume/path"] = {"report"};
    table["/volume/series"] = {"volume", "segment", "surface", "anatomy", "report"};
    for (const auto& [key, value] : file["segmentation"].items()) {
      if (key != "seeds_mm") table["/segmentation/" + key] = {"segment", "report"};
    }
    for (const char* k : {"0", "1", "2"}) {
      table[std::string("/segmentation/seeds_mm/0/") + k] = {"segment", "report"};
    }
    table["/mask/most_handles"] = table["/mask/most_faces"] = {"segment", "report"};
    segment_reads_points(table);  // seeds too
    Json changes = common_changes();
    changes["/volume/path"] = "other.nrrd";
    changes["/volume/series"] = "8";
    expect_reruns(file, table, changes);
  }
}

TEST_F(RerunMatrix, OfACaseThatStartsFromLabels) {
  for (const bool in_volume : {true, false}) {
    SCOPED_TRACE(in_volume);
    Json file = case_with_every_list_of_one(folder_.path());
    fs::remove_all(folder_ / "cache");
    for (const char* name : {"ct.nrrd", "other.nrrd", "labels.nii", "other.nii"}) {
      write_text("values", folder_ / name);
    }
    for (const char* name : {"names.csv", "other.csv"}) write_text("1,tube\n2,x\n", folder_ / name);
    if (in_volume) file["volume"] = {{"path", "ct.nrrd"}};
    file["surface"] = {{"edge_length_mm", 1.5}};
    file["labels"] = {
        {"path", "labels.nii"}, {"values", {1}}, {"names", {"tube"}}, {"table", "names.csv"}};
    auto table = common_table();
    if (in_volume) table["/volume/path"] = {"report"};
    table["/labels/path"] = table["/labels/table"] = {"report"};  // their contents count
    table["/labels/values/0"] = table["/labels/names/0"] = {"segment", "report"};
    table["/mask/most_handles"] = table["/mask/most_faces"] = {"segment", "report"};
    segment_reads_points(table);  // must lie in the labels
    Json changes = common_changes();
    changes["/volume/path"] = "other.nrrd";
    changes["/labels/path"] = "other.nii";
    changes["/labels/table"] = "other.csv";
    changes["/labels/values/0"] = 2;
    expect_reruns(file, table, changes);
  }
}

}  // namespace
}  // namespace wireplan::pipeline
