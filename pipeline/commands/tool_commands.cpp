#include <charconv>
#include <fstream>
#include <iostream>
#include <memory>

#include "pipeline/bench/bench.h"
#include "pipeline/commands/check.h"
#include "pipeline/commands/commands.h"
#include "pipeline/commands/scene_run.h"
#include "pipeline/commands/subcommands.h"
#include "pipeline/files/case_file.h"
#include "pipeline/files/disk.h"
#include "pipeline/files/phantom_file.h"
#include "pipeline/files/text.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/overview.h"
#include "pipeline/report/print.h"
#include "pipeline/report/render.h"
#include "pipeline/store/cache.h"
#include "plan/number_text.h"
#include "preprocess/volume/random_patient.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerMb = 1e6;

int print_cache(const std::string& folder) {
  const Store store(cache_folder(folder));
  std::cout << "stage       key           MB  unused days\n";
  for (const CacheEntry& entry : list_cache(store)) {
    std::cout << format("%-10s  %s  %8.2f  %11.1f\n", entry.artifact.stage.c_str(),
                        entry.artifact.key.substr(0, 8).c_str(),
                        static_cast<double>(entry.bytes) / kBytesPerMb, entry.days_unused);
  }
  std::cout << store.root().string() << ": "
            << format("%.1f MB on the disk\n",
                      static_cast<double>(bytes_on_disk(store)) / kBytesPerMb);
  return kDone;
}

int verify_cache_command(const std::string& folder) {
  const Store store(cache_folder(folder));
  const std::vector<CacheDamage> damages = verify_cache(store);
  for (const CacheDamage& damage : damages) {
    std::cout << damage.place.string() << ": " << damage.what << "\n";
  }
  std::cout << (damages.empty() ? "every artifact is intact"
                                : std::to_string(damages.size()) +
                                      " damaged; they will be made again when they are needed")
            << "\n";
  return damages.empty() ? kDone : kBadInput;
}

int prune_cache_command(const std::string& folder, const PruneOptions& options) {
  const PruneResult result = prune_cache(Store(cache_folder(folder)), options);
  std::cout << format("removed %d artifacts, %d trials and %d leftovers of stopped runs: %.1f MB\n",
                      result.artifacts, result.pieces, result.leftovers,
                      static_cast<double>(result.bytes) / kBytesPerMb);
  return kDone;
}

// The "schema" of a file, to tell a case from a scene; empty where it has none.
std::string schema_of(const fs::path& path) {
  if (!fs::is_regular_file(path)) return "";
  std::ifstream stream(path);
  const Json file = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  return file.is_object() && file.contains("schema") && file["schema"].is_string()
             ? file["schema"].get<std::string>()
             : "";
}

int check_file(const std::string& path, const std::vector<std::string>& overrides) {
  const std::string schema = schema_of(path);
  const auto print_told = [](const std::vector<std::string>& lines, const char* before) {
    for (const std::string& line : lines) std::cout << "  " << before << line << "\n";
  };
  if (schema.rfind("wireplan.scene/", 0) == 0) {
    const std::vector<std::string> told = check_scene_vessel(read_scene(path));
    std::cout << path << ": the scene is in order\n";
    print_told(told, "");
  } else if (schema.rfind("wireplan.phantom/", 0) == 0) {
    read_phantom_spec(path);
    std::cout << path << ": the description is in order\n";
  } else {
    const Case given = read_case(path, overrides);
    const std::vector<std::string> told = check_input(given);
    const auto trials = static_cast<int>(plan::list_candidates(given.study).size());
    std::cout << given.file.string() << ": the case is in order, "
              << plan::count_of(trials, "trial") << "\n";
    print_told(told, "");
    print_told(given.told, "");
    const simulate::InsertionOptions& insertion = given.study.insertion;
    print_told(tell_friction(given.devices, insertion), "");
    print_told(warn_of_friction(given.devices, insertion), "mind: ");
  }
  return kDone;
}

int simulate_file(const std::string& path, const std::string& given_output) {
  const SceneFile scene = read_scene(path);
  const fs::path output =
      given_output.empty() ? fs::path("wireplan-out") / scene.name : fs::path(given_output);
  require_folder(output, kResults);
  const SceneAnswer answer = run_scene_file(scene, output);
  const bool listed = scene.insertion && !scene.insertion->rolls.empty();
  std::cout << answer.line << "\n"
            << (listed ? "results: " + (output / "roll_*" / "result.json").string()
                       : "result: " + (output / "result.json").string())
            << "\n";
  return answer.solved ? kDone : kNoPlan;
}

