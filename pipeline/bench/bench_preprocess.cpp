// `wireplan bench preprocess`: from a CT on the disk to a factored wall and distance field, step by
// step, with what each costs and how far the surface is from the truth of the generator.
#include <malloc.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "pipeline/bench/bench_report.h"
#include "pipeline/files/clock.h"
#include "pipeline/files/text.h"
#include "pipeline/report/plot.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/cores.h"
#include "preprocess/segment/segment.h"
#include "preprocess/surface/openings.h"
#include "preprocess/surface/surface.h"
#include "preprocess/volume/phantom.h"
#include "preprocess/volume/phantom_lumen.h"
#include "preprocess/wall/wall.h"
#include "simulate/wall/vessel_model.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kAimSeconds = 10.0, kAimMegabytes = 2000.0;
const Vec3 kAccess(-55.0, -20.0, -120.0), kTarget(38.0, 14.0, 70.0);

preprocess::PhantomTube tube(const std::string& name, preprocess::PhantomTubeKind kind, double hu,
                             double wall, const std::vector<Vec3>& points,
                             const std::vector<double>& radius) {
  preprocess::PhantomTube result{
      .name = name, .kind = kind, .hu = hu, .wall_mm = wall, .points = {}, .radius = {}};
  result.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    result.points.col(static_cast<Eigen::Index>(k)) = points[k];
  }
  result.radius = Eigen::VectorXd::Map(radius.data(), static_cast<Eigen::Index>(radius.size()));
  return result;
}

/// An abdomen: aorta with an aneurysm, iliac, renal and mesenteric arteries, the cava beside it,
/// the spine behind. Full: 512 x 512 x 400 voxels of 0.7 x 0.7 x 0.72 mm; quick: of 1.4 mm, a
/// quarter of that along each axis that the vessel leaves free.
preprocess::PhantomSpec abdomen(bool quick) {
  using enum preprocess::PhantomTubeKind;
  preprocess::PhantomSpec spec;
  if (quick) {
    spec.grid.size = {130, 100, 200};
    spec.grid.spacing = {1.4, 1.4, 1.44};
    spec.grid.origin = {-90.0, -60.0, -144.0};
  } else {
    spec.grid.size = {512, 512, 400};
    spec.grid.spacing = {0.7, 0.7, 0.72};
    spec.grid.origin = {-178.85, -178.85, -144.0};
  }
  spec.body_semi_axes = {152.0, 100.0, 1000.0};
  spec.supersampling = 2;
  for (int k = 0; k < 6; ++k) {
    spec.vertebrae.push_back(
        {.center = {0.0, 44.0, 130.0 - 36.0 * k}, .semi_axes = {22.0, 16.0, 13.0}});
  }
  spec.tubes = {
      tube("cava", kVein, 120.0, 0.5, {{-18, 0, 160}, {-17, 1, 60}, {-13, 5, -18}}, {11, 10, 8}),
      tube("aorta", kArtery, 350.0, 1.3, {{4, 8, 160}, {5, 6, 90}, {14, 1, 40}, {4, -1, -2}},
           {10, 9, 13, 8}),
      tube("right-iliac", kArtery, 350.0, 1.0,
           {{2, -1, 2},
            {-17, 3, -29},
            {-37, 22, -56},
            {-54, 6, -86},
            {-55, -20, -120},
            {-57, -30, -160}},
           {6.2, 5.2, 4.8, 4.4, 4.3, 4.5}),
      tube("left-iliac", kArtery, 350.0, 1.0,
           {{6.5, -1, 2},
            {25, 9, -27},
            {41, 24, -55},
            {58, 6, -85},
            {60, -20, -120},
            {62, -30, -160}},
           {6.2, 5.2, 4.8, 4.4, 4.3, 4.5}),
      tube("right-renal", kArtery, 350.0, 0.8, {{5, 6, 78}, {-17, 14, 75}, {-50, 24, 66}},
           {3.1, 2.8, 2.8}),
      tube("left-renal", kArtery, 350.0, 0.8, {{7, 6, 76}, {20, 8, 74}, {55, 22, 66}},
           {3.1, 3.0, 2.8}),
      tube("mesenteric", kArtery, 350.0, 0.9,
           {{4.5, 5, 104}, {5, -12, 102}, {6, -25, 80}, {-2, -30, 44}, {-10, -33, 4}},
           {3.9, 3.6, 3.5, 3.1, 2.4})};
  return spec;
}

struct SurfaceError {
  double mean = 0.0, p95 = 0.0;  // of the vertices, the caps at the volume's border apart    [mm]
};

