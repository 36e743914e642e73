#pragma once
/// One patient of `wireplan bench segmentation`: segmented from two points, and held against what
/// is known of it. For use in this folder.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/segment/segment.h"
#include "preprocess/volume/random_patient.h"

namespace wireplan::pipeline {

/// How far a patient came. kFailed: by our fault.
enum class PatientOutcome { kDone, kRefused, kNoSurface, kNoCenterline, kFailed };

/// Figures of a patient. Those that were not come to, or that a real one does not know, are empty.
struct PatientRow {
  std::string patient;  // the seed, or the name of a real case
  std::string features;
  double slice_mm = 0.0, spacing_mm = 0.0;
  std::optional<double> access_contrast_hu = {}, target_contrast_hu = {}, noise_hu = {};
  PatientOutcome outcome = PatientOutcome::kDone;
  std::string message = {};  // of what refused it

  std::optional<double> dice_way = {};  // of the voxels within three true radii of the true way
  std::optional<double> dice = {};
  std::optional<double> surface_mean_mm = {}, surface_p95_mm = {};  // there too, caps apart
  std::optional<double> axis_mean_mm = {}, axis_p95_mm = {};
  // Shares of the places within 5 % of the true radius: of half the section's diameter, which the
  // report tells, and of the inscribed ball's radius.
  std::optional<double> radius_within = {}, closed_within = {}, ball_within = {};
  std::optional<bool> way_right = {};
  std::optional<double> outside = {};         // of the mask, not next to the truth, over the truth
  std::optional<double> outside_silent = {};  // and that no warning names with its place
  std::optional<int> handles = {};            // of the surface
  std::optional<int> warnings = {};           // of the stages segment and surface
  double segment_s = 0.0, all_s = 0.0;        // CPU time, of all threads
};

/// Whether a point lies in the true lumen of any artery [mm].
using InLumen = std::function<bool(const Vec3&)>;

/// Whether a line keeps to the true way: each of its points lies within the way's radius at the
/// place next to it (where a wider artery's lumen is one with that, as at a mouth, within the
/// wider one's: lines cut corners), or all of the straight step there lies in the true lumen: at
/// its end an artery is one with both that go on, and the middle may lie in the other; no step
/// skips more of the way than two and a half radii and 5 mm, as those across limbs that kiss do;
/// and it begins and ends with the way, to the same tolerance.
bool is_way_right(const Centerline& line, const Centerline& way, const InLumen& in_lumen);

/// Segmented from the two clicked points alone, no band given; then its surface and centerline with
/// the defaults of a case. Never throws `Error`: a refusal is a row.
PatientRow segment_patient(const preprocess::RandomPatient& patient);

/// A real CT with a label of its lumen, and what may be in a mask besides.
struct LabelledCase {
  std::string name;
  std::filesystem::path volume, lumen;
  std::vector<std::filesystem::path> others;
  Vec3 access = Vec3::Zero(), target = Vec3::Zero();
};

/// Those that the folder holds of the ones known; none where there is no such folder.
std::vector<LabelledCase> find_labelled_cases(const std::filesystem::path& data);

/// The same; without a true axis, so overlap and what lies outside alone.
PatientRow segment_labelled(const LabelledCase& given);

}  // namespace wireplan::pipeline