// Those of an overview's sections in folders named as theirs.
int render_pictures(const fs::path& given, const fs::path& output, bool pdf) {
  require_folder(output, kResults);
  for (const fs::path& report : reports_in(given)) {
    const fs::path folder =
        report == given ? output
                        : output / report.parent_path().lexically_relative(given.parent_path());
    if (pdf) std::cout << print_sheet(report, folder).string() << "\n";
    for (const std::string& line : render_report(report, folder)) std::cout << line << "\n";
  }
  return kDone;
}

int make_phantom_files(const std::string& path, const std::string& output) {
  const preprocess::PhantomSpec spec = read_phantom_spec(path);
  require_folder(output, kResults);
  write_phantom(preprocess::make_phantom(spec), output);
  std::cout << "volume: " << (fs::path(output) / "ct.nrrd").string() << "\n";
  return kDone;
}

int make_patient_files(std::uint64_t seed, const std::string& output) {
  require_folder(output, kResults);
  const preprocess::RandomPatient patient = preprocess::draw_patient(seed);
  write_patient(patient, output);
  std::string features;
  for (const std::string& feature : patient.features) features += ", " + feature;
  const preprocess::Grid& grid = patient.spec.grid;
  std::cout << patient.anatomy << features << "\n"
            << format("%d x %d x %d voxels of %.2f x %.2f x %.3g mm, contrast %.0f to %.0f HU",
                      grid.size[0], grid.size[1], grid.size[2], grid.spacing[0], grid.spacing[1],
                      grid.spacing[2], patient.access_contrast_hu, patient.target_contrast_hu)
            << format(", noise %.0f HU\n", patient.spec.noise_hu) << "from the "
            << patient.access.name << " to the " << patient.target.name << "\n"
            << "case: " << (fs::path(output) / "case.json").string() << "\n";
  return kDone;
}

/// The N of segmentation, from what stands behind the name.
int patient_count(const std::vector<std::string>& of) {
  int count = 0;
  const char* end = of.front().data() + of.front().size();
  const auto [last, failure] = std::from_chars(of.front().data(), end, count);
  if (failure != std::errc() || last != end || count < 1 || count > 1'000'000 || of.size() > 1) {
    throw Error("bench: N is '" + of.front() + (of.size() > 1 ? " " + of[1] : "") +
                "', expected one whole number of patients from 1 to 1000000");
  }
  return count;
}

}  // namespace

fs::path cache_folder(const std::string& given) {
  const fs::path folder = given.empty() ? Store::default_root() : fs::path(given);
  require_no_file(folder, kCachePurpose);
  return folder;
}

void add_cache_option(CLI::App& command, std::string& folder) {
  command.add_option(
      "--cache", folder,
      "Folder of the artifact store [$XDG_CACHE_HOME/wireplan or ~/.cache/wireplan]");
}

void add_cache(CLI::App& app, int& code) {
  struct CacheArguments {
    std::string folder;
    double unused_days = 0.0, max_gb = 0.0;
  };
  const auto arguments = std::make_shared<CacheArguments>();
  CLI::App* cache = app.add_subcommand("cache", "List, verify or prune the artifact store");
  cache->require_subcommand(1);
  cache->footer("Example: wireplan cache prune --unused-days 30");
  CLI::App* list = cache->add_subcommand("list", "Every artifact, its size and when it was used");
  add_cache_option(*list, arguments->folder);
  list->callback([&code, arguments] { code = print_cache(arguments->folder); });
  CLI::App* verify = cache->add_subcommand("verify", "Read every byte; exits 2 where some differ");
  add_cache_option(*verify, arguments->folder);
  verify->callback([&code, arguments] { code = verify_cache_command(arguments->folder); });
  CLI::App* prune =
      cache->add_subcommand("prune", "Remove what is damaged, and what stopped runs left");
  add_cache_option(*prune, arguments->folder);
  CLI::Option* days = prune
                          ->add_option("--unused-days", arguments->unused_days,
                                       "Also what was not used for so many days")
                          ->check(CLI::Range(0.0, 1e5));
  CLI::Option* most = prune
                          ->add_option("--max-gb", arguments->max_gb,
                                       "Also what was not used for longest, down to this size")
                          ->check(CLI::Range(0.0, 1e6));
  prune->callback([&code, arguments, days, most] {
    PruneOptions prune_options;
    if (days->count() > 0) prune_options.unused_days = arguments->unused_days;
    if (most->count() > 0) {
      prune_options.max_bytes = static_cast<std::uintmax_t>(arguments->max_gb * 1e3 * kBytesPerMb);
    }
    code = prune_cache_command(arguments->folder, prune_options);
  });
}

