#include "plan/number_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wireplan::plan {

std::string two_digits(double value) {
  const double size = std::max(std::abs(value), 1e-4);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(size))), 0, 4);
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string two_decimals(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string one_decimal(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string three_digits(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string four_digits(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace wireplan::plan
