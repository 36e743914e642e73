#pragma once
/// What people call the vessels of the tree, and how the tree lies in the patient.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/centerline/centerline.h"

namespace wireplan::plan {

/// A place of the case in a vessel, by its name.
struct NamedPlace {
  std::string name;
  Vec3 point = Vec3::Zero();  //                                                          [mm]
};

/// Names the vessels of branches by what lies in them: "left renal (branch 6)". The target's vessel
/// is called after the target, "the target's branch" where neither that nor labels have a name;
/// others after the other targets and accesses, those that come first before the rest. The vessel
/// that the tree starts in is called after no access: it goes on far beyond it. A branch may
/// run through several vessels, and a name is that of one: from the last place before that leaves a
/// clearly wider vessel, enters a wider one (simulate::is_entered) or the one that two legs meet
/// in, has another name by labels, or has shared a stem with another vessel that goes on from it
/// (simulate::goes_on), up to the next such place. A stem without a name is "the stem of" the first
/// vessel that is named beyond it.
void name_branches(std::vector<preprocess::Branch>& tree, const NamedPlace& target,
                   const std::vector<NamedPlace>& other_targets,
                   const std::vector<NamedPlace>& other_accesses);

/// The axis along which the tree's wide vessels (6 mm in radius and more) lie: that of the aorta,
/// which runs from head to feet in a patient. Unit, either sign; empty where they are shorter than
/// 100 mm along it.
std::optional<Vec3> find_trunk_axis(const std::vector<preprocess::Branch>& tree);

}  // namespace wireplan::plan
