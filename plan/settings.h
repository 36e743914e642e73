#pragma once
/// Settings of a run that should not matter: how long a push is, and changes far below what hand
/// and device know. Where the end of a run hangs on one of them, it hangs on the path that the
/// solver took, and is one of several ends that the wire has.
#include <string>
#include <vector>

#include "plan/candidates.h"

namespace wireplan::plan {

enum class Setting {
  kStep,       // pushes half as long
  kRoll,       // the hub turned by 0.01 degrees
  kFriction,   // friction times 1.001
  kTolerance,  // a tenth of the residual
};
const char* setting_name(Setting setting);      // in files: "step", "roll", ...
std::string describe_setting(Setting setting);  // "with pushes half as long"

/// That plans are run with: what the others do it finds too, and more (MEASUREMENTS.md).
inline constexpr Setting kSettingTried = Setting::kStep;

/// All that this candidate can feel: not the roll of a straight round wire, nor friction where
/// there is none.
std::vector<Setting> settings_that_act(const Study& study, const Candidate& candidate);

/// Changes the study or the candidate.
void change_setting(Setting setting, Study& study, Candidate& candidate);

}  // namespace wireplan::plan
