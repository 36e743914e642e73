#include "pipeline/report/motion_json.h"

#include <algorithm>
#include <string>
#include <vector>

#include "plan/anatomy/passage.h"

namespace wireplan::pipeline {

namespace {

/// A line as the vessel carries it.
Centerline carried(const Centerline& line, const simulate::SectionChain& chain,
                   const Eigen::Matrix3Xd& u) {
  Centerline moved = line;
  for (Eigen::Index k = 0; k < line.points.cols(); ++k) {
    moved.points.col(k) += chain.displacement(line.points.col(k), u);
    if (k == 0) continue;
    moved.arc_length[k] =
        moved.arc_length[k - 1] + (moved.points.col(k) - moved.points.col(k - 1)).norm();
  }
  return moved;
}

}  // namespace

Json motion_json(const simulate::Way& way, const simulate::SectionChain& chain,
                 const Eigen::Matrix3Xd& u) {
  const std::vector<preprocess::Branch>& tree = way.tree();
  std::vector<preprocess::Branch> moved = tree;
  double most = 0.0;
  Vec3 place = Vec3::Zero();
  for (std::size_t b = 0; b < tree.size(); ++b) {
    moved[b].line = carried(tree[b].line, chain, u);
    for (Eigen::Index k = 0; k < tree[b].line.points.cols(); ++k) {
      const double here = (moved[b].line.points.col(k) - tree[b].line.points.col(k)).norm();
      if (here <= most) continue;
      most = here;
      place = tree[b].line.points.col(k);
    }
  }
  Json ostia = Json::array();
  for (std::size_t b = 0; b < tree.size(); ++b) {
    if (tree[b].parent < 0) continue;
    const auto parent = static_cast<std::size_t>(tree[b].parent);
    const Vec3 rest = plan::point_at(tree[parent].line, tree[b].parent_arc);
    const Vec3 shift = chain.displacement(rest, u);
    const plan::LinePart at = plan::find_part(tree[parent].line, tree[b].parent_arc);
    const Eigen::VectorXd& arcs = moved[parent].line.arc_length;
    moved[b].parent_arc = arcs[at.before] + at.part * (arcs[at.before + 1] - arcs[at.before]);
    ostia.push_back({{"branch", branch_name(tree, static_cast<int>(b))},
                     {"place_mm", to_json(rest)},
                     {"shift_mm", shift.norm()},
                     {"moved_mm", to_json(shift)}});
  }
  const simulate::Way there(carried(way.path(), chain, u), moved);
  Json turns = Json::array();
  const std::vector<plan::Junction> after = plan::find_junctions(there);
  for (const plan::Junction& junction : plan::find_junctions(way)) {
    const auto same = std::find_if(after.begin(), after.end(), [&](const plan::Junction& other) {
      return other.branch == junction.branch && other.taken;
    });
    if (!junction.taken || same == after.end()) continue;
    turns.push_back({{"branch", branch_name(tree, junction.branch)},
                     {"at_rest_deg", plan::turn_of(junction) / kRadPerDeg},
                     {"moved_deg", plan::turn_of(*same) / kRadPerDeg}});
  }
  const auto length_of = [](const Centerline& line) {
    return line.arc_length[line.arc_length.size() - 1] - line.arc_length[0];
  };
  return {{"most_mm", most},
          {"most_at_mm", to_json(place)},
          {"ostia", ostia},
          {"turns", turns},
          {"way_length_mm", length_of(way.path())},
          {"moved_way_length_mm", length_of(there.path())}};
}

}  // namespace wireplan::pipeline
