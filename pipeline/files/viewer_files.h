#pragma once
/// Files for the tools that people use: markups for 3D Slicer, tables for spreadsheets.
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "plan/catheters.h"
#include "simulate/insertion/trial.h"

namespace wireplan::pipeline {

/// A line as one curve for 3D Slicer (.mrk.json, references G), mm LPS.
void write_curve_markups(const Eigen::Matrix3Xd& points, const std::string& name,
                         const std::filesystem::path& path);

/// Several curves in one such file.
struct NamedCurve {
  std::string name;
  Eigen::Matrix3Xd points;  // [mm]
};
void write_curve_markups(const std::vector<NamedCurve>& curves, const std::filesystem::path& path);

/// A plan for 3D Slicer, which makes three nodes of the one file: the wire in its final shape as a
/// curve; the way of the introducer as a line of 40 mm that ends in the access point; access and
/// target as points.
struct PlanMarkups {
  std::string name;                //
  Eigen::Matrix3Xd nodes;          // of the wire                                          [mm]
  Vec3 access = Vec3::Zero();      //                                                      [mm]
  Vec3 direction = Vec3::UnitZ();  // of the introducer, into the vessel
  Vec3 target = Vec3::Zero();      //                                                      [mm]
};
void write_plan_markups(const PlanMarkups& plan, const std::filesystem::path& path);

/// A script of several tools for 3D Slicer: of each tool FOLDER/NAME-TOOL-steps.mrk.json, with a
/// curve for each step that was made, the tool where the step ended, by the step's text. `tools`
/// are the names for the files, from the outside in.
void write_step_markups(const simulate::TrialResult& trial, const std::vector<plan::ToldStep>& told,
                        const std::string& name, const std::vector<std::string>& tools,
                        const std::filesystem::path& folder);

/// A field of a table (RFC 4180): text in quotes, quotes in it doubled; null is empty.
std::string csv_field(const Json& value);

/// The report's trials as a table (RFC 4180): a row per trial, its rank where it has one, units in
/// the header; what has no value is an empty field.
std::string trials_csv(const Json& report);

}  // namespace wireplan::pipeline
