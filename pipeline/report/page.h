#pragma once
/// report.html: the report as one file for any browser, without network. The template (scripts,
/// styles, libraries) is made of page/ when wireplan is built; here it is filled with the report
/// and with what only the page shows: shapes, histories, forces on the wall, slices of the volume.
/// Outside the one block of timing the page is the same, byte for byte, for the same inputs and
/// build.
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "preprocess/vessel.h"
#include "simulate/insertion/trial.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::pipeline {

/// What the page shows of every trial. Points and forces stand in it with single precision or less.
struct PageTrial {
  Vec3 direction = Vec3::UnitZ();    // of the introducer, into the vessel
  Eigen::Matrix3Xf nodes;            // final shape                                         [mm]
  Eigen::Matrix<float, 5, -1> push;  // insertion [mm]; push, tip, largest contact and total contact
                                     // force [N], after each push
  /// Of a script of catheter and wire, after each push: the step under way; then of each tool how
  /// far it is in [mm], the hand's force and the tip's [N]. No rows of one wire.
  Eigen::Matrix<float, 7, -1> tools = {};
  std::vector<std::size_t> exchanges = {};  // pushes from which on it is another wire
  Eigen::Matrix3Xf sections = {};  // how far the vessel's have moved; empty where they do not [mm]
};
PageTrial page_trial(const simulate::TrialResult& trial);  // all but the direction

/// The insertion of one trial, to be played.
struct PageInsertion {
  int trial = 0;
  std::vector<simulate::Shape> shapes;
  std::vector<simulate::TriangleForce> peak_forces;
};

struct PageInput {
  Surface surface;
  std::vector<double> peak_force;  // of any trial, per triangle                               [N]
  Centerline path;
  Vec3 access = Vec3::Zero(), target = Vec3::Zero();  //                                      [mm]
  double target_radius = 0.0;                         //                                      [mm]
  std::vector<double> wire_radius;  // in the order of the report's wires                     [mm]
  std::vector<PageTrial> trials;    // in the order of the report's trials
  std::vector<PageInsertion> insertions;
  /// How the vessel's points follow its cross-sections; null where these do not move.
  std::shared_ptr<const simulate::SectionChain> chain = nullptr;
  Json panels = Json::object();  // by name what a panel shows beyond the report, as it reads it
  std::string picture_png;       // the vessel, for browsers without 3D
};

/// What stands in page_template.cpp, or in no_page.cpp in its place: the template, with marks where
/// the report goes, and why this program cannot make pages; empty where it can.
std::string page_template();
std::string page_missing();

/// SHA-256 of the template, for keys: another template makes another page.
std::string page_template_sha256();

/// The page of a report (report.h). Expects page_missing() to be empty.
std::string build_page(const Json& report, const PageInput& input);

/// A page that build_page() made of one report, with another one in its place.
std::string with_report(std::string page, const Json& before, const Json& report);

/// The page of an overview (overview.h): no vessel and no trials, but links to the sections' pages.
std::string build_overview_page(const Json& overview);

/// A JSON text that can stand inside a script element of HTML: <, >, & and all that is not ASCII
/// escaped, so that no name ends the element or the script.
std::string embed_json(const Json& value);

/// Bytes as base64 (RFC 4648, with padding).
std::string base64(const void* bytes, std::size_t count);

}  // namespace wireplan::pipeline
