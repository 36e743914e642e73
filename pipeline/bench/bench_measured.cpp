// `wireplan bench measured [FOLDER]`: real wires in a phantom, whose shapes were measured by two
// X-ray pictures each, against the same wires simulated with one set of parameters.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/measured_frames.h"
#include "pipeline/files/case_file.h"
#include "pipeline/files/text.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/plot.h"
#include "plan/batch.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr int kRolls = 8;
constexpr double kLastLength = 50.0;  // of wire that is pushed in alone                    [mm]
constexpr double kPulls[] = {0.0, 20.0, 40.0, 60.0};  // behind the shallower of two depths [mm]
constexpr double kLeastInside = 20.0;  // a pull leaves so much in the vessel                [mm]
constexpr std::size_t kQuickFrames = 3;

/// One insertion that is held against one frame.
struct MeasuredTrial {
  const char* test = "";                   // see describe_measured()
  const MeasuredFrame* frame = nullptr;    // held against
  const MeasuredFrame* earlier = nullptr;  // whose shape the wire starts from; null: pushed in
  MeasuredFrame entry = {};                // where it is pushed in, and how far
  double roll = 0.0;                       // of the hub, or turned by it                  [rad]
  double pull = 0.0;                       // back before it turns and goes on              [mm]
  simulate::TrialResult result = {};
  Eigen::Matrix3Xd nodes = {};  // from the entry on
  MeasuredError error = {};
  std::optional<simulate::LineDistance> start = {};  // of the equilibrium from its line
  bool best = false;                                 // of those of the same test and frame
};

/// The folder of the data, and whether it was asked for by name.
fs::path measured_folder(const fs::path& given) {
  if (!given.empty()) return given;
  return resolve_path("${WIREPLAN_DATA}", {}).parent_path() / "guide3d";
}

/// The end of a frame's wire, as if it came in there.
MeasuredFrame last_of(const MeasuredFrame& frame) {
  constexpr double kSpan = 4.0;  // to both sides: soft wire there is bent                  [mm]
  MeasuredFrame last = frame;
  const double at = std::max(0.0, frame.length - kLastLength);
  last.entry.point = simulate::point_at_arc(frame.line, at);
  last.entry.direction = (simulate::point_at_arc(frame.line, at + kSpan) -
                          simulate::point_at_arc(frame.line, std::max(0.0, at - kSpan)))
                             .normalized();
  last.line = simulate::line_from_entry(frame.line, last.entry.point);
  last.length = simulate::arc_length(last.line);
  return last;
}

std::vector<MeasuredTrial> list_trials(const MeasuredWires& wires, std::size_t most) {
  std::vector<MeasuredTrial> trials;
  const std::size_t count = std::min(most, wires.frames.size());
  for (std::size_t k = 0; k < count; ++k) {
    const MeasuredFrame& frame = wires.frames[k];
    const MeasuredFrame last = last_of(frame);
    for (int roll = 0; roll < kRolls; ++roll) {
      const double angle = 2.0 * kPi * roll / kRolls;
      trials.push_back({.test = "push", .frame = &frame, .entry = frame, .roll = angle});
      trials.push_back({.test = "last", .frame = &frame, .entry = last, .roll = angle});
    }
    trials.push_back({.test = "start", .frame = &frame, .earlier = &frame, .entry = frame});
    if (k == 0 || wires.frames[k - 1].recording != frame.recording) continue;
    const MeasuredFrame& before = wires.frames[k - 1];
    trials.push_back({.test = "on", .frame = &frame, .earlier = &before, .entry = before});
    const double shallower = std::min(before.length, frame.length);
    for (const double pull : kPulls) {
      if (shallower - pull < kLeastInside) continue;
      for (int turn = 0; turn < kRolls; ++turn) {
        trials.push_back({.test = "steered",
                          .frame = &frame,
                          .earlier = &before,
                          .entry = before,
                          .roll = std::remainder(2.0 * kPi * turn / kRolls, 2.0 * kPi),
                          .pull = pull});
      }
    }
  }
  return trials;
}