SurfaceError compare(const Surface& surface, const preprocess::PhantomLumen& truth,
                     const preprocess::Grid& grid) {
  constexpr Eigen::Index kMost = 10'000;  // vertices looked at
  const Eigen::Index step = std::max<Eigen::Index>(1, surface.vertices.cols() / kMost);
  std::vector<double> errors;
  for (Eigen::Index v = 0; v < surface.vertices.cols(); v += step) {
    const Vec3 p = grid.ijk_from_lps(surface.vertices.col(v));
    bool capped = false;
    for (int axis = 0; axis < 3; ++axis) {
      capped = capped || p[axis] < 3.0 || p[axis] > grid.size[axis] - 4.0;
    }
    if (!capped) errors.push_back(std::abs(truth.distance(surface.vertices.col(v))));
  }
  expects(!errors.empty());
  std::sort(errors.begin(), errors.end());
  double sum = 0.0;
  for (const double error : errors) sum += error;
  return {.mean = sum / static_cast<double>(errors.size()),
          .p95 = errors[errors.size() * 95 / 100]};
}

/// Largest resident memory of the process since the last reset. Linux tells and resets it in /proc;
/// null where it does not.
class PeakMemory {
 public:
  PeakMemory() {
    malloc_trim(0);
    std::ofstream file("/proc/self/clear_refs");
    file << "5";
    file.close();
    counts_ = static_cast<bool>(file);
  }
  Json megabytes() const {
    std::ifstream file("/proc/self/status");
    for (std::string line; counts_ && std::getline(file, line);) {
      if (line.starts_with("VmHWM:")) return std::round(std::stod(line.substr(6)) / 1024.0);
    }
    return nullptr;
  }

 private:
  bool counts_ = false;
};

/// The volume as scanners hand it on: 16 bit, not compressed.
void write_raw_nrrd(const preprocess::Image& image, const fs::path& path) {
  static_assert(std::endian::native == std::endian::little);
  std::ofstream file(path, std::ios::binary);
  const preprocess::Grid& grid = image.grid;
  file << "NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\nsizes: "
       << grid.size[0] << " " << grid.size[1] << " " << grid.size[2] << "\nspace directions: ("
       << grid.spacing[0] << ",0,0) (0," << grid.spacing[1] << ",0) (0,0," << grid.spacing[2]
       << ")\nspace origin: (" << grid.origin[0] << "," << grid.origin[1] << "," << grid.origin[2]
       << ")\nendian: little\nencoding: raw\n\n";
  std::vector<std::int16_t> row(static_cast<std::size_t>(grid.size[0]));
  for (std::size_t start = 0; start < image.values.size(); start += row.size()) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      row[i] = static_cast<std::int16_t>(std::lround(image.values[start + i]));
    }
    file.write(reinterpret_cast<const char*>(row.data()),
               static_cast<std::streamsize>(row.size() * sizeof(std::int16_t)));
  }
  file.close();
  if (!file) {
    throw Error(path.string() +
                ": cannot write the volume; expected a folder that may be written " + "to with " +
                std::to_string(image.values.size() * 2 / 1'000'000) + " MB free");
  }
}

Picture plot_of(const std::vector<Json>& rows) {
  FrontPlot plot{"Preprocessing, step by step", "wall time, s", "largest memory, MB", {}};
  std::vector<LegendEntry> legend;
  const std::vector<Color> colors = {{0.12F, 0.47F, 0.71F},
                                     {1.0F, 0.5F, 0.05F},
                                     {0.17F, 0.63F, 0.17F},
                                     {0.84F, 0.15F, 0.16F},
                                     {0.58F, 0.4F, 0.74F},
                                     {0.55F, 0.34F, 0.29F},
                                     kInk};
  for (const Json& row : rows) {
    FrontLine line{.entry = legend.size(), .points = {}};
    if (!row.at("peak_mb").is_null()) {
      line.points.emplace_back(std::max(1e-3, row.at("wall_s").get<double>()),
                               std::max(1.0, row.at("peak_mb").get<double>()));
    } else {
      line.points.emplace_back(std::max(1e-3, row.at("wall_s").get<double>()), 1.0);
    }
    legend.push_back({row.at("step").get<std::string>(), colors[legend.size() % colors.size()]});
    plot.lines.push_back(line);
  }
  return draw_fronts("wireplan bench preprocess", {plot}, 1, legend);
}

/// What the steps cost, and what came of them.
struct Preprocessed {
  std::vector<Json> rows{};            // a step each, then their sum
  double wall_s = 0.0, most_mb = 0.0;  // of all steps; no memory known: 0
  Surface surface{};
  SurfaceError error{};
};

