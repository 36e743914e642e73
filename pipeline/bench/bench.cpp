#include "pipeline/bench/bench.h"

#include <iostream>
#include <sstream>

#include "pipeline/bench/bench_report.h"
#include "pipeline/files/disk.h"
#include "pipeline/files/text.h"
#include "pipeline/report/report.h"
#include "preprocess/files/vessel_io.h"

namespace wireplan::pipeline {
namespace {

/// A value as it stands in the CSV: numbers with the digits of the JSON, null as nothing.
std::string csv_value(const Json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return value.dump();
  const auto text = value.get<std::string>();
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

void write_csv(const std::vector<Json>& rows, const std::filesystem::path& path) {
  std::ostringstream file;
  const auto write_line = [&file](const Json& row, const auto& text_of) {
    const char* separator = "";
    for (const auto& [key, value] : row.items()) {
      file << separator << text_of(key, value);
      separator = ",";
    }
    file << "\n";
  };
  write_line(rows.front(), [](const std::string& key, const Json&) { return key; });
  for (const Json& row : rows) {
    write_line(row, [](const std::string&, const Json& value) { return csv_value(value); });
  }
  write_whole(file.str(), path);
}

std::string cell_text(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return format("%.4g", value.get<double>());
  return value.dump();
}

}  // namespace

std::string table_text(const std::vector<Json>& rows) {
  if (rows.empty()) return "";
  std::vector<std::vector<std::string>> lines(1);
  for (const auto& [key, value] : rows.front().items()) lines.front().push_back(key);
  for (const Json& row : rows) {
    lines.emplace_back();
    for (const auto& [key, value] : row.items()) lines.back().push_back(cell_text(value));
  }
  return format_table(lines);
}

Json aim_row(const std::string& what, const std::string& aim, const Json& found) {
  Json row;
  row["what"] = what;
  row["aim"] = aim;
  row["found"] = found;
  return row;
}

Json aim_entry(const char* what, double aim, bool at_least, const Json& found) {
  const bool met =
      !found.is_null() && (at_least ? found.get<double>() >= aim : found.get<double>() <= aim);
  return {{"what", what},
          {"aim", aim},
          {"at_least", at_least},
          {"found", found},
          {"met", found.is_null() ? Json(nullptr) : Json(met)}};
}

std::string aims_text(const Json& aims) {
  std::string text;
  for (const Json& one : aims) {
    const Json& found = one.at("found");
    text += (found.is_null()             ? std::string("unknown  ")
             : one.at("met").get<bool>() ? std::string("met      ")
                                         : std::string("NOT MET  ")) +
            one.at("what").get<std::string>() + ": " +
            (found.is_null() ? std::string("-") : format("%.4g", found.get<double>())) +
            (one.at("at_least").get<bool>() ? ", aim at least " : ", aim at most ") +
            format("%g\n", one.at("aim").get<double>());
  }
  return text;
}

void run_bench(const std::string& name, const std::filesystem::path& folder,
               const BenchOptions& options) {
  const auto make_report = name == "accuracy"       ? bench_accuracy
                           : name == "stability"    ? bench_stability
                           : name == "throughput"   ? bench_throughput
                           : name == "preprocess"   ? bench_preprocess
                           : name == "segmentation" ? bench_segmentation
                           : name == "measured"     ? bench_measured
                           : name == "truth"        ? bench_truth
                           : name == "scripts"      ? bench_scripts
                                                    : nullptr;
  if (make_report == nullptr) {
    throw Error("bench: NAME is '" + name +
                "', expected accuracy, stability, throughput, preprocess, segmentation, measured, "
                "truth or scripts");
  }
  if (make_report != bench_throughput && !options.case_path.empty()) {
    throw Error("bench: --case is '" + options.case_path +
                "', expected none: only throughput takes a case");
  }
  if (make_report != bench_throughput && !options.rows.empty()) {
    throw Error("bench: " + name + " is given rows, '" + options.rows.front() +
                "', expected none: only throughput takes them");
  }
  if (make_report != bench_segmentation && (options.patients > 0 || !options.data.empty())) {
    throw Error("bench: " + name +
                " is given patients or --data, expected none: only segmentation takes them");
  }
  if (make_report != bench_measured && !options.measured.empty()) {
    throw Error("bench: " + name + " is given the folder '" + options.measured.string() +
                "', expected none: only measured takes one");
  }
  if (make_report != bench_truth && options.trials > 0) {
    throw Error("bench: " + name + " is given --trials, expected none: only truth takes them");
  }
  if (make_report != bench_truth && make_report != bench_scripts && !options.cases.empty()) {
    throw Error("bench: " + name + " is given the case '" + options.cases.front() +
                "', expected none: only truth and scripts take cases");
  }
  const bool of_case =
      make_report == bench_throughput ? !options.case_path.empty() : make_report == bench_scripts;
  if (!of_case && !options.overrides.empty()) {
    throw Error("bench: " + name + " is given --set '" + options.overrides.front() +
                "', expected none: only scripts, and throughput with --case, change a case");
  }
  std::filesystem::create_directories(folder);
  const BenchReport report = make_report(options);
  if (report.rows.empty()) {
    std::cout << report.text;
    return;
  }

  Json file;
  file["schema"] = kBenchSchema;
  file["name"] = name;
  file["size"] = options.quick ? "quick" : "full";
  file["program"] = build_info();
  file["description"] = report.description;
  file["results"] = report.results;
  file["rows"] = report.rows;
  write_json(file, folder / (name + ".json"));
  write_csv(report.rows, folder / (name + ".csv"));
  write_png(report.plot, folder / (name + ".png"));
  for (const BenchSurface& vessel : report.surfaces) {
    preprocess::write_surface(vessel.surface, folder / (vessel.name + ".vtp"));
  }
  for (const BenchPicture& one : report.pictures) {
    write_png(one.picture, folder / (one.name + ".png"));
  }
  std::cout << report.text << "\n"
            << "files: " << (folder / name).string() << ".json, .csv, .png\n";
}

}  // namespace wireplan::pipeline
