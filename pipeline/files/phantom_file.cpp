#include "pipeline/files/phantom_file.h"

#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <system_error>

#include "pipeline/files/json_reader.h"
#include "preprocess/files/vessel_io.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using preprocess::Phantom;
using preprocess::PhantomCalcium;
using preprocess::PhantomEllipsoid;
using preprocess::PhantomSpec;
using preprocess::PhantomStent;
using preprocess::PhantomTube;
using preprocess::PhantomTubeKind;
using preprocess::PhantomVertebra;

constexpr Range kHu{.min = -1024.0, .max = 3071.0};  // what 12 bits of a scanner hold
constexpr Range kMm{.min = 0.0, .max = 1000.0};
constexpr Range kPositiveMm{.min = 0.0, .max = 1000.0, .open_min = true};

/// A list of three; `otherwise` after a problem, which is told.
Vec3 read_three(JsonReader& reader, const std::string& key, const Range& range,
                const Vec3& otherwise) {
  const std::vector<double> numbers = reader.numbers(key, std::nullopt, range);
  if (numbers.size() == 3) return {numbers[0], numbers[1], numbers[2]};
  const Json& given = reader.raw(key);
  if (given.is_array() && !given.empty() && given.size() != 3) {
    reader.problems().add(reader.path_of(key), given.dump(), "three numbers");
  }
  return otherwise;
}

/// Tells of a point so far away that the number is a slip; a tube that went there would fill the
/// memory.
void expect_near(JsonReader& reader, const std::string& key, const Vec3& point) {
  constexpr double kFarthest = 1e4;  // [mm]
  if (point.cwiseAbs().maxCoeff() <= kFarthest) return;
  reader.problems().add(reader.path_of(key), to_json(point).dump(),
                        "coordinates from -10000 to 10000", "given in um?");
}

Vec3 read_place(JsonReader& reader, const std::string& key) {
  const Vec3 place = reader.point(key, std::nullopt);
  expect_near(reader, key, place);
  return place;
}

Vec3 read_semi_axes(JsonReader& reader) {
  return read_three(reader, "semi_axes_mm", kPositiveMm, Vec3::Constant(kPositiveMm.max));
}

/// A layer that has to leave something inside.
double read_shell(JsonReader& reader, double fallback, double room) {
  const double shell = reader.number("shell_mm", fallback, kMm);
  if (shell < room) return shell;
  reader.problems().add(reader.path_of("shell_mm"), Json(shell).dump(),
                        "below " + Json(room).dump(),
                        "the shell has to be thinner than the thinnest part");
  return 0.0;
}

preprocess::Grid read_grid(JsonReader reader) {
  preprocess::Grid grid;
  constexpr double kLargest = 512.0 * 512.0 * 2048.0;
  const Vec3 size = read_three(reader, "size", {.min = 1.0, .max = 4096.0}, Vec3::Ones());
  if (size != size.array().floor().matrix() || size.prod() > kLargest) {
    reader.problems().add(reader.path_of("size"), reader.raw("size").dump(),
                          "whole numbers of voxels, " + std::to_string(static_cast<int>(kLargest)) +
                              " in all at most");
  } else {
    for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(size(axis));
  }
  grid.spacing = read_three(reader, "spacing_mm", {.min = 0.05, .max = 20.0}, Vec3::Ones());
  grid.origin = read_place(reader, "origin_mm");
  reader.finish();
  return grid;
}

void read_body(JsonReader reader, PhantomSpec& spec) {
  spec.body_center = read_place(reader, "center_mm");
  spec.body_semi_axes = read_semi_axes(reader);
  spec.air_hu = reader.number("air_hu", spec.air_hu, kHu);
  spec.fat_hu = reader.number("fat_hu", spec.fat_hu, kHu);
  spec.tissue_hu = reader.number("tissue_hu", spec.tissue_hu, kHu);
  spec.skin_mm = reader.number("skin_mm", spec.skin_mm, kMm);
  spec.fat_mm = reader.number("fat_mm", spec.fat_mm, kMm);
  const double room = spec.body_semi_axes.head<2>().minCoeff();
  if (spec.skin_mm + spec.fat_mm >= room) {
    reader.problems().add(reader.path_of("fat_mm"), Json(spec.fat_mm).dump(),
                          "with skin_mm below " + Json(room).dump(),
                          "skin and fat have to leave room in the body");
  }
  reader.finish();
}

