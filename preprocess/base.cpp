#include "preprocess/base.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace wireplan {

double clean(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return std::strtod(text.str().c_str(), nullptr);  // of the least numbers too
}

double median(std::vector<double> values) {
  expects(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string place_text(const Vec3& p) {
  const auto shown = [](double x) { return std::abs(x) < 0.05 ? 0.0 : x; };  // no "-0.0"
  std::array<char, 96> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "(%.1f, %.1f, %.1f)", shown(p.x()), shown(p.y()),
                shown(p.z()));
  return buffer.data();
}

std::string number_text(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.3g", value);
  return buffer.data();
}

}  // namespace wireplan
