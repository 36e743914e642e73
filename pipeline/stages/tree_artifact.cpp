#include "pipeline/stages/tree_artifact.h"

#include <algorithm>

#include "preprocess/files/vessel_io.h"

namespace wireplan::pipeline {

std::vector<preprocess::Branch> read_tree(const Workspace& work) {
  std::vector<Centerline> lines =
      preprocess::read_centerlines(work.artifact("centerline").folder / "tree.vtp");
  const Json branches = work.figures("centerline").at("branches");
  expects(lines.size() == branches.size());
  std::vector<preprocess::Branch> tree;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    // The parent is told by its name.
    const auto parent = std::find_if(branches.begin(), branches.end(), [&](const Json& other) {
      return other.at("name") == branches[k].at("parent");
    });
    tree.push_back(
        {.line = std::move(lines[k]),
         .parent = parent == branches.end() ? -1 : static_cast<int>(parent - branches.begin()),
         .parent_arc = branches[k].at("parent_arc_mm").get<double>()});
  }
  return tree;
}

}  // namespace wireplan::pipeline
