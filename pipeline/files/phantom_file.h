#pragma once
/// phantom.json -> PhantomSpec, and a phantom -> its folder. Points in mm, patient LPS.
#include <filesystem>

#include "preprocess/volume/phantom.h"
#include "preprocess/volume/random_patient.h"

namespace wireplan::pipeline {

/// Reads a description with "schema": "wireplan.phantom/1"; cases/abdomen/phantom.json uses every
/// key. Throws Error with all problems at once; what it returns, make_phantom accepts.
preprocess::PhantomSpec read_phantom_spec(const std::filesystem::path& path);

/// Writes into the folder, made where it is missing:
///   ct.nrrd                the volume                                              [HU]
///   truth/lumen.nrrd       1 in the lumen of the arteries, 0 elsewhere
///   truth/ARTERY.vtp       axis of each artery with radius_mm and arc_length_mm
///   truth/centerlines.json all axes: name, points_mm, radius_mm
/// All files are written under a temporary name first; ct.nrrd comes into place last, so where
/// it stands the truth is complete. An artery with no part in the volume has no axis file. Throws
/// Error where the disk refuses, or in a build without images.
void write_phantom(const preprocess::Phantom& phantom, const std::filesystem::path& folder);

/// The same of a patient drawn at random, with a case.json for it, which runs as it stands: the
/// band is left to the program.
void write_patient(const preprocess::RandomPatient& patient, const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
