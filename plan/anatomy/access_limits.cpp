#include "plan/anatomy/access_limits.h"

namespace wireplan::plan {

int grade_of(double value, const std::array<double, 3>& thresholds) {
  const bool rising = thresholds.front() <= thresholds.back();
  int grade = 0;
  for (const double threshold : thresholds) {
    if (rising ? value >= threshold : value <= threshold) ++grade;
  }
  return grade;
}

}  // namespace wireplan::plan