/// Pushed in, and turned on the way as it is steered by hand, but for the last 50 mm alone. From an
/// earlier frame's shape: back to the shallower of both depths and by `pull` more, turned, and on
/// to the frame's depth.
std::vector<simulate::Move> moves_of(const MeasuredTrial& trial,
                                     const MeasuredParameters& parameters) {
  std::vector<simulate::Move> moves;
  if (trial.earlier == nullptr) {
    double left = trial.entry.length;
    const bool turns = std::string(trial.test) == "push";
    for (; turns && left > parameters.turn_after; left -= parameters.turn_after) {
      moves.push_back({.push = parameters.turn_after});
      moves.push_back({.turn = parameters.turn});
    }
    moves.push_back({.push = left});
    return moves;
  }
  const double to = trial.frame->length;
  const double from = trial.earlier->length, least = std::min(from, to) - trial.pull;
  if (least < from - 1e-9) moves.push_back({.push = least - from});
  if (trial.roll != 0.0) moves.push_back({.turn = trial.roll});
  if (to > least + 1e-9) moves.push_back({.push = to - least});
  return moves;
}

void run_measured(const MeasuredParameters& parameters, const simulate::VesselModel& vessel,
                  const std::vector<preprocess::Branch>& tree, MeasuredTrial& trial) {
  const simulate::Goal nowhere{.point = Vec3(0.0, 0.0, -1e6), .radius = 1.0};
  simulate::InsertionOptions options{
      .friction = parameters.friction, .map_forces = false, .push_on = true};
  options.length = std::max(trial.entry.length, trial.frame->length);
  simulate::Introducer introducer = trial.entry.entry;
  if (trial.earlier == nullptr) introducer.roll = trial.roll;
  const std::vector<simulate::Move> moves = moves_of(trial, parameters);
  trial.result = plan::run_guarded([&] {
    simulate::Trial run(make_wire(parameters, trial.frame->angled), introducer, nowhere, vessel,
                        options);
    if (trial.earlier != nullptr) {
      run.start({.nodes = trial.entry.line, .length = trial.entry.length, .find_roll = true});
    }
    for (const simulate::Move& move : moves) run.make(move);
    return run.finish();
  });
  const auto from_entry = [&](const Eigen::Matrix3Xd& nodes) {
    Eigen::Matrix3Xd all(3, nodes.cols() + 1);
    all << introducer.point, nodes;
    return all;
  };
  trial.nodes = from_entry(trial.result.nodes);
  trial.error = find_error(trial.nodes,
                           trial.earlier == nullptr ? trial.entry.line : trial.frame->line, tree);
  if (trial.result.start) {
    trial.start = simulate::find_distance(from_entry(trial.result.start->nodes), trial.entry.line);
  }
}

/// Marks the least mean of each test and frame, which follow one another or not.
void mark_best(std::vector<MeasuredTrial>& trials) {
  for (MeasuredTrial& trial : trials) {
    trial.best = std::none_of(trials.begin(), trials.end(), [&](const MeasuredTrial& other) {
      const bool rival =
          &other != &trial && other.frame == trial.frame && std::string(other.test) == trial.test;
      return rival && (other.error.mean < trial.error.mean ||
                       (other.error.mean == trial.error.mean && &other < &trial));
    });
  }
}

Json row_of(const MeasuredTrial& trial) {
  const MeasuredFrame& frame = *trial.frame;
  const bool ended = trial.result.outcome == simulate::Outcome::kMissed;
  return {{"test", trial.test},
          {"frame", frame.name()},
          {"from", trial.earlier != nullptr ? Json(trial.earlier->name()) : Json(nullptr)},
          {"wire", frame.angled ? "angled" : "straight"},
          {"roll_deg", trial.roll / kRadPerDeg},
          {"pull_mm", trial.pull},
          {"best", trial.best},
          {"outcome", ended ? "done" : simulate::outcome_name(trial.result.outcome)},
          {"mean_mm", trial.error.mean},
          {"largest_mm", trial.error.largest},
          {"tip_mm", trial.error.tip},
          {"branch_right", trial.error.branch_right},
          {"sigma_mm", frame.sigma.mean()},
          {"sigma_tip_mm", frame.sigma[frame.sigma.size() - 1]},
          {"start_mean_mm", trial.start ? Json(trial.start->mean) : Json(nullptr)},
          {"start_tip_mm", trial.start ? Json(trial.start->tip) : Json(nullptr)}};
}

