#pragma once
/// Patients drawn from a seed: an anatomy with what makes real CTs hard, as a phantom, and the two
/// points that a person would click in it. Sizes lie in ranges of the literature where there is
/// one (random_abdomen.cpp, random_arch.cpp), else they are assumed; no share of a feature is meant
/// to be that of a population.
#include <cstdint>
#include <string>
#include <vector>

#include "preprocess/volume/phantom.h"

namespace wireplan::preprocess {

/// A place that was clicked in a slice: in the lumen, off its axis by up to half the radius.
struct ClickedPoint {
  std::string name;           // of the place
  Vec3 point = Vec3::Zero();  // [mm]
};

struct RandomPatient {
  std::string anatomy;  // "abdomen" or "arch"
  PhantomSpec spec;
  ClickedPoint access, target;
  std::vector<std::string> way;       // arteries from access to target, by name
  std::vector<std::string> features;  // that were drawn, of kPatientFeatures
  double access_contrast_hu = 0.0;    // over blood without contrast, at the access
  double target_contrast_hu = 0.0;    // and at the target: it falls along the way
};

/// Every feature that is drawn, and the share of patients that have it, roughly.
struct PatientFeature {
  const char* name;
  double share;
};
inline constexpr PatientFeature kPatientFeatures[] = {
    {"bends", 0.38},          // of iliacs or carotids: 5 to 12 mm to either side
    {"aneurysm", 0.22},       // of the aorta, its sac lined with thrombus of 40 to 60 HU
    {"stenosis", 0.32},       // 0.4 to 0.7 of the radius, on the way
    {"calcium", 0.6},         // 3 to 10 plaques
    {"stent", 0.2},           // struts of 1500 to 3000 HU
    {"kissing limbs", 0.19},  // lumens 0.3 to 1 mm apart
    {"veins", 0.7},           // at 0.5 to 0.95 of the arteries' HU, 0 to 1 mm from their walls
    {"organs", 0.6},   // kidneys, spleen and liver, or thyroid, at 0.5 to 1 of the arteries' HU
    {"breath", 0.23},  // all above a slice shifted by 1 to 4 mm
    {"thick slices", 0.23},   // 2.5 to 5 mm
    {"noise", 0.5},           // 24 to 40 HU, else 8 to 24
    {"little contrast", 0.3}  // 100 to 200 HU, else to 450
};

/// Deterministic: the same seed gives the same patient. The volume has 0.5 to 10 million voxels,
/// 0.6 to 0.9 mm in the slice, slices 0.5 to 5 mm, cropped round the way.
/// An anatomy whose way touches itself is drawn anew.
RandomPatient draw_patient(std::uint64_t seed);

/// The true axis from the place next to the access to that next to the target, as the volume shows
/// it, with the arteries' radius (before plaque).
Centerline true_way(const RandomPatient& patient);

}  // namespace wireplan::preprocess
