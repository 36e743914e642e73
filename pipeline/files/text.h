#pragma once
/// Text for people: numbers in the manner of printf, and columns.
#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace wireplan::pipeline {

/// At most 511 characters in the manner of printf, e.g. format("%g mm", 2.5).
template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

/// Cells in columns as wide as their widest, two spaces apart; a line per row, each of as many
/// cells as the first.
std::string format_table(const std::vector<std::vector<std::string>>& rows);

}  // namespace wireplan::pipeline
