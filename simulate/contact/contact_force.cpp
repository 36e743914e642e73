#include "simulate/contact/contact_force.h"

#include <algorithm>

namespace wireplan::simulate {

namespace {

/// Where a point's share of wire begins and ends, from the tip [mm].
double near_end(const Touch& touch) {
  return std::max(0.0, touch.tip_distance - 0.5 * touch.share);
}
double far_end(const Touch& touch) { return near_end(touch) + touch.share; }

/// The sum of the forces further from the tip than a distance, for distances that fall from call to
/// call. sums[k] is that of the first k touches.
class ForceBeyond {
 public:
  ForceBeyond(const std::vector<Touch>& touches, const std::vector<Vec3>& sums)
      : touches_(touches), sums_(sums) {}
  Vec3 at(double distance) {
    const std::size_t count = touches_.size();
    while (whole_ < count && near_end(touches_[whole_]) >= distance) ++whole_;
    Vec3 sum = sums_[whole_];
    for (std::size_t k = whole_; k < count && far_end(touches_[k]) > distance; ++k) {
      sum += (1.0 - part_within(touches_[k], distance)) * force_on_wire(touches_[k]);
    }
    return sum;
  }

 private:
  const std::vector<Touch>& touches_;
  const std::vector<Vec3>& sums_;
  std::size_t whole_ = 0;  // so many are beyond the distance as a whole
};

}  // namespace

double part_within(const Touch& touch, double distance) {
  return std::clamp((distance - near_end(touch)) / touch.share, 0.0, 1.0);
}

double peak_force_on_length(const std::vector<Touch>& touches, double length,
                            std::vector<Vec3>& sums) {
  sums.assign(1, Vec3::Zero());
  for (const Touch& touch : touches) sums.push_back(sums.back() + force_on_wire(touch));
  // The sum over a stretch is linear in its place but where an end of it meets that of a share, and
  // so its norm is largest at such a place.
  double peak = 0.0;
  for (const bool far : {false, true}) {
    for (const double back : {0.0, length}) {
      ForceBeyond start(touches, sums), end(touches, sums);
      for (const Touch& touch : touches) {
        const double from = (far ? far_end(touch) : near_end(touch)) - back;
        peak = std::max(peak, (start.at(from) - end.at(from + length)).norm());
      }
    }
  }
  return peak;
}

}  // namespace wireplan::simulate
