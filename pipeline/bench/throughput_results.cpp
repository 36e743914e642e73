#include "pipeline/bench/throughput_results.h"

#include <algorithm>
#include <cmath>

#include "pipeline/files/text.h"
#include "pipeline/report/plot.h"

namespace wireplan::pipeline {
namespace {

/// Rows that the condition holds for.
template <typename Condition>
std::vector<Json> select(const std::vector<Json>& rows, const Condition& condition) {
  std::vector<Json> selected;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(selected), condition);
  return selected;
}

/// Of the rows that have it; null where none has.
Json largest(const std::vector<Json>& rows, const char* key) {
  Json found;
  for (const Json& row : rows) {
    if (row.at(key).is_null()) continue;
    if (found.is_null() || row.at(key) > found) found = row.at(key);
  }
  return found;
}

Json smallest(const std::vector<Json>& rows, const char* key) {
  Json found;
  for (const Json& row : rows) {
    if (row.at(key).is_null()) continue;
    if (found.is_null() || row.at(key) < found) found = row.at(key);
  }
  return found;
}

bool is_paper_scene(const Json& row) {
  return row.at("surface") == kPaperTube || row.at("surface") == kPaperArtery;
}

std::string text_of(const Care& care) {
  return format("%g N, points %g mm apart", care.residual_tolerance, care.contact_spacing);
}

}  // namespace

std::vector<Json> list_throughput_aims(const ThroughputResults& results) {
  const std::vector<Json>& rows = results.rows;
  std::vector<Json> aims;
  const auto add = [&](const std::string& what, const std::string& aim, const Json& found) {
    aims.push_back(aim_row(what, aim, found));
  };
  const auto in_vessel = [](const Json& row) {
    return row.at("surface") != kSTube && !is_paper_scene(row);
  };
  const std::vector<Json> vessel_rows = select(rows, in_vessel);
  for (const std::string wall : {"rigid", "elastic"}) {
    for (const std::string wire : {"straight", "curved"}) {
      const std::vector<Json> batch = select(vessel_rows, [&](const Json& row) {
        return row.at("wall") == wall && row.at("wire") == wire && row.at("threads") == 1 &&
               row.at("element_length_mm") == 1.0 && !row.at("model_build_ms").is_null();
      });
      const double aim = (wall == "rigid" ? 25.0 : 12.0) * (wire == "curved" ? 2.0 / 3.0 : 1.0);
      add("insertions per second and core, h = 1 mm, " + wall + ", " + wire,
          format("at least %.3g", aim), smallest(batch, "insertions_per_second_per_core"));
    }
  }
  add("two threads against one, least of all rows", "at least 1.9",
      smallest(vessel_rows, "speedup"));
  add("Newton iterations per push, worst row", "at most 5",
      largest(vessel_rows, "iterations_per_push"));
  add("Newton iterations of the worst push", "at most 50",
      largest(vessel_rows, "max_iterations_per_push"));
  add("insertions that did not converge or failed, most of a row", "0",
      largest(rows, "not_converged"));
  for (const Care& care : kCares) {
    for (const bool fine_tip : {false, true}) {
      const std::vector<Json> tube = select(rows, [&](const Json& row) {
        return row.at("surface") == kSTube &&
               row.at("residual_tolerance_n") == care.residual_tolerance &&
               (row.at("element_length_mm") != row.at("tip_element_length_mm")) == fine_tip;
      });
      add((fine_tip ? "S-tube (b), " : "S-tube (a), ") + text_of(care) + ", worst row, CPU ms",
          fine_tip ? "below 20" : "below 60", largest(tube, "cpu_ms_per_insertion"));
    }
  }
  add("S-tube, tips of pushes of different lengths apart, mm", "at most 0.5",
      largest(results.s_tube, "tips_apart_mm"));
  add("the paper's Fig. 5 and 6, CPU us per push, worst row", "below 1000",
      largest(select(rows, is_paper_scene), "cpu_us_per_push"));
  return aims;
}