/// Turns about x, then y, then z.
Mat3 read_rotation(JsonReader& reader) {
  const Vec3 angles = kRadPerDeg * reader.point("rotation_deg", Vec3(Vec3::Zero()));
  return (Eigen::AngleAxisd(angles.z(), Vec3::UnitZ()) *
          Eigen::AngleAxisd(angles.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Vec3::UnitX()))
      .toRotationMatrix();
}

PhantomEllipsoid read_organ(JsonReader reader) {
  PhantomEllipsoid organ;
  organ.name = reader.text("name", std::nullopt);
  organ.hu = reader.number("hu", std::nullopt, kHu);
  organ.center = read_place(reader, "center_mm");
  organ.semi_axes = read_semi_axes(reader);
  organ.rotation = read_rotation(reader);
  organ.shell_mm = read_shell(reader, organ.shell_mm, organ.semi_axes.minCoeff());
  organ.shell_hu = reader.number("shell_hu", organ.shell_hu, kHu);
  reader.finish();
  return organ;
}

PhantomVertebra read_vertebra(JsonReader reader) {
  PhantomVertebra vertebra;
  vertebra.center = read_place(reader, "center_mm");
  vertebra.semi_axes = read_semi_axes(reader);
  const double room = preprocess::thinnest_part(vertebra);
  vertebra.shell_mm = read_shell(reader, std::min(vertebra.shell_mm, 0.5 * room), room);
  vertebra.shell_hu = reader.number("shell_hu", vertebra.shell_hu, kHu);
  vertebra.core_hu = reader.number("core_hu", vertebra.core_hu, kHu);
  reader.finish();
  return vertebra;
}

/// Names of arteries become names of files.
std::string read_tube_name(JsonReader& reader, const std::vector<PhantomTube>& others) {
  const std::string name = reader.file_name("name", std::nullopt);
  const bool taken =
      !name.empty() && std::any_of(others.begin(), others.end(),
                                   [&](const PhantomTube& other) { return other.name == name; });
  if (taken) {
    reader.problems().add(reader.path_of("name"), Json(name).dump(), "a name of its own",
                          "another tube has it");
  }
  return name;
}

PhantomTubeKind read_tube_kind(JsonReader& reader) {
  const std::string kind =
      reader.choice("kind", std::nullopt, {"artery", "vein", "thrombus", "tissue"});
  if (kind == "vein") return PhantomTubeKind::kVein;
  if (kind == "thrombus") return PhantomTubeKind::kThrombus;
  return kind == "tissue" ? PhantomTubeKind::kTissue : PhantomTubeKind::kArtery;
}

PhantomTube read_tube(JsonReader reader, const std::vector<PhantomTube>& others) {
  PhantomTube tube;
  Problems& problems = reader.problems();
  tube.name = read_tube_name(reader, others);
  tube.kind = read_tube_kind(reader);
  const bool hu_varies = reader.raw("hu").is_array();
  if (!hu_varies) tube.hu = reader.number("hu", std::nullopt, kHu);
  tube.wall_mm = reader.number("wall_mm", tube.wall_mm, kMm);

  // Control points, of which two neighbours may not coincide.
  const std::vector<Vec3> points = reader.points("points_mm", true);
  const std::size_t given = reader.raw("points_mm").size();
  if (given == 1) {
    problems.add(reader.path_of("points_mm"), reader.raw("points_mm").dump(), "two points or more");
  }
  tube.points.resize(3, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    tube.points.col(i) = points[i];
    expect_near(reader, "points_mm[" + std::to_string(i) + "]", points[i]);
    if (i > 0 && (points[i] - points[i - 1]).norm() < 0.1) {
      problems.add(reader.path_of("points_mm") + "[" + std::to_string(i) + "]",
                   to_json(points[i]).dump(), "0.1 mm or more from the point before it",
                   "delete one of the two");
    }
  }

  // One radius for each.
  const std::vector<double> radius = reader.numbers("radius_mm", std::nullopt, kPositiveMm);
  if (reader.has("points_mm") && reader.has("radius_mm") &&
      reader.raw("radius_mm").size() != given) {
    problems.add(reader.path_of("radius_mm"),
                 "a list of " + std::to_string(reader.raw("radius_mm").size()),
                 "one radius for each of the " + std::to_string(given) + " points");
  }
  tube.radius = Eigen::VectorXd::Map(radius.data(), radius.size());

  // One value, or one for each.
  if (hu_varies) {
    const std::vector<double> hu = reader.numbers("hu", std::nullopt, kHu);
    if (reader.has("points_mm") && reader.raw("hu").size() != given) {
      problems.add(reader.path_of("hu"), "a list of " + std::to_string(reader.raw("hu").size()),
                   "a number, or one for each of the " + std::to_string(given) + " points");
    }
    tube.hu_along = Eigen::VectorXd::Map(hu.data(), hu.size());
  }
  reader.finish();
  return tube;
}

