#pragma once
/// Numbers in sentences.
#include <string>

namespace wireplan::plan {

/// "0.21", "1.9", "12", "0": two significant digits, at most four decimals, never an exponent.
std::string two_digits(double value);
std::string one_decimal(double value);
std::string two_decimals(double value);  // "0.40", "1.04"
std::string three_digits(double value);  // "1.67", "0.4", "312"
/// As many digits as it takes to tell a value from a limit that it just broke.
std::string four_digits(double value);
std::string whole_millimetres(double length);  // "24 mm"
/// "1 trial", "3 trials"
std::string count_of(int count, const std::string& noun);

}  // namespace wireplan::plan
