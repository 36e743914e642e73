#pragma once
/// What the tests of the pipeline share: a folder of their own, and a case small enough to run in a
/// second.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "pipeline/files/json_reader.h"
#include "tests/shapes.h"

namespace wireplan::pipeline {

/// Removed with all in it at the end of its scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    static std::atomic<int> counter{0};
    path_ = std::filesystem::temp_directory_path() /
            ("wireplan-test-" + std::to_string(::getpid()) + "-" + std::to_string(counter++));
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline void write_text(const std::string& text, const std::filesystem::path& file) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

inline std::string read_text(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

inline void write_stl(const Surface& surface, const std::filesystem::path& file) {
  std::ofstream stream(file);
  stream.precision(17);
  stream << "solid vessel\n";
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    stream << "facet normal 0 0 0\nouter loop\n";
    for (int corner = 0; corner < 3; ++corner) {
      const Vec3 p = surface.vertices.col(surface.triangles(corner, k));
      stream << "vertex " << p.x() << " " << p.y() << " " << p.z() << "\n";
    }
    stream << "endloop\nendfacet\n";
  }
  stream << "endsolid\n";
}

/// A tube of radius 4 mm and length 36 mm along z as tube.stl, and case.json with one wire pushed
/// in at two angles for 30 mm; a plan is repeated four times. Returns the case file's contents.
inline Json write_tube_case(const std::filesystem::path& folder) {
  write_stl(shapes::straight_tube(4.0, 36.0, 1.5), folder / "tube.stl");
  const Json wire = {
      {"name", "soft"},
      {"diameter_mm", 0.889},
      {"sections", Json::array({{{"length_mm", 200}, {"bending_stiffness_n_mm2", 50}}})}};
  Json file;
  file["schema"] = "wireplan.case/1";
  file["name"] = "tube";
  file["surface"] = {
      {"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}, {"edge_length_mm", 1.5}};
  file["access"] = {{"point_mm", {0, 0, 6}}, {"inclination_deg", {0, 20}}, {"azimuth_deg", {90}}};
  file["target"] = {{"point_mm", {0, 0, 28}}, {"radius_mm", 4}};
  file["wires"] = Json::array({wire});
  file["insertion"] = {{"length_mm", 30}, {"step_mm", 2}, {"element_length_mm", 2}};
  file["robustness"] = {{"repeats", 4}};
  write_json(file, folder / "case.json");
  return file;
}

/// Two tubes of 300 HU, 12 mm wide, side by side in soft tissue under a layer of air, 1 mm voxels:
/// raw NRRD, 40 x 40 x 36.
inline void write_two_tubes(const std::filesystem::path& file) {
  std::string voxels;
  for (int k = 0; k < 36; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 40; ++i) {
        const double y = j - 20.0, a = std::hypot(i - 10.0, y), b = std::hypot(i - 30.0, y);
        const int hu = j < 4 ? -1000 : std::min(a, b) < 6.0 ? 300 : 40;
        const auto bits = static_cast<std::uint16_t>(static_cast<std::int16_t>(hu));
        voxels += static_cast<char>(bits & 255U);
        voxels += static_cast<char>(bits >> 8U);
      }
    }
  }
  write_text(
      "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 40 40 36\n"
      "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nendian: little\n"
      "encoding: raw\nspace origin: (0,0,0)\n\n" +
          voxels,
      file);
}

/// The tube case, started from the first of them.
inline Json volume_case(const Json& tube) {
  Json file = tube;
  file["volume"] = {{"path", "ct.nrrd"}};
  file["surface"] = {{"edge_length_mm", 1.5}};
  file["segmentation"] = {
      {"lower_hu", 150}, {"upper_hu", 500}, {"seeds_mm", Json::array({{10, 20, 18}})}};
  file["access"]["point_mm"] = {10, 20, 8};
  file["target"]["point_mm"] = {10, 20, 30};
  return file;
}

/// The text of one of the blocks of data of a report.html.
inline std::string page_block(const std::string& page, const std::string& name) {
  const std::string start = "<script type=\"application/json\" id=\"data-" + name + "\">";
  const std::size_t first = page.find(start) + start.size();
  return page.substr(first, page.find("</script>", first) - first);
}

/// Holds every JSON file below the folder that names a schema of ours against pipeline/schemas, by
/// python3-jsonschema. Where that is not installed the test is marked as skipped.
inline void expect_follows_schemas(const std::filesystem::path& folder) {
  const TemporaryFolder own;
  write_text(R"(import json, os, sys
try:
    import jsonschema
    jsonschema.Draft202012Validator
except (ImportError, AttributeError):
    sys.exit(77)
schemas, folder = sys.argv[1:]
validators, checked = {}, 0
for name in os.listdir(schemas):
    schema = json.load(open(os.path.join(schemas, name)))
    jsonschema.Draft202012Validator.check_schema(schema)
    validators["wireplan." + name.split(".")[0]] = jsonschema.Draft202012Validator(schema)
for root, _, names in os.walk(folder):
    for name in names:
        if not name.endswith(".json"): continue
        try: document = json.load(open(os.path.join(root, name)))
        except ValueError: continue
        kind = str(document.get("schema")).split("/")[0] if isinstance(document, dict) else None
        if kind not in validators: continue
        checked += 1
        for error in validators[kind].iter_errors(document):
            print(os.path.join(root, name), error.json_path, error.message[:300])
if checked == 0: print("no file below " + folder + " names a schema of ours")
)",
             own / "validate.py");
  const std::string command = "/usr/bin/python3 '" + (own / "validate.py").string() + "' '" +
                              WIREPLAN_SOURCE_DIR + "/pipeline/schemas' '" + folder.string() +
                              "' > '" + (own / "told.txt").string() + "' 2>&1";
  const int status = std::system(command.c_str());
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) {
    GTEST_SKIP() << "python3 has no jsonschema 4.0 (package python3-jsonschema)";
  }
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read_text(own / "told.txt"), "");
}

}  // namespace wireplan::pipeline
