#pragma once
/// `wireplan new`: the folder of a case, from what somebody has of a patient.
#include <filesystem>
#include <string>
#include <vector>

namespace wireplan::pipeline {

struct NewCase {
  std::filesystem::path folder;   // is made where it is not there
  std::filesystem::path volume;   // as of a case; may be empty where there are labels
  std::string series;             // of a DICOM folder: number, description or key; may be empty
  std::filesystem::path markups;  // of 3D Slicer; may be empty
  std::filesystem::path labels;   // somebody's segmentation; may be empty
};

/// In sentences.
struct NewCaseAnswer {
  std::vector<std::string> found;    // of the volume and at the points
  std::vector<std::string> missing;  // to do before the case can run; empty: it can
};

/// Writes case.json, which reads as a case once nothing is missing, and README.md, which says what
/// was found, what is missing and what the keys mean. Points are access and target by their names,
/// or in this order where there are two. Of labels the classes are taken whose names are
/// an artery's; without markups, access and target are proposed by branch. Throws `Error` where
/// there is a case.json already, and for a volume or markups that a case would refuse.
NewCaseAnswer write_new_case(const NewCase& given);

}  // namespace wireplan::pipeline