Picture plot_throughput(const std::vector<Json>& rows, const std::vector<Json>& moving,
                        const std::vector<Json>& coaxial, const std::string& surface) {
  const std::vector<LegendEntry> legend = {
      {"rigid, straight", Color(0.05F, 0.10F, 0.65F)},
      {"rigid, curved", Color(0.00F, 0.60F, 0.55F)},
      {"elastic, straight", Color(0.75F, 0.10F, 0.55F)},
      {"elastic, curved", Color(0.85F, 0.45F, 0.00F)},
      {"10.9 mm, 0.7 mm at the tip", Color(0.45F, 0.45F, 0.45F)}};
  constexpr double kLeastError = 1e-6;  // [mm] shown
  const char* kTime = "time of one insertion on one core [ms]";
  const char* kError = "tip's distance from that of the finest elements [mm]";
  FrontPlot vessel{surface + ", over the element length", kTime, kError, {}};
  FrontPlot tube{"S-tube, over the length of a push and how well it is solved", kTime, kError, {}};
  FrontPlot paper{"the paper's scenes", kTime, kError, {}};
  FrontPlot manoeuvres{"a catheter over a wire",
                       "time of one manoeuvre on one core [ms]",
                       "energy out of balance [N mm]",
                       {}};
  FrontPlot shifts{
      "a vessel that moves as a whole", kTime, "largest shift of a cross-section [mm]", {}};
  for (std::size_t k = 0; k < legend.size(); ++k) {
    for (FrontPlot* plot : {&vessel, &tube, &paper, &shifts, &manoeuvres}) {
      plot->lines.push_back({k, {}});
    }
  }
  for (const Json& row : moving) {
    shifts.lines[2].points.emplace_back(row.at("cpu_ms_moving").get<double>(),
                                        std::max(kLeastError, row.at("moved_mm").get<double>()));
  }
  for (const Json& row : rows) {
    if (row.at("threads") != 1 || row.at("position_error_mm").is_null()) continue;
    const bool curved = row.at("wire") == "curved", elastic = row.at("wall") == "elastic";
    const bool fine_tip = row.at("tip_element_length_mm") != row.at("element_length_mm");
    const std::size_t line = fine_tip ? 4U : (elastic ? 2U : 0U) + (curved ? 1U : 0U);
    const Eigen::Vector2d point(row.at("cpu_ms_per_insertion").get<double>(),
                                std::max(kLeastError, row.at("position_error_mm").get<double>()));
    FrontPlot& plot = row.at("surface") == surface ? vessel : is_paper_scene(row) ? paper : tube;
    plot.lines[line].points.push_back(point);
  }
  for (const Json& row : coaxial) {
    const double per_second = row.at("manoeuvres_per_second_per_core").get<double>();
    const double off = std::abs(row.at("unbalanced_n_mm").get<double>());
    manoeuvres.lines[row.at("wall") == "elastic" ? 3U : 1U].points.emplace_back(
        1e3 / per_second, std::max(kLeastError, off));
  }
  std::vector<FrontPlot> plots;
  for (const FrontPlot& plot : {vessel, tube, paper, shifts, manoeuvres}) {
    const bool has_points = std::any_of(plot.lines.begin(), plot.lines.end(),
                                        [](const auto& line) { return !line.points.empty(); });
    if (has_points) plots.push_back(plot);
  }
  return draw_fronts("Error against run time", plots, 2, legend);
}

