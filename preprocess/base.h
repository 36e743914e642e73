#pragma once
/// What every folder shares: vectors, the one exception type, preconditions and unit constants.
/// Inside wireplan everything is in mm, N, s, rad (hence MPa, N mm = mJ, tonnes) and in the
/// patient's LPS frame; the constants here convert on the way in (files) and on the way out
/// (reports).
#include <Eigen/Core>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace wireplan {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// The world is wrong: a file, a case, a mesh. The message names the place, the value, what was
/// expected and what to do. `main` prints the message alone and exits 2.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The world is wrong in that the disk refuses what wireplan writes: full, read-only, failing, not
/// permitted. Nothing is wrong with the input, so `main` exits 3.
class DiskError : public Error {
 public:
  using Error::Error;
};

/// The code is wrong: a precondition of a function does not hold. `main` exits 3.
class LogicError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Checks a precondition, in every build. The defaults tell where the call stands, by builtins of
/// GCC and Clang: std::source_location needs Clang 16.
inline void expects(bool condition, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE(), const char* function = __builtin_FUNCTION()) {
  if (!condition) {
    throw LogicError(std::string(file) + ":" + std::to_string(line) + ": " + function +
                     ": precondition violated");
  }
}

/// The number rounded to 12 digits, which removes what converting units adds: 15 deg and not
/// 15.000000000000002.
double clean(double value);

/// The value in the middle, of an even number the upper of two; of one at least.
double median(std::vector<double> values);

/// For messages: a point as "(12.3, -4.5, 6.7)", a number with three digits.
std::string place_text(const Vec3& place);
std::string number_text(double value);

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRadPerDeg = kPi / 180.0;
inline constexpr double kMpaPerKpa = 1e-3;
inline constexpr double kMpaPerGpa = 1e3;
inline constexpr double kMmPerM = 1e3;
/// Mass per length: 1 kg/m = 1e-3 t / 1e3 mm.
inline constexpr double kTonnePerMmFromKgPerM = 1e-6;

}  // namespace wireplan