/// What the trials of a test come to: of the best of each frame, or of all.
Json summary_of(const std::vector<MeasuredTrial>& trials, const std::string& test, bool best) {
  constexpr double kTipAim = 5.0, kMeanAim = 2.0;  // [mm]
  double count = 0.0, mean = 0.0, largest = 0.0, tip = 0.0, right = 0.0, tips = 0.0, both = 0.0;
  for (const MeasuredTrial& trial : trials) {
    if (trial.test != test || (best && !trial.best)) continue;
    count += 1.0;
    mean += trial.error.mean;
    largest += trial.error.largest;
    tip += trial.error.tip;
    right += trial.error.branch_right ? 1.0 : 0.0;
    tips += trial.error.tip <= kTipAim ? 1.0 : 0.0;
    both += trial.error.tip <= kTipAim && trial.error.mean <= kMeanAim ? 1.0 : 0.0;
  }
  const auto share = [&](double sum) { return count > 0.0 ? Json(sum / count) : Json(nullptr); };
  return {{"test", test},
          {"of", best ? "best" : "all"},
          {"trials", count},
          {"mean_mm", share(mean)},
          {"largest_mm", share(largest)},
          {"tip_mm", share(tip)},
          {"branch_right_share", share(right)},
          {"tip_within_5_mm_share", share(tips)},
          {"tip_within_5_and_mean_within_2_mm_share", share(both)}};
}

/// Of a straight push with one roll for all frames, the best one.
Json one_roll(const std::vector<MeasuredTrial>& trials) {
  Json best;
  for (int roll = 0; roll < kRolls; ++roll) {
    double sum = 0.0;
    int count = 0;
    for (const MeasuredTrial& trial : trials) {
      if (std::string(trial.test) != "push" || trial.roll != 2.0 * kPi * roll / kRolls) continue;
      sum += trial.error.mean;
      ++count;
    }
    if (count == 0 || (!best.is_null() && best.at("mean_mm") <= sum / count)) continue;
    best = {{"roll_deg", 360.0 * roll / kRolls}, {"mean_mm", sum / count}};
  }
  return best;
}

Json aims_of(const std::vector<MeasuredTrial>& trials) {
  const Json push = summary_of(trials, "push", true), last = summary_of(trials, "last", true),
             on = summary_of(trials, "steered", true);
  return Json::array(
      {aim_entry("one push, best of eight rolls: mean distance, mm", 3.5, false,
                 push.at("mean_mm")),
       aim_entry("the same for the last 50 mm of wire alone, mm", 2.5, false, last.at("mean_mm")),
       aim_entry("one push, best of eight rolls: share of frames whose branch is right", 0.7, true,
                 push.at("branch_right_share")),
       aim_entry("from an earlier frame, best steering: mean distance, mm", 2.0, false,
                 on.at("mean_mm")),
       aim_entry("from an earlier frame, best steering: share of tips within 5 mm", 0.8, true,
                 on.at("tip_within_5_mm_share"))});
}

std::string measured_text(const Json& results, const std::vector<Json>& best_rows,
                          const Json& parameters) {
  std::string text = table_text(best_rows) + "\nparameters, the same for all:";
  for (const auto& [key, value] : parameters.items()) text += " " + key + " " + value.dump();
  text += "\n\n";
  std::vector<Json> summaries;
  for (const Json& one : results.at("summary")) summaries.push_back(one);
  text += table_text(summaries) + "\n";
  return text + aims_text(results.at("aims"));
}

/// The measured wire, the best push, and the best that started from an earlier frame.
Picture draw_frame(const Surface& phantom, const MeasuredFrame& frame,
                   const std::vector<MeasuredTrial>& trials) {
  std::vector<PictureWire> wires;
  wires.push_back({.name = format("measured, sigma %.2f mm", frame.sigma.mean()),
                   .nodes = frame.line,
                   .contact_force = {},
                   .color = kInk});
  for (const MeasuredTrial& trial : trials) {
    const std::string test = trial.test;
    if (trial.frame != &frame || !trial.best || (test != "push" && test != "steered")) continue;
    const std::string how = test == "push" ? format("push, roll %.0f deg", trial.roll / kRadPerDeg)
                                           : format("from frame %d", trial.earlier->frame);
    wires.push_back(
        {.name = how + format(": mean %.1f mm, tip %.1f mm", trial.error.mean, trial.error.tip),
         .nodes = trial.nodes,
         .contact_force = {},
         .color = wire_color(static_cast<int>(wires.size()) - 1)});
  }
  return draw_picture(phantom, wires, {.title = frame.name(), .access = frame.entry.point},
                      {.width = 1000, .height = 900});
}