/// The tube that the key "tube" names; null after a problem, which is told.
const PhantomTube* find_tube(JsonReader& reader, const std::string& name,
                             const std::vector<PhantomTube>& tubes) {
  const auto tube = std::find_if(tubes.begin(), tubes.end(),
                                 [&](const PhantomTube& one) { return one.name == name; });
  if (tube != tubes.end()) return &*tube;
  reader.problems().add(reader.path_of("tube"), Json(name).dump(), "the name of a tube");
  return nullptr;
}

PhantomCalcium read_calcium(JsonReader reader, const std::vector<PhantomTube>& tubes) {
  PhantomCalcium calcium;
  calcium.tube = reader.text("tube", std::nullopt);
  calcium.at = reader.number("at", std::nullopt, {.min = 0.0, .max = 1.0});
  calcium.angle_deg = reader.number("angle_deg", calcium.angle_deg, {.min = -360.0, .max = 360.0});
  calcium.length_mm = reader.number("length_mm", calcium.length_mm, kPositiveMm);
  calcium.width_deg = reader.number("width_deg", calcium.width_deg, {.min = 1.0, .max = 360.0});
  calcium.thickness_mm = reader.number("thickness_mm", calcium.thickness_mm, kPositiveMm);
  calcium.hu = reader.number("hu", calcium.hu, kHu);
  const PhantomTube* tube = find_tube(reader, calcium.tube, tubes);
  if (tube && tube->radius.size() > 0 && calcium.thickness_mm >= 0.5 * tube->radius.minCoeff()) {
    reader.problems().add(reader.path_of("thickness_mm"), Json(calcium.thickness_mm).dump(),
                          "below half the smallest radius of the tube, " +
                              Json(0.5 * tube->radius.minCoeff()).dump());
  }
  reader.finish();
  return calcium;
}

PhantomStent read_stent(JsonReader reader, const std::vector<PhantomTube>& tubes) {
  PhantomStent stent;
  stent.tube = reader.text("tube", std::nullopt);
  stent.from = reader.number("from", std::nullopt, {.min = 0.0, .max = 1.0});
  stent.to = reader.number("to", std::nullopt, {.min = 0.0, .max = 1.0});
  stent.strut_mm = reader.number("strut_mm", stent.strut_mm, kPositiveMm);
  stent.pitch_mm = reader.number("pitch_mm", stent.pitch_mm, {.min = 0.1, .max = 1000.0});
  stent.amplitude_mm = reader.number("amplitude_mm", stent.amplitude_mm, kMm);
  stent.crowns = reader.integer("crowns", stent.crowns, 1, 100);
  stent.hu = reader.number("hu", stent.hu, kHu);
  if (stent.to <= stent.from) {
    reader.problems().add(reader.path_of("to"), Json(stent.to).dump(),
                          "more than from, " + Json(stent.from).dump());
  }
  find_tube(reader, stent.tube, tubes);
  reader.finish();
  return stent;
}

preprocess::PhantomBreath read_breath(JsonReader reader) {
  preprocess::PhantomBreath breath;
  breath.above_z_mm = reader.number("above_z_mm", std::nullopt, {.min = -1e5, .max = 1e5});
  breath.shift_mm =
      read_three(reader, "shift_mm", {.min = -100.0, .max = 100.0}, Vec3(Vec3::Zero()));
  reader.finish();
  return breath;
}

/// A folder that is gone, with all that is left in it, when the work in it ends.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(fs::path path) : path_(std::move(path)) {
    fs::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // a destructor has nobody to tell
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

Json centerlines_to_json(const Phantom& phantom) {
  Json arteries = Json::array();
  for (std::size_t i = 0; i < phantom.names.size(); ++i) {
    const Centerline& line = phantom.centerlines[i];
    arteries.push_back(
        {{"name", phantom.names[i]},
         {"points_mm", to_json(line.points)},
         {"radius_mm", std::vector<double>(line.radius.begin(), line.radius.end())}});
  }
  return {{"schema", "wireplan.phantom-truth/1"}, {"frame", "LPS"}, {"arteries", arteries}};
}