/// Each step on what the one before left, as the pipeline does it.
Preprocessed run_steps(const preprocess::PhantomSpec& spec, bool quick) {
  const preprocess::PhantomLumen truth(spec);
  const fs::path file =
      fs::temp_directory_path() / ("wireplan-bench-" + std::to_string(::getpid()) + ".nrrd");
  write_raw_nrrd(preprocess::make_phantom(spec).image, file);

  Preprocessed all;
  preprocess::Image image;
  preprocess::Segmentation lumen;
  preprocess::ExtrudedWall wall;
  std::optional<SurfaceError> error;
  double cpu_sum = 0.0;
  const auto run = [&](const std::string& name, const std::function<void()>& step) {
    const PeakMemory memory;
    const double cpu = process_cpu_seconds();
    const auto start = std::chrono::steady_clock::now();
    step();
    const double wall_s = seconds_since(start);
    const double cpu_s = process_cpu_seconds() - cpu;
    const Json peak = memory.megabytes();
    if (!error && all.surface.triangles.cols() > 0) error = compare(all.surface, truth, spec.grid);
    cpu_sum += cpu_s;
    all.wall_s += wall_s;
    all.most_mb = std::max(all.most_mb, peak.is_null() ? 0.0 : peak.get<double>());
    all.rows.push_back({{"step", name},
                        {"cpu_s", cpu_s},
                        {"wall_s", wall_s},
                        {"peak_mb", peak},
                        {"surface_error_mm", error ? Json(error->mean) : Json(nullptr)}});
  };
  run("read", [&] { image = preprocess::read_image(file); });
  fs::remove(file);
  run("segment", [&] {
    lumen = preprocess::segment(image, {.lower_hu = 200.0,
                                        .upper_hu = 600.0,
                                        .seeds = {kTarget, {5.0, 6.0, 90.0}},
                                        .neck_opening_mm = quick ? 0.0 : 1.2});
  });
  run("surface", [&] {
    all.surface =
        preprocess::surface_from_image(image, lumen.mask, {.edge_length_mm = quick ? 2.0 : 1.15});
  });
  image = {};
  lumen = {};
  run("centerline", [&] { preprocess::find_centerline(all.surface, kAccess, kTarget); });
  run("wall", [&] { wall = preprocess::extrude_wall(all.surface, {}); });
  run("distance field and factored wall", [&] {
    const simulate::VesselModel model(all.surface, wall.wall, simulate::follow(all.surface));
    expects(model.compliance != nullptr);
  });
  all.rows.push_back({{"step", "total"},
                      {"cpu_s", cpu_sum},
                      {"wall_s", all.wall_s},
                      {"peak_mb", all.most_mb > 0.0 ? Json(all.most_mb) : Json(nullptr)},
                      {"surface_error_mm", error->mean}});
  all.error = *error;
  return all;
}

}  // namespace

BenchReport bench_preprocess(const BenchOptions& options) {
  if (!preprocess::reads_volumes()) {
    throw Error(
        "bench: preprocess needs images, and this wireplan is built without them; configure with "
        "-DWIREPLAN_IMAGING=ON");
  }
  const preprocess::PhantomSpec spec = abdomen(options.quick);
  Preprocessed all = run_steps(spec, options.quick);
  BenchReport report;
  report.rows = std::move(all.rows);
  const preprocess::SurfaceCheck check = preprocess::check_surface(all.surface);
  report.results["triangles"] = check.triangles;
  report.results["euler_number"] = check.euler_number;
  report.results["self_intersections"] = check.self_intersections;
  report.results["surface_error_p95_mm"] = all.error.p95;
  report.results["aims"] = {
      {{"what", "wall time of all steps, s"}, {"aim", kAimSeconds}, {"found", all.wall_s}},
      {{"what", "largest memory, MB"}, {"aim", kAimMegabytes}, {"found", all.most_mb}}};
  report.description["volume"] = {
      {"size", spec.grid.size},
      {"spacing_mm", {spec.grid.spacing[0], spec.grid.spacing[1], spec.grid.spacing[2]}},
      {"noise_hu", spec.noise_hu}};
  report.description["columns"] = {
      {"cpu_s", "of all threads"},
      {"peak_mb", "largest resident memory of the program during the step"},
      {"surface_error_mm",
       "mean distance of the surface's vertices from the generator's tubes; null before there is a "
       "surface"}};
  report.text = table_text(report.rows) + "\n" + std::to_string(check.triangles) +
                " triangles, Euler number " + std::to_string(check.euler_number) +
                ", surface within " + format("%.3f mm", all.error.p95) + " of the truth at 95 %\n" +
                format("aims for 512 x 512 x 400 voxels on 2 idle cores: %g s", kAimSeconds) +
                format(" and %g MB\n", kAimMegabytes);
  report.plot = plot_of(report.rows);
  return report;
}

}  // namespace wireplan::pipeline
