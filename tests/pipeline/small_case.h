#pragma once
/// What the tests of the pipeline share: a folder of their own, and a case small enough to run in
/// well under a second.
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "pipeline/json_reader.h"
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
/// in at two angles for 30 mm. Returns the case file's contents.
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
  write_json(file, folder / "case.json");
  return file;
}

}  // namespace wireplan::pipeline
