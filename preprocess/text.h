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

/// Without spaces, tabs and carriage returns at both ends.
inline std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

}  // namespace wireplan
