#include "preprocess/base.h"

#include <sstream>

namespace wireplan {

double clean(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return std::stod(text.str());
}

}  // namespace wireplan
