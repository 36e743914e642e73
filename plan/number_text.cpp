#include "plan/number_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wireplan::plan {

namespace {

std::string printed(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

}  // namespace

std::string two_digits(double value) {
  if (std::abs(value) < 5e-5) return "0";
  const double size = std::max(std::abs(value), 1e-4);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(size))), 0, 4);
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string two_decimals(double value) { return printed("%.2f", value); }
std::string one_decimal(double value) { return printed("%.1f", value); }
std::string three_digits(double value) { return printed("%.3g", value); }
std::string four_digits(double value) { return printed("%.4g", value); }

std::string whole_millimetres(double length) { return std::to_string(std::lround(length)) + " mm"; }

std::string count_of(int count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace wireplan::plan
