#include "preprocess/base.h"

#include <array>
#include <cstdio>
#include <sstream>

namespace wireplan {

double clean(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return std::stod(text.str());
}

std::string place_text(const Vec3& p) {
  std::array<char, 96> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "(%.1f, %.1f, %.1f)", p.x(), p.y(), p.z());
  return buffer.data();
}

std::string number_text(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.3g", value);
  return buffer.data();
}

}  // namespace wireplan
