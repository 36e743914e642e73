#include "pipeline/files/text.h"

#include <algorithm>

#include "preprocess/base.h"

namespace wireplan::pipeline {

std::string format_table(const std::vector<std::vector<std::string>>& rows) {
  expects(!rows.empty());
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], row[k].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) {
      line += row[k] + std::string(width[k] - row[k].size() + 2, ' ');
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

}  // namespace wireplan::pipeline
