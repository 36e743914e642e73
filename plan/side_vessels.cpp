#include "plan/side_vessels.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "plan/anatomy/passage.h"
#include "plan/catheter_choice.h"
#include "preprocess/centerline/path_place.h"

namespace wireplan::plan {
namespace {

using preprocess::Branch;
using preprocess::find_place;
using simulate::SideVessel;

/// All chosen.
constexpr double kInto = 6.0;        // of a side vessel, at least, for its direction          [mm]
constexpr double kWidthOver = 10.0;  // so much of it its width is told                        [mm]
constexpr double kBeforeEnd = 9.0;   // of a wire's tip, short of where the image ends         [mm]
constexpr double kWider = 2.0;       // than the catheter
constexpr double kKneeRoom = 0.5;    // of the curve's width, in the trunk
constexpr std::size_t kVessels = 2;
constexpr double kOnAxis = 0.02;  // of a vessel's radius, beside its axis

/// The vessels that the way comes up, and where it leaves the last of them.
struct TrunkLine {
  Centerline line;     // the way up to there, and on along that vessel
  double level = 0.0;  // of the ostium, along it                                             [mm]
};

/// Of the way up to an ostium at that arc length; the whole of it where no vessel goes on there.
TrunkLine trunk_before(const simulate::Way& way, double ostium) {
  const Centerline& path = way.path();
  int on = -1;
  TrunkLine trunk{path, ostium};
  for (const Junction& junction : find_junctions(way)) {
    if (!junction.taken || junction.entered || junction.arc > ostium + 1e-6) continue;
    on = junction.trunk;
    trunk.level = junction.level;
  }
  if (on < 0) return trunk;
  const Centerline& vessel = way.tree()[static_cast<std::size_t>(on)].line;
  // Where the way is on its axis last.
  const Eigen::Index count = find_part(path, ostium).before + 1;
  std::vector<preprocess::PathPlace> places;
  double nearest = HUGE_VAL;
  for (Eigen::Index i = 0; i < count; ++i) {
    places.push_back(find_place(path.points.col(i), vessel));
    nearest = std::min(nearest, places.back().from_axis);
  }
  Eigen::Index last = count - 1;
  const auto is_on = [&](const preprocess::PathPlace& place) {
    return place.from_axis <= nearest + kOnAxis * place.radius;
  };
  while (last > 0 && !is_on(places[static_cast<std::size_t>(last)])) --last;
  const double from = places[static_cast<std::size_t>(last)].arc;
  const auto* arcs = vessel.arc_length.data();
  const Eigen::Index more = vessel.arc_length.size() -
                            (std::upper_bound(arcs, arcs + vessel.arc_length.size(), from) - arcs);
  trunk.line.points.resize(3, last + 1 + more);
  trunk.line.radius.resize(last + 1 + more);
  trunk.line.points << path.points.leftCols(last + 1), vessel.points.rightCols(more);
  trunk.line.radius << path.radius.head(last + 1), vessel.radius.tail(more);
  trunk.line.arc_length = arc_length_of(trunk.line.points);
  return trunk;
}

/// The first place on a line, from an arc length on, that is outside of the way's inscribed balls;
/// the line's end where none is.
Eigen::Index leaves_way(const Centerline& line, double from, const Centerline& way) {
  Eigen::Index i = find_part(line, from).before;
  while (i + 1 < line.points.cols() && find_place(line.points.col(i), way).from_lumen <= 0.0) ++i;
  return i;
}

/// What a line does off the way from there on; none where it leaves the trunk beyond its ostium.
std::optional<SideVessel> side_of(const simulate::Way& way, const TrunkLine& trunk, int branch,
                                  double from) {
  const Centerline& line = way.tree()[static_cast<std::size_t>(branch)].line;
  const Centerline& path = way.path();
  const Eigen::Index mouth = leaves_way(line, from, path);
  SideVessel side{.branch = branch, .take_off = {}, .from = line.arc_length[mouth]};
  simulate::TakeOff& place = side.take_off;
  const double into = std::max(kInto, 3.0 * line.radius[mouth]);
  if (side.from + into >= length_of(line)) return {};
  place.point = line.points.col(mouth);
  place.arc = find_place(place.point, path).arc;
  if (find_place(place.point, trunk.line).arc >= trunk.level) return {};
  place.branch = (point_at(line, side.from + into) - place.point).normalized();
  // Of the trunk behind the mouth, where the ball of a fork belongs to both.
  const double width = 2.0 * path.radius[find_part(path, place.arc).before];
  const double to = std::min(place.arc + 2.0 * width, length_of(trunk.line));
  const double at = std::min(place.arc + 0.5 * width, 0.5 * (place.arc + to));
  place.trunk = (point_at(trunk.line, to) - point_at(trunk.line, at)).normalized();
  return side;
}

/// Of a line from there on, over so much of it, the narrowest [mm].
double narrowest_radius(const Centerline& line, double from, double length) {
  double least = HUGE_VAL;
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    const double beyond = line.arc_length[i] - from;
    if (beyond >= 0.0 && beyond <= length) least = std::min(least, line.radius[i]);
  }
  return least;
}

double radius_in(const simulate::Way& way, const SideVessel& side) {
  const Centerline& line = way.tree()[static_cast<std::size_t>(side.branch)].line;
  return narrowest_radius(line, side.from, kWidthOver);
}

/// Of the last curve, that the knee is in: its width without load [mm].
double knee_width(const simulate::Wire& tube) {
  for (auto section = tube.sections.rbegin(); section != tube.sections.rend(); ++section) {
    if (section->rest_curvature != 0.0) return 2.0 / std::abs(section->rest_curvature);
  }
  return 0.0;
}

}  // namespace