void add_check(CLI::App& app, int& code) {
  struct Arguments {
    std::string path;
    std::vector<std::string> overrides;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* check = app.add_subcommand("check", "Check a case or scene without running it");
  check->add_option("FILE", arguments->path, "Case file or folder, or a scene file")->required();
  check
      ->add_option("--set", arguments->overrides, "Change a value of the case: wall.thickness_mm=2")
      ->allow_extra_args(false);
  check->footer("Tells all that is wrong at once. Example: wireplan check cases/abdomen");
  check->callback([&code, arguments] { code = check_file(arguments->path, arguments->overrides); });
}

void add_compare(CLI::App& app, int& code) {
  const auto reports = std::make_shared<std::vector<fs::path>>();
  CLI::App* compare = app.add_subcommand("compare", "Wires and plans of several reports");
  compare->add_option("REPORT", *reports, "report.json of two cases or more")
      ->required()
      ->expected(1, 100000);
  compare->footer(
      "The same patient with other wires, or many patients with the same.\n"
      "Example: wireplan compare out/one/report.json out/two/report.json");
  compare->callback([&code, reports] {
    std::cout << compare_reports(*reports);
    code = kDone;
  });
}

void add_simulate(CLI::App& app, int& code) {
  struct Arguments {
    std::string path;
    std::string output;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* simulate = app.add_subcommand("simulate", "One wire, its supports, loads and vessel");
  simulate->add_option("SCENE", arguments->path, "Scene file")->required();
  simulate->add_option("-o,--output", arguments->output,
                       "Results [wireplan-out/NAME OF SCENE OR FOLDER]");
  simulate->footer(
      "Writes result.json, wire.vtp and wire.png; of an insertion the shapes on the way\n"
      "(shapes.pvd), in a vessel the forces on its wall (forces.vtu). Exits 1 where no\n"
      "equilibrium was found.\n"
      "Example: wireplan simulate cases/cantilever/scene.json -o out");
  simulate->callback(
      [&code, arguments] { code = simulate_file(arguments->path, arguments->output); });
}

void add_phantom(CLI::App& app, int& code) {
  struct Arguments {
    std::string path;
    std::string output;
    std::uint64_t seed = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* phantom =
      app.add_subcommand("phantom", "A CT volume from an anatomical description, with its truth");
  CLI::Option* spec = phantom->add_option("SPEC", arguments->path, "Description");
  CLI::Option* random =
      phantom
          ->add_option("--random", arguments->seed, "A patient drawn from this seed, in its place")
          ->check(CLI::Range(0, 2147483647));
  phantom->add_option("-o,--output", arguments->output, "Folder for volume and truth")->required();
  phantom->footer(
      "A patient drawn at random has an abdomen or an arch with some of aneurysm and thrombus,\n"
      "stenosis, calcium, stents, limbs that kiss, veins and organs with contrast, a breath and\n"
      "thick slices, and a case.json that runs: wireplan phantom --random 7 -o patient-7\n"
      "Example: wireplan phantom cases/abdomen/phantom.json -o cases/abdomen/data");
  phantom->callback([&code, arguments, spec, random] {
    if ((spec->count() > 0) == (random->count() > 0)) {
      throw CLI::RequiredError("either SPEC or --random SEED");
    }
    code = random->count() > 0 ? make_patient_files(arguments->seed, arguments->output)
                               : make_phantom_files(arguments->path, arguments->output);
  });
}

void add_render(CLI::App& app, int& code) {
  struct Arguments {
    std::string report;
    std::string output;
    bool pdf = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* render = app.add_subcommand("render", "Pictures of a report, without a display");
  render->add_option("REPORT", arguments->report, "report.json among the files of its run")
      ->required();
  render->add_option("-o,--output", arguments->output, "Folder for the pictures")->required();
  render->add_flag("--pdf", arguments->pdf, "Print the page's first sheet too, with Chromium");
  render->footer(
      "Writes vessel.png (the best plans), forces.png (the largest force on the wall),\n"
      "angles.png (every trial) and numerics.png (error against run time); with --pdf also\n"
      "sheet.pdf, one A4 page, by the Chromium on the PATH or named by WIREPLAN_CHROMIUM.\n"
      "Example: wireplan render wireplan-out/abdomen/report.json -o pictures");
  render->callback([&code, arguments] {
    code = render_pictures(arguments->report, arguments->output, arguments->pdf);
  });
}

void add_bench(CLI::App& app, int& code) {
  struct Arguments {
    std::string name;
    std::string output = "wireplan-out/bench";
    std::vector<std::string> of = {};  // what stands behind the name
    BenchOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* bench = app.add_subcommand(
      "bench",
      "Error against run time, stability, throughput, segmentation, measured wires, truth, "
      "searches for scripts");
  bench
      ->add_option("NAME", arguments->name,
                   "accuracy, stability, throughput, preprocess, segmentation, measured, truth or "
                   "scripts")
      ->required();
  bench->add_option("N|FOLDER|CASE|ROWS", arguments->of,
                    "Segmentation: how many patients [100]; measured: folder of the frames "
                    "[guide3d]; truth: cases [all]; scripts: cases; throughput: some of vessel, "
                    "s-tube, paper, moving and "
                    "coaxial [all]");
  bench->add_option("--trials", arguments->options.trials, "Truth: trials of each case [12]")
      ->check(CLI::Range(1, 100'000));
  bench->add_option("-o,--output", arguments->output, "Folder for results [wireplan-out/bench]");
  bench->add_flag("--quick", arguments->options.quick, "A small size, under 20 s");
  bench->add_option("--seed", arguments->options.first_seed, "Segmentation: of the first [1]")
      ->check(CLI::Range(0, 2147483647));
  bench->add_option("--data", arguments->options.data,
                    "Segmentation: folder of real cases with labels [WIREPLAN_DATA]");
  bench->add_option("--case", arguments->options.case_path,
                    "Throughput: the case whose vessel to take");
  bench
      ->add_option("--set", arguments->options.overrides,
                   "Throughput, scripts: key=value of the case")
      ->allow_extra_args(false);
  bench->add_option("--cache", arguments->options.cache,
                    "Throughput, truth, scripts: store of the case's stages");
  bench->footer(
      "Writes NAME.json, NAME.csv and the plot NAME.png, and prints the table.\n"
      "  accuracy   each method's error and time on scenes whose answer is known\n"
      "  stability  stiff and extreme scenes: which method converges, stops or fails\n"
      "  throughput insertions per second and core, rigid and yielding, with their error; rows of\n"
      "             the vessel, the S-tube, the paper's scenes and of coaxial tools\n"
      "  segmentation  patients drawn at random (see phantom --random) and real ones with labels,\n"
      "             each from two points: overlap, surface, way, leaks, refusals\n"
      "  measured   real wires in a phantom, measured by X-ray: one push at eight rolls, and from\n"
      "             an earlier frame's shape on to the next; a picture of each frame\n"
      "  truth      stated errors of trials of cases against the run with elements of a quarter,\n"
      "             and how far tips end apart where settings change that should not matter\n"
      "  scripts    the first plan of cases with catheters against that of a search that brings\n"
      "             the wire out of every hook, and both times\n"
      "Example: wireplan bench accuracy -o out");
  bench->callback([&code, arguments] {
    if (arguments->name == "truth" || arguments->name == "scripts") {
      arguments->options.cases = arguments->of;
    } else if (arguments->name == "throughput") {
      arguments->options.rows = arguments->of;
    } else if (arguments->name == "measured" && !arguments->of.empty()) {
      if (arguments->of.size() > 1) {
        throw Error("bench: measured is given '" + arguments->of[0] + "' and '" + arguments->of[1] +
                    "', expected one folder");
      }
      arguments->options.measured = arguments->of.front();
    } else if (!arguments->of.empty()) {
      arguments->options.patients = patient_count(arguments->of);
    }
    require_folder(arguments->output, kResults);
    run_bench(arguments->name, arguments->output, arguments->options);
    code = kDone;
  });
}

}  // namespace wireplan::pipeline