void write_files(const Phantom& phantom, const Json* case_file, const fs::path& folder) {
  const TemporaryFolder part(folder / (".part-" + std::to_string(::getpid())));
  fs::create_directories(folder / "truth");
  const auto commit = [&](const fs::path& file, const auto& write) {
    const fs::path beside = part.path() / file.filename();
    write(beside);
    fs::rename(beside, folder / file);
  };
  for (std::size_t i = 0; i < phantom.names.size(); ++i) {
    if (phantom.centerlines[i].points.cols() < 2) continue;
    commit(fs::path("truth") / (phantom.names[i] + ".vtp"), [&](const fs::path& beside) {
      preprocess::write_centerline(phantom.centerlines[i], beside);
    });
  }
  commit("truth/centerlines.json",
         [&](const fs::path& beside) { write_json(centerlines_to_json(phantom), beside); });
  commit("truth/lumen.nrrd",
         [&](const fs::path& beside) { preprocess::write_mask(phantom.lumen, beside); });
  if (case_file) {
    commit("case.json", [&](const fs::path& beside) { write_json(*case_file, beside); });
  }
  commit("ct.nrrd",
         [&](const fs::path& beside) { preprocess::write_image(phantom.image, beside); });
}

}  // namespace

PhantomSpec read_phantom_spec(const fs::path& path) {
  const Json file = read_json(path, "wireplan.phantom/1");
  Problems problems(path.string());
  JsonReader reader(file, "", problems);
  PhantomSpec spec;
  reader.text("schema", std::nullopt);
  spec.grid = read_grid(reader.object("grid", true));
  read_body(reader.object("body", true), spec);
  for (const JsonReader& organ : reader.objects("organs", false)) {
    spec.organs.push_back(read_organ(organ));
  }
  for (const JsonReader& vertebra : reader.objects("vertebrae", false)) {
    spec.vertebrae.push_back(read_vertebra(vertebra));
  }
  for (const JsonReader& tube : reader.objects("tubes", true)) {
    spec.tubes.push_back(read_tube(tube, spec.tubes));
  }
  for (const JsonReader& calcium : reader.objects("calcium", false)) {
    spec.calcium.push_back(read_calcium(calcium, spec.tubes));
  }
  for (const JsonReader& stent : reader.objects("stents", false)) {
    spec.stents.push_back(read_stent(stent, spec.tubes));
  }
  if (reader.has("breath")) spec.breath = read_breath(reader.object("breath", true));
  spec.blur_mm = reader.number("blur_mm", spec.blur_mm, {.min = 0.0, .max = 20.0});
  spec.noise_hu = reader.number("noise_hu", spec.noise_hu, {.min = 0.0, .max = 1000.0});
  spec.noise_texture_mm =
      reader.number("noise_texture_mm", spec.noise_texture_mm, {.min = 0.0, .max = 5.0});
  spec.seed = static_cast<std::uint64_t>(reader.integer("seed", 1, 0, 2147483647));
  spec.supersampling = reader.integer("supersampling", spec.supersampling, 1, 16);
  reader.finish();
  problems.throw_if_any();
  return spec;
}

namespace {

void write_checked(const Phantom& phantom, const Json* case_file, const fs::path& folder) {
  if (!preprocess::reads_volumes()) {
    throw Error(folder.string() +
                ": no volume can be written by this build of wireplan, which has no images (build "
                "it with -DWIREPLAN_IMAGING=ON)");
  }
  try {
    write_files(phantom, case_file, folder);
  } catch (const fs::filesystem_error& error) {
    throw DiskError(folder.string() + ": cannot be written: " + error.code().message() +
                    " (check its permissions and the free space)");
  }
}

}  // namespace

void write_phantom(const Phantom& phantom, const fs::path& folder) {
  write_checked(phantom, nullptr, folder);
}

void write_patient(const preprocess::RandomPatient& patient, const fs::path& folder) {
  const Json case_file = {{"schema", "wireplan.case/1"},
                          {"name", "random-" + std::to_string(patient.spec.seed)},
                          {"volume", {{"path", "ct.nrrd"}}},
                          {"access", {{"point_mm", to_json(patient.access.point)}}},
                          {"target", {{"point_mm", to_json(patient.target.point)}}},
                          {"wires", {"glidewire-angled", "amplatz-stiff", "amplatz-stiff-angled"}}};
  write_checked(make_phantom(patient.spec), &case_file, folder);
}

}  // namespace wireplan::pipeline
