#pragma once
/// Which catheters an ostium asks for, by their shapes and the anatomy there.
#include <string>
#include <vector>

#include "plan/candidates.h"

namespace wireplan::plan {

/// What a catheter's curves do to its tip.
enum class CurveKind { kStraight, kSimple, kHooked, kReversed, kRing };
const char* kind_name(CurveKind kind);  // "hooked curve"

/// The plane shape of a catheter without load.
struct CurveShape {
  CurveKind kind = CurveKind::kStraight;
  double turn = 0.0;   // most that the line from its shaft to its tip turns to one side      [rad]
  double reach = 0.0;  // of the shape across, from the shaft's line                         [mm]
};

/// Straight below a turn of 20 degrees, simple below 75 (vertebral, multipurpose), hooked below 150
/// (Cobra, renal double curve), reversed below 300 (Simmons, Sos, RIM), else a ring (pigtail),
/// which hooks nothing. Limits chosen between the shapes of the catalogue.
CurveShape find_shape(const simulate::Wire& tube);

/// Length from the tip to the end of a catheter's first or last curve [mm].
double curved_length(const simulate::Wire& tube, bool first);

/// How far the branch turns from its trunk [rad].
double take_off_of(const Ostium& ostium);

/// The kind that a branch asks for which turns so far from its trunk: simple below 60 degrees,
/// hooked to 120, reversed beyond, where it leaves back down (references-2 L; limits assumed).
CurveKind asked_for(double take_off);

struct Suggestion {
  int catheter = 0;    // index into the list
  std::string reason;  // a sentence with numbers
};

/// At most `most`, best first: of the kind that the take-off asks for, no thicker than the branch,
/// as wide as the trunk as can be, since a curve rests on the wall opposite; then of the kind that
/// the nearest take-offs ask for, and of the last. Empty where nothing goes into the branch.
std::vector<Suggestion> suggest_catheters(const std::vector<Catheter>& catheters,
                                          const Ostium& ostium, std::size_t most = 9);

/// Leaves the study the catheters that its ostium asks for, none where its way takes no branch, and
/// tells why. The first three are tried, and the next where none of them has a script that holds,
/// also in full and in most of a few repeats.
void keep_suggested(Study& study);

}  // namespace wireplan::plan
