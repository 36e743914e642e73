#pragma once
/// case.json -> typed structs in internal units (design section 4). Every wrong key or value is
/// collected before one Error tells them all, each with file, key, value, expectation and remedy.
/// The keys, their ranges and defaults are also in schemas/case.schema.json, for editors.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/files/access_target_file.h"
#include "pipeline/files/case_wires.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/files/labels_file.h"
#include "plan/anatomy/access_limits.h"
#include "plan/make_plan.h"
#include "preprocess/segment/segment.h"
#include "preprocess/surface/surface.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {

/// An input has its path twice: resolved, for reading; and as the case file gives it, for reports,
/// which must not name folders of this machine.
struct VolumeInput {
  std::filesystem::path path;
  std::string given;
  std::string series;  // of a DICOM folder: number, description or key; empty: see read_image
};

struct SurfaceInput {
  std::filesystem::path path;
  std::string given;
  std::string unit;   // "mm", "cm", "m"
  std::string frame;  // "LPS", "RAS"
};

/// Where anatomy holds a vessel that moves as a whole (simulate::Pin).
struct HeldPlace {
  enum class At { kAccess, kOstia, kPoint };
  At at = At::kAccess;        // kOstia: every artery that leaves another, but for stumps, the two
                              // of a bifurcation and the vessel that goes on at a fork
  Vec3 point = Vec3::Zero();  // of kPoint                                                [mm]
  double radius = 10.0;       //                                                          [mm]
  double factor = 100.0;      // on the support
};

/// The vessel's wall. A rigid one has the other values too: the wall's files are made of them.
struct WallInput {
  bool elastic = true;
  preprocess::WallOptions extrusion;  // young_modulus 0: chosen by the wall stage
  std::optional<double> support;      // of cross-sections that move as wholes; empty: they do
                                      // not                                          [N/mm^3]
  std::vector<HeldPlace> held = {HeldPlace{}};  // where there is a support
};

/// What a report tells of a vessel whose cross-sections move.
std::string support_warning(double support, bool fitted = false);

using plan::Manoeuvring;

struct Case {
  std::filesystem::path file;  // the case file itself
  std::string name;
  std::optional<VolumeInput> volume;          // a surface alone, or one of the others or both:
  std::optional<SurfaceInput> surface_input;  // labels are the lumen of the volume beside them
  std::optional<LabelsInput> labels;
  bool axes_known = true;  // the input's axes are the patient's: left, posterior, superior
  preprocess::SegmentOptions segmentation;  // of a volume; seeds besides the access point
  preprocess::MaskLimits mask_limits;       // of a volume or labels
  preprocess::SurfaceOptions surface;
  WallInput wall;
  std::vector<AccessInput> accesses;  // one at least of each; every pair is a section
  std::vector<TargetInput> targets;
  bool accesses_listed = false, targets_listed = false;  // by the file, be it one
  std::size_t access = 0, target = 0;                    // of the section that the study is for
  /// Its tangent and the goal's way are found later, from the centerline. Where insertion.length is
  /// 0 the trials stage takes 1.25 times the path's length and 20 mm more.
  plan::Study study;
  std::vector<DeviceWire> devices;  // of the study's wires, in their order
  std::vector<Catheter> catheters;  // of the study's, in their order
  bool suggest_catheters = false;   // these are the catalogue's, to choose from by the anatomy
  /// Of every wire, where the case gives them in the place of the wires' own.
  std::optional<plan::FactorSpread> friction_spread, stiffness_spread;
  Manoeuvring manoeuvres = Manoeuvring::kWhenNeeded;
  plan::AccessLimits access_limits;
  plan::Limits limits;
  plan::Weights weights;
  /// Where unknowns.lumen is 0 the stages that repeat choose it: half a voxel if the input is a
  /// volume or labels, 0.25 mm if it is a surface.
  plan::RobustnessOptions robustness;
  std::vector<std::string> told;  // of the case itself, in sentences: names that have changed
  bool exhaustive = false;        // all candidates are run in full, none is only scouted
};

/// Reads CASE (a file, or a folder with a case.json), applies `overrides` ("wall.thickness_mm=2":
/// the value is JSON, and else text), defaults and units. Throws Error with all problems at once.
Case read_case(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// Makes the study that of one access and one target.
void choose_section(Case& given, std::size_t access, std::size_t target);

/// The keys of the section's access and target as the case file has them: "target", "targets[1]".
std::string access_key(const Case& given);
std::string target_key(const Case& given);

/// And of their points: "target.point_mm", "targets[1].branch".
std::string access_point_key(const Case& given);
std::string target_point_key(const Case& given);

/// Every access and target of the case by the key of its point, [mm].
std::vector<std::pair<std::string, Vec3>> end_points(Case given);

/// "right femoral to left renal"; of what the case has only one, without its name. Empty for a case
/// of one section.
std::string section_name(const Case& given);

/// Every parameter after defaults, under the keys of the case file; catalogue wires written out.
Json case_parameters(const Case& input);

/// A path of a case or scene file: ${WIREPLAN_DATA} is the environment's, and else ../shared/data
/// beside the checkout; what is relative counts from `folder`.
std::filesystem::path resolve_path(const std::string& given, const std::filesystem::path& folder);

/// The folder of the cases that come with the checkout.
std::filesystem::path cases_folder();

/// Adds a problem where nothing is at the path that stands under the key.
void expect_exists(JsonReader& reader, const std::string& key, const std::string& given,
                   const std::filesystem::path& path, const std::string& expected);

/// Where the case starts: its volume, surface or, without a volume, labels.
const std::filesystem::path& input_path(const Case& given);

/// Reads {"path", "unit", "frame"} and checks that the file is there; unit and frame may be left
/// out for VTP alone, which is ours and in mm LPS. Leaves other keys to the caller.
SurfaceInput read_surface_input(JsonReader& reader, const std::filesystem::path& folder);

/// Adds a problem where the key is given: a part of the design that this version does not have.
void refuse(JsonReader& reader, const std::string& key, const std::string& what);

/// Reads {"model", "thickness_mm", "young_modulus_kpa", "poisson_ratio", "support_kpa_per_mm"} of
/// the wall; `model` is "elastic" or "rigid" and stands where the file gives none.
WallInput read_wall(JsonReader& reader, const std::string& model);

/// Reads a coefficient of friction between wire and wall.
double read_friction(JsonReader& reader, double fallback);

}  // namespace wireplan::pipeline