Json describe_throughput(const std::string& surface, double length, double finest) {
  const std::string finest_text = format("%g mm", finest);
  return {
      {"surfaces",
       {{surface, format("%g mm of wire pushed in along the start of the path; no goal", length)},
        {kSTube,
         "lumen radius 5 mm, two bends of 90 degrees and radius 60 mm out of one plane, 300 mm of "
         "a wire of 0.889 mm; 240 elements over 450 mm, or 10.9 mm and 0.7 mm in the last 15 mm; "
         "solved as cases are by default and as well as forces in a smooth tube need"},
        {kPaperTube,
         "as the paper's Fig. 5: 1160 triangles, 20 elements with k_b 1e5 N/m and k_s 1e12 N/m^3; "
         "the paper does not tell its measures: radius 3 mm, 65 mm long, a bend of 90 degrees "
         "and radius 30 mm; elements of 2 mm as in its Fig. 4, a wall of 1 MPa and 1 mm, no "
         "friction"},
        {kPaperArtery,
         "as the paper's Fig. 6, with --case only: the vessel of the case, decimated to 5472 "
         "triangles or as near as can be; 200 mm of wire, no friction"}}},
      {"coaxial",
       "a wire of 0.889 mm pushed by pushed_mm into a tube of 6 mm radius with the bends of the "
       "S-tube, then a Cobra C2 over it, to 1e-6 N; friction 0.1 to the wall and 0.05 between "
       "them; "
       "CPU time of one run, the vessel's model not counted"},
      {"real_time",
       "a time step of the paper is 1 ms and one iteration toward equilibrium; here a push of 1 mm "
       "is taken to equilibrium, and is faster than real time if that takes below 1 ms, in which "
       "the hand would have to move at 1 m/s"},
      {"wires",
       {{"straight", "0.889 mm, EI as the row says, null for all of them together"},
        {"curved",
         "0.889 mm, tip of 15 mm with rest radius 12 mm and EI 5, 30 mm with EI 50, then 521, at "
         "every roll of the hub"}}},
      {"walls",
       {{"rigid", "does not yield"}, {"elastic", "k_n 25 kPa/mm where no case says else"}}},
      {"time",
       "one thread: CPU time of the thread, median over repeats, wall responses already found; two "
       "threads: that, times the ratio of the times of a whole batch by the clock"},
      {"columns",
       {{"position_error_mm",
         "distance of the tip from that of the same insertion with elements of " + finest_text +
             ", contact points no further apart than 1 mm, and pushes of 1 mm, where as much wire "
             "is "
             "in; the worst of the insertions"},
        {"peak_contact_force_error_n",
         "how far the largest force at a contact is from that of the finer insertion"},
        {"contact_spacing_mm",
         "most between two points of the wire that feel the wall; half of it in the last 20 mm"},
        {"inserted_mm", "mean of the insertions; below what was asked where they ended early"},
        {"residual_n", "largest of all pushes"},
        {"max_penetration_mm", "largest of all pushes"},
        {"not_converged", "insertions that ended so, or failed; reason: of the first of them"},
        {"cut_pushes", "shorter than push_mm, the last of an insertion included"},
        {"model_build_ms", "distance field, and factors of a wall that yields"},
        {"warm_up_ms",
         "that the first insertions of the row took longer, for responses of the wall "
         "that no row above had found"}}}};
}

std::string line_of(const Json& row) {
  const auto text = [&](const char* key) { return row.at(key).get<std::string>(); };
  const auto number = [&](const char* key) { return row.at(key).get<double>(); };
  if (row.contains("manoeuvres_per_second_per_core")) {
    return format("coaxial, %s, h %g mm: %.3g 1/s/core, %s\n", text("wall").c_str(),
                  number("element_length_mm"), number("manoeuvres_per_second_per_core"),
                  text("outcome").c_str());
  }
  const Json& EI = row.at("bending_stiffness_n_mm2");
  return format("%s, %s, %s%s, h %g mm, pushes of %g mm, %d threads: %.4g 1/s/core, %s\n",
                text("surface").c_str(), text("wall").c_str(), text("wire").c_str(),
                EI.is_null() ? "" : format(" of EI %g", EI.get<double>()).c_str(),
                number("element_length_mm"), number("push_mm"), row.at("threads").get<int>(),
                number("insertions_per_second_per_core"), text("outcomes").c_str());
}

std::vector<Json> shorten_throughput(const std::vector<Json>& rows) {
  const std::vector<std::pair<const char*, const char*>> columns = {
      {"surface", "surface"},
      {"wall", "wall"},
      {"wire", "wire"},
      {"bending_stiffness_n_mm2", "EI"},
      {"element_length_mm", "h mm"},
      {"contact_spacing_mm", "points mm"},
      {"push_mm", "push mm"},
      {"threads", "threads"},
      {"insertions_per_second_per_core", "1/s/core"},
      {"speedup", "speedup"},
      {"inserted_mm", "in mm"},
      {"residual_n", "residual N"},
      {"max_penetration_mm", "penetration mm"},
      {"position_error_mm", "error mm"},
      {"peak_contact_force_error_n", "force error N"},
      {"iterations_per_push", "it./push"},
      {"max_iterations_per_push", "worst"},
      {"outcomes", "outcomes"}};
  std::vector<Json> table;
  for (const Json& row : rows) {
    Json& line = table.emplace_back();
    for (const auto& [key, title] : columns) line[title] = row.at(key);
  }
  return table;
}

}  // namespace wireplan::pipeline