Picture plot_of_errors(const std::vector<MeasuredTrial>& trials) {
  const std::vector<LegendEntry> legend = {
      {"one push, best of eight rolls", {0.12F, 0.47F, 0.71F}},
      {"from the earlier frame, steered", {0.84F, 0.15F, 0.16F}}};
  FrontPlot plot{"Computed wires against measured ones",
                 "mean distance, mm",
                 "tip distance, mm",
                 {{.entry = 0, .points = {}}, {.entry = 1, .points = {}}}};
  for (const MeasuredTrial& trial : trials) {
    const bool push = std::string(trial.test) == "push";
    if (!trial.best || (!push && std::string(trial.test) != "steered")) continue;
    plot.lines[push ? 0 : 1].points.emplace_back(std::max(0.01, trial.error.mean),
                                                 std::max(0.01, trial.error.tip));
  }
  std::erase_if(plot.lines, [](const FrontLine& line) { return line.points.empty(); });
  return draw_fronts("wireplan bench measured", {plot}, 1, legend);
}

Json describe_measured() {
  return {
      {"test",
       "push: one push at eight rolls, turned by turn_deg after each turn_after_mm. last: the same "
       "for the last 50 mm of wire alone, not turned, which come in where the measured wire is "
       "there. start: from the frame's own shape, the nearest "
       "equilibrium, no move: what the wire's model is off by. on: from the shape of the earlier "
       "frame of the recording, pushed or pulled straight to this one's depth. steered: the same, "
       "pulled back by pull_mm more than the shallower depth, turned by roll_deg, and pushed on, "
       "eight turns and four pulls: what was done between two frames is not recorded"},
      {"best", "the least mean of the frame's trials of the test"},
      {"mean_mm",
       "of the distances from the measured points, from the entry on, to the computed wire; "
       "largest_mm of both to each other; tip_mm between the ends"},
      {"branch_right",
       "both ends are nearest to the same branch of the phantom's tree, in its radii, or within 5 "
       "mm of each other"},
      {"sigma_mm",
       "the reconstruction's own standard deviation, mean of the points; and its tip's"},
      {"start_mean_mm", "of the equilibrium that the wire started from to its line; start_tip_mm"}};
}

}  // namespace

BenchReport bench_measured(const BenchOptions& options) {
  const fs::path folder = measured_folder(options.measured);
  BenchReport report;
  std::error_code unreachable;
  if (!fs::exists(folder / "frames.json", unreachable)) {
    if (!options.measured.empty()) {
      throw Error("bench: FOLDER is '" + folder.string() +
                  "', expected a folder with frames.json and phantom.stl");
    }
    report.text = "skipped: no measured wires here, " + (folder / "frames.json").string() +
                  " does not exist; name their folder: wireplan bench measured FOLDER\n";
    return report;
  }
  const MeasuredParameters parameters;
  const MeasuredWires wires = read_measured_wires(folder, parameters);
  const simulate::VesselModel vessel(wires.phantom, simulate::follow(wires.phantom));
  const std::vector<preprocess::Branch> tree =
      preprocess::find_tree(wires.phantom, wires.frames.front().entry.point);
  const std::size_t most = options.quick ? kQuickFrames : wires.frames.size();
  std::vector<MeasuredTrial> trials = list_trials(wires, most);
  plan::for_each_slot(
      static_cast<int>(trials.size()),
      [&](int k) { run_measured(parameters, vessel, tree, trials[static_cast<std::size_t>(k)]); },
      {});
  mark_best(trials);

  std::vector<Json> best_rows;
  for (const MeasuredTrial& trial : trials) {
    report.rows.push_back(row_of(trial));
    if (!trial.best) continue;
    best_rows.push_back(report.rows.back());
    for (const char* wide : {"best", "from", "start_tip_mm"}) best_rows.back().erase(wide);
  }
  std::stable_sort(best_rows.begin(), best_rows.end(), [](const Json& a, const Json& b) {
    return a.at("test").get<std::string>() < b.at("test").get<std::string>();
  });
  report.results["summary"] = Json::array();
  for (const char* test : {"push", "last", "start", "on", "steered"}) {
    for (const bool best : {true, false}) {
      report.results["summary"].push_back(summary_of(trials, test, best));
    }
  }
  report.results["one_roll"] = one_roll(trials);
  report.results["aims"] = aims_of(trials);
  report.description["frames"] = {{"folder", folder.filename().string()},
                                  {"count", std::min(most, wires.frames.size())}};
  report.description["parameters"] = to_json(parameters);
  report.description["columns"] = describe_measured();
  report.text = measured_text(report.results, best_rows, report.description["parameters"]);
  report.plot = plot_of_errors(trials);
  for (std::size_t k = 0; k < std::min(most, wires.frames.size()); ++k) {
    report.pictures.push_back(
        {"measured_" + wires.frames[k].name(), draw_frame(wires.phantom, wires.frames[k], trials)});
  }
  return report;
}

}  // namespace wireplan::pipeline
