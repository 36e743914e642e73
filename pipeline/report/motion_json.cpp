#include "pipeline/report/motion_json.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "plan/anatomy/passage.h"
#include "plan/statistics.h"

namespace wireplan::pipeline {

namespace {

/// A line as the vessel carries it.
Centerline carried(const Centerline& line, const simulate::SectionChain& chain,
                   const Eigen::Matrix3Xd& u) {
  Centerline moved = line;
  moved.points = chain.carried(line.points, u);
  moved.arc_length = arc_length_of(moved.points);
  return moved;
}

Json view_json(const plan::View& view) {
  return {{"rotation_deg", view.rotation / kRadPerDeg}, {"tilt_deg", view.tilt / kRadPerDeg}};
}

/// Where a vessel turns off the way's, and which view shows that, at rest and moved.
Json turn_json(const std::vector<preprocess::Branch>& tree, const plan::Junction& rest,
               const plan::Junction& moved, const plan::ArmLimits& arm, bool axes_known) {
  const auto best_view = [&](const plan::Junction& at) {
    return plan::find_projections(at.trunk_direction, at.branch_direction, arm).best.view;
  };
  const plan::View before = best_view(rest), after = best_view(moved);
  // Of lines of sight: from its other end a line shows the same.
  const double along =
      std::abs(plan::detector_direction(before).dot(plan::detector_direction(after)));
  return {{"branch", plan::leaving_name(tree, rest)},
          {"at_rest_deg", plan::turn_of(rest) / kRadPerDeg},
          {"moved_deg", plan::turn_of(moved) / kRadPerDeg},
          {"from_access_mm", rest.level},
          {"moved_from_access_mm", moved.level},
          {"view_at_rest", axes_known ? view_json(before) : Json(nullptr)},
          {"view_moved", axes_known ? view_json(after) : Json(nullptr)},
          {"view_change_deg", std::acos(std::min(along, 1.0)) / kRadPerDeg}};
}

Json low_median_high(std::vector<double> values) {
  const plan::Spread spread = plan::find_spread(std::move(values));
  return {{"low", spread.low}, {"median", spread.median}, {"high", spread.high}};
}

/// Of one number of each branch's row under a key, over the repeats that have the row.
void put_spreads(const std::vector<Json>& repeats, const char* key,
                 const std::vector<const char*>& numbers, Json& into) {
  std::vector<std::pair<Json, std::vector<Json>>> branches;  // name and rows, as first told
  for (const Json& repeat : repeats) {
    for (const Json& row : repeat.at(key)) {
      const Json& name = row.at("branch");
      auto own = std::find_if(branches.begin(), branches.end(),
                              [&](const auto& other) { return other.first == name; });
      if (own == branches.end()) own = branches.emplace(own, name, std::vector<Json>());
      own->second.push_back(row);
    }
  }
  into[key] = Json::array();
  for (const auto& branch : branches) {
    Json spreads = {{"branch", branch.first}};
    for (const char* number : numbers) {
      std::vector<double> values;
      for (const Json& row : branch.second) values.push_back(row.at(number));
      spreads[number] = low_median_high(std::move(values));
    }
    into[key].push_back(std::move(spreads));
  }
}

}  // namespace

Json motion_spread_json(const std::vector<Json>& repeats) {
  expects(!repeats.empty());
  Json json = {{"repeats", repeats.size()}};
  for (const char* number : {"most_mm", "moved_way_length_mm"}) {
    std::vector<double> values;
    for (const Json& repeat : repeats) values.push_back(repeat.at(number));
    json[number] = low_median_high(std::move(values));
  }
  put_spreads(repeats, "ostia", {"shift_mm"}, json);
  put_spreads(repeats, "turns", {"moved_deg", "moved_from_access_mm", "view_change_deg"}, json);
  return json;
}

Json motion_json(const simulate::Way& way, const simulate::SectionChain& chain,
                 const Eigen::Matrix3Xd& u, const plan::ArmLimits& arm, bool axes_known) {
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
    ostia.push_back(
        {{"branch", branch_name(tree, static_cast<int>(b), simulate::own_start(tree[b]))},
         {"place_mm", to_json(rest)},
         {"shift_mm", shift.norm()},
         {"moved_mm", to_json(shift)}});
  }
  const simulate::Way there(carried(way.path(), chain, u), moved);
  Json turns = Json::array();
  const std::vector<plan::Junction> after = plan::find_junctions(there);
  for (const plan::Junction& junction : plan::find_junctions(way)) {
    const auto same = std::find_if(after.begin(), after.end(), [&](const plan::Junction& other) {
      return other.branch == junction.branch && other.trunk == junction.trunk && other.taken;
    });
    if (!junction.taken || same == after.end()) continue;
    turns.push_back(turn_json(tree, junction, *same, arm, axes_known));
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