double knee_length(const simulate::Wire& tube) {
  double length = 0.0, knee = 0.0;
  for (const simulate::Section& section : tube.sections) {
    if (section.rest_curvature != 0.0) knee = length + 0.5 * section.length;
    length += section.length;
  }
  return knee;
}

std::vector<SideVessel> find_side_vessels(const simulate::Way& way, double before) {
  std::vector<SideVessel> sides;
  const std::vector<Branch>& tree = way.tree();
  const std::vector<int> chain = way.branches();
  if (chain.empty()) return sides;
  const TrunkLine trunk = trunk_before(way, before);
  const auto add = [&](int branch, double from) {
    const std::optional<SideVessel> side = side_of(way, trunk, branch, from);
    if (side && side->take_off.arc < before) sides.push_back(*side);
  };
  for (int k = 0; k < std::ssize(tree); ++k) {
    const bool on_way = std::find(chain.begin(), chain.end(), k) != chain.end();
    const int parent = tree[static_cast<std::size_t>(k)].parent;
    if (on_way || std::find(chain.begin(), chain.end(), parent) == chain.end()) continue;
    if (simulate::runs_back(tree, k)) continue;
    add(k, 0.0);
  }
  // The other leg, where the way leaves the line that goes on in it.
  const std::optional<simulate::Bifurcation>& fork = way.bifurcation();
  if (fork && fork->takes_child) {
    add(fork->parent, tree[static_cast<std::size_t>(fork->child)].parent_arc);
  }
  std::stable_sort(sides.begin(), sides.end(), [&](const SideVessel& a, const SideVessel& b) {
    return radius_in(way, a) > radius_in(way, b);
  });
  return sides;
}

std::vector<SideVessel> list_reshaping_vessels(const simulate::Way& way, double ostium,
                                               const std::vector<SideVessel>& sides,
                                               const simulate::Wire& tube) {
  std::vector<SideVessel> kept;
  if (find_shape(tube).kind != CurveKind::kReversed) return kept;
  const double needed = knee_length(tube) + kWireLeads;  // with what the wire leads
  if (sides.empty()) return kept;
  const TrunkLine trunk = trunk_before(way, ostium);
  for (const SideVessel& side : sides) {
    const Centerline& line = way.tree()[static_cast<std::size_t>(side.branch)].line;
    const double room =
        2.0 *
        narrowest_radius(trunk.line, side.take_off.arc + 0.5 * knee_width(tube), knee_width(tube));
    const bool serves = kept.size() < kVessels &&
                        length_of(line) - side.from >= needed + kBeforeEnd &&
                        narrowest_radius(line, side.from, needed) >= kWider * tube.radius &&
                        room >= kKneeRoom * knee_width(tube);
    if (serves) kept.push_back(side);
  }
  return kept;
}

std::optional<double> find_opening_depth(const simulate::Way& way, double ostium,
                                         const simulate::Wire& tube) {
  if (find_shape(tube).kind != CurveKind::kReversed || way.tree().empty()) return {};
  const TrunkLine trunk = trunk_before(way, ostium);
  const double knee = knee_length(tube);
  const double seen = length_of(trunk.line) - trunk.level - kWireLeadsOn - kBeforeEnd;
  const double depth = std::min(seen, curved_length(tube, false) + 0.5 * knee_width(tube));
  if (depth < knee) return {};
  const double width = 2.0 * narrowest_radius(trunk.line, trunk.level + depth - knee, knee);
  if (width < knee_width(tube)) return {};
  return trunk.level + depth - ostium;
}

}  // namespace wireplan::plan
