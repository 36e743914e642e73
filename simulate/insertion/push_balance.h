#pragma once
/// The work of the hand in a push. Elements and contact points hold a wire as it goes: its energy
/// and the force of the hand ripple with the length of an element, the force the more, and pushes
/// as long as elements meet the same place of the ripple each time. So forces at the ends of pushes
/// are no mean force, but the energy differs between them by what the ripple does not touch: the
/// work is the energy stored and turned into heat, and what a jump of the wire releases. That alone
/// is told by forces: where those at both ends do more work than the energy says, and more than the
/// ripple of the pushes before, the difference is released.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace wireplan::simulate {

/// Named where forces and energies tell the work differently by more than 1 % of it; else empty.
inline std::string describe_balance(double unbalanced, double work) {
  constexpr double kBalance = 0.01;
  if (std::abs(unbalanced) <= kBalance * work) return "";
  char text[96];
  std::snprintf(text, sizeof text, "its forces are rough: energy is out of balance by %.0f %%",
                100.0 * std::abs(unbalanced) / work);
  return text;
}

class PushBalance {
 public:
  /// What a push by `distance` released, given the work of the forces at its ends and the energy
  /// stored and turned into heat [N mm]. After a pull the ripple is learnt anew, and after a push.
  double find_release(double distance, double by_forces, double by_energy) {
    const double length = std::abs(distance), excess = (by_forces - by_energy) / length;
    if (distance * last_distance_ < 0.0) count_ = 0;
    last_distance_ = distance;
    if (count_ >= kLeast) {
      const double ripple = middle();
      double most = 0.0;  // of the pushes before, off their middle
      for (int k = 0; k < std::min(count_, kPushes); ++k) {
        most = std::max(most, std::abs(excess_[static_cast<std::size_t>(k)] - ripple));
      }
      if (excess - ripple > kOutlier * most + kLeastForce) return (excess - ripple) * length;
    }
    excess_[static_cast<std::size_t>(count_ % kPushes)] = excess;
    length_[static_cast<std::size_t>(count_ % kPushes)] = length;
    if (++count_ >= kPushes) {
      // The push in the middle of these, against all of them.
      const auto center = static_cast<std::size_t>((count_ - 1 - kPushes / 2) % kPushes);
      unbalanced_ += (excess_[center] - middle()) * length_[center];
    }
    return 0.0;
  }

  /// By how much forces at the ends of pushes exceed the mean force, as the last pushes tell [N].
  double ripple() const { return count_ >= kLeast ? middle() : 0.0; }

  /// Since the start: what the forces' work exceeds the energies' by and neither the ripple, which
  /// is the middle of that of nine pushes, nor a jump explains. 0 but for errors [N mm].
  double unbalanced() const { return unbalanced_; }

 private:
  static constexpr int kPushes = 9;            // that tell the ripple
  static constexpr int kLeast = 4;             // ... from which on it is known
  static constexpr double kOutlier = 3.0;      // times the ripple's spread is a jump; chosen
  static constexpr double kLeastForce = 1e-5;  // so much more than that [N]

  double middle() const {
    std::array<double, kPushes> sorted = excess_;
    const int n = std::min(count_, kPushes);
    std::sort(sorted.begin(), sorted.begin() + n);
    return 0.5 * (sorted[static_cast<std::size_t>((n - 1) / 2)] +
                  sorted[static_cast<std::size_t>(n / 2)]);
  }

  std::array<double, kPushes> excess_{};  // of the last pushes, the latest at (count - 1) % 9  [N]
  std::array<double, kPushes> length_{};  // of them                                         [mm]
  int count_ = 0;
  double last_distance_ = 0.0, unbalanced_ = 0.0;
};

}  // namespace wireplan::simulate
