#pragma once
/// Words of files, which people write in any case.
#include <algorithm>
#include <cctype>
#include <string>

namespace wireplan {

/// In small letters, of ASCII alone; bytes of other letters stay.
inline std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace wireplan
