#include "plan/anatomy/passage.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "preprocess/centerline/path_place.h"

namespace wireplan::plan {
namespace {

using preprocess::Branch;

/// The index of the last point at or before an arc length, with a point behind it.
Eigen::Index segment_at(const Centerline& line, double arc) {
  const auto* begin = line.arc_length.data();
  const auto* found = std::upper_bound(begin, begin + line.arc_length.size(), arc);
  return std::clamp<Eigen::Index>(found - begin - 1, 0, line.arc_length.size() - 2);
}

double radius_at(const Centerline& line, double arc) {
  const auto [before, part] = find_part(line, arc);
  return (1.0 - part) * line.radius(before) + part * line.radius(before + 1);
}

/// The way up to the point before an arc length, then another line to its end.
Centerline joined(const Centerline& way, double arc, const Centerline& after) {
  const Eigen::Index before = std::max<Eigen::Index>(segment_at(way, arc), 1),
                     more = after.points.cols();
  Centerline line{.points = Eigen::Matrix3Xd(3, before + more),
                  .radius = Eigen::VectorXd(before + more),
                  .arc_length = Eigen::VectorXd(before + more)};
  line.points << way.points.leftCols(before), after.points;
  line.radius << way.radius.head(before), after.radius;
  const double gap = (after.points.col(0) - way.points.col(before - 1)).norm();
  line.arc_length << way.arc_length.head(before),
      (after.arc_length.array() + way.arc_length(before - 1) + gap).matrix();
  return line;
}

/// Where a line, from an arc length on, leaves the trunk's spheres; `arc` where it never does.
double find_ostium_arc(const Centerline& line, double arc, const Centerline& trunk) {
  for (Eigen::Index k = segment_at(line, arc); k < line.points.cols(); ++k) {
    const preprocess::PathPlace place = preprocess::find_place(line.points.col(k), trunk);
    if (place.from_axis > place.radius) return line.arc_length(k);
  }
  return arc;
}

Vec3 chord(const Centerline& line, double from, double to) {
  return (point_at(line, to) - point_at(line, from)).normalized();
}

/// Direction of a line beyond an arc length where it is an ostium, in which it still sways.
Vec3 direction_beyond(const Centerline& line, double ostium) {
  constexpr double kLeast = 1.0;  // a stub shorter than that tells no direction           [mm]
  const double length = length_of(line), wanted = std::max(6.0, 3.0 * radius_at(line, ostium));
  const double start = length - ostium < kLeast ? std::max(0.0, length - wanted) : ostium;
  const double reach = std::min(wanted, length - start);
  return chord(line, start + reach / 6.0, start + reach * 5.0 / 6.0);
}

/// The vessel that another leaves, along the way; one that the way enters, or starts in the middle
/// of, begins elsewhere.
struct Trunk {
  Centerline line;
  bool entered = false;
};

/// How far along the way it is to the level of a place beside the trunk, which the way comes along
/// to `arc` or turns off there.
double find_level(const Centerline& way, double arc, const Trunk& of, const Vec3& p) {
  const Centerline& trunk = of.line;
  const auto place_of = [&](const Vec3& q) { return preprocess::find_place(q, trunk); };
  // Counted from where the way is on the trunk's axis. Where a branch begins, a line is bent a
  // little off it: a chord is not.
  if (of.entered) {
    // Before the access where the way begins beyond it.
    const preprocess::PathPlace on_way =
        preprocess::find_place(point_at(trunk, place_of(p).arc), way);
    return on_way.arc > 0.0 ? on_way.arc : -on_way.from_axis;
  }
  const double start = preprocess::find_place(trunk.points.col(0), way).arc,
               before = std::max(start, arc - 2.0 * place_of(point_at(way, arc)).radius);
  const preprocess::PathPlace place = place_of(p);
  const Vec3 along = chord(trunk, place.arc - place.radius, place.arc + place.radius);
  return before + place.arc + (p - point_at(trunk, place.arc)).dot(along) -
         place_of(point_at(way, before)).arc;
}

/// The junction at `arc` of the way, where `side` leaves `trunk` beyond `from` of its own: the way
/// itself where it takes the branch.
Junction junction_of(const Centerline& way, double arc, const Trunk& of, const Centerline& side,
                     double from) {
  const Centerline& trunk = of.line;
  const preprocess::PathPlace place = preprocess::find_place(point_at(side, from), trunk);
  const double reach = 2.0 * place.radius, ostium = find_ostium_arc(side, from, trunk);
  Junction junction{.taken = &side == &way};
  junction.level = find_level(way, arc, of, point_at(side, ostium));
  junction.arc = junction.taken ? ostium : junction.level;
  junction.point = point_at(way, junction.arc);
  junction.radius = radius_at(side, ostium);
  junction.trunk_direction = chord(trunk, place.arc - reach, place.arc + reach);
  junction.branch_direction = direction_beyond(side, ostium);
  if (of.entered) {  // onward, as the way goes there
    const Vec3 level = point_at(trunk, preprocess::find_place(point_at(side, ostium), trunk).arc);
    const Vec3 goes = level - point_at(way, junction.level - reach);
    if (goes.dot(junction.trunk_direction) < 0.0) junction.trunk_direction *= -1.0;
  }
  return junction;
}

/// Whether a child of the tree is the trunk where it leaves its parent.
bool is_trunk(const std::vector<Branch>& tree, int child) {
  constexpr double kClearlyWider = 4.0 / 3.0;
  return (simulate::goes_on(tree, child) &&
          simulate::width_over_parent(tree, child) > kClearlyWider) ||
         simulate::goes_straight_on(tree, child);
}

/// The part of a line from its point `first` on, or the same back from its end.
Centerline part_from(const Centerline& line, Eigen::Index first, bool reversed) {
  const Eigen::Index count = line.points.cols() - first;
  Centerline part{
      .points = line.points.rightCols(count), .radius = line.radius.tail(count), .arc_length = {}};
  if (reversed) {
    part.points = part.points.rowwise().reverse().eval();
    part.radius = part.radius.reverse().eval();
  }
  part.arc_length = arc_length_of(part.points);
  return part;
}

/// The vessel that the line of a branch's parent enters or begins in at the fork, whole: along the
/// branch from its end to the fork and on along the parent.
Centerline entered_vessel(const std::vector<Branch>& tree, int fork) {
  const Branch& branch = tree[static_cast<std::size_t>(fork)];
  const Centerline& line = tree[static_cast<std::size_t>(branch.parent)].line;
  const Centerline one = part_from(branch.line, 1, true);
  return joined(one, length_of(one), part_from(line, segment_at(line, branch.parent_arc), false));
}

/// The vessel that a child leaves, past that: its parent, or where that turns off there, up to
/// there and on in the child that is the trunk; behind the place where the parent's line enters a
/// wider vessel, that vessel.
Trunk trunk_at(const std::vector<Branch>& tree, int child) {
  const Branch& branch = tree[static_cast<std::size_t>(child)];
  const Centerline& line = tree[static_cast<std::size_t>(branch.parent)].line;
  const double near = branch.parent_arc - radius_at(line, branch.parent_arc);
  int whole = -1;  // begins behind the way's
  for (std::size_t b = 0; b < tree.size(); ++b) {
    if (tree[b].parent != branch.parent) continue;
    if (tree[b].parent_arc >= near && is_trunk(tree, static_cast<int>(b))) {
      return {joined(line, tree[b].parent_arc, tree[b].line)};
    }
    const bool before = tree[b].parent_arc - simulate::own_start(tree[b]) < branch.parent_arc;
    const bool begins = simulate::is_entered(tree, static_cast<int>(b)) ||
                        simulate::runs_back(tree, static_cast<int>(b));
    if (before && begins) whole = static_cast<int>(b);
  }
  if (whole >= 0) return {.line = entered_vessel(tree, whole), .entered = true};
  return {line};
}

/// Where the way comes into the vessel that it enters at a fork, from `arc` in that vessel back;
/// none where it starts there.
std::optional<double> find_entry(const Centerline& way, double arc, const Centerline& vessel) {
  const auto is_inside = [&](Eigen::Index k) {
    const preprocess::PathPlace place = preprocess::find_place(way.points.col(k), vessel);
    return place.from_axis <= place.radius;
  };
  Eigen::Index k = segment_at(way, arc) + 1;
  while (k > 0 && is_inside(k - 1)) --k;
  if (k == 0) return {};
  return way.arc_length(k);
}

/// Where the way turns out of a branch into a wider vessel, of which `fork` is one way; none where
/// it starts in that.
std::optional<Junction> entry_at(const simulate::Way& of, double arc, int fork, bool takes) {
  constexpr double kLeast = 1.0;  // of the branch, for a direction                        [mm]
  const std::vector<Branch>& tree = of.tree();
  const Centerline& way = of.path();
  const Centerline vessel = entered_vessel(tree, fork);
  const std::optional<double> entry = find_entry(way, arc, vessel);
  if (!entry || *entry < kLeast) return {};
  const int own = tree[static_cast<std::size_t>(fork)].parent;
  const preprocess::PathPlace place = preprocess::find_place(point_at(way, *entry), vessel);
  const double reach = 2.0 * place.radius;
  Junction junction{.trunk = own, .branch = takes ? fork : own, .taken = true};
  junction.entered = true;
  junction.fork = fork;
  junction.arc = *entry;
  junction.level = *entry + place.from_axis;
  junction.point = point_at(way, *entry);
  junction.radius = radius_at(way, *entry);
  const double into = std::min(*entry, std::max(6.0, 3.0 * junction.radius));
  junction.trunk_direction = chord(way, *entry - into * 5.0 / 6.0, *entry - into / 6.0);
  // Onward, as the way goes.
  junction.branch_direction = chord(vessel, place.arc - reach, place.arc + reach);
  const Vec3 goes = point_at(way, junction.level + reach) - point_at(vessel, place.arc);
  if (goes.dot(junction.branch_direction) < 0.0) junction.branch_direction *= -1.0;
  return junction;
}

/// Where the way turns into a branch: from the trunk's axis until it has settled in the branch. Of
/// a vessel that is entered the other way round.
struct Turn {
  double from = 0.0, corner = 0.0, to = 0.0;  // along the way                             [mm]
};

std::vector<Turn> list_turns(const Centerline& way, const std::vector<Junction>& junctions) {
  std::vector<Turn> turns;
  for (const Junction& j : junctions) {
    const double free = turns.empty() ? 0.0 : turns.back().to;
    const Turn turn{std::max(free, std::min(j.level, j.arc) - j.radius), j.level,
                    std::max(j.level, j.arc) + j.radius};
    if (j.taken && turn.from < turn.to && turn.to < length_of(way)) turns.push_back(turn);
  }
  return turns;
}

/// A line on which each turn into a branch is a corner.
struct Unfolded {
  std::vector<Vec3> points;
  std::vector<double> arc;  // of the points, along the way                            [mm]
  std::vector<bool> is_corner;
};

/// The way without its turns, what follows one moved up to what is before.
Unfolded unfold(const Centerline& way, const std::vector<Turn>& turns) {
  Unfolded line;
  const auto add = [&](const Vec3& point, double arc, bool is_corner) {
    line.points.push_back(point);
    line.arc.push_back(arc);
    line.is_corner.push_back(is_corner);
  };
  Vec3 moved = Vec3::Zero();
  double done = -1.0;
  auto turn = turns.begin();
  for (Eigen::Index k = 0; k < way.points.cols(); ++k) {
    const double arc = way.arc_length(k);
    for (; turn != turns.end() && turn->from <= arc; ++turn) {
      add(point_at(way, turn->from) + moved, turn->corner, true);
      moved += point_at(way, turn->from) - point_at(way, turn->to);
      done = turn->to;
    }
    if (arc > done) add(way.points.col(k) + moved, arc, false);
  }
  return line;
}

/// Without radii.
Centerline line_through(const std::vector<Vec3>& points) {
  const auto count = static_cast<Eigen::Index>(points.size());
  Centerline line{.points = Eigen::Matrix3Xd(3, count), .radius = {}, .arc_length = {}};
  for (Eigen::Index k = 0; k < count; ++k) {
    line.points.col(k) = points[static_cast<std::size_t>(k)];
  }
  line.arc_length = arc_length_of(line.points);
  return line;
}

/// The corner of a line at an arc length, with arms of so much of it: `near` to `far` from there.
Corner corner_at(const Centerline& line, double arc, double near, double far) {
  Corner corner;
  corner.before = chord(line, arc - far, arc - near);
  corner.behind = chord(line, arc + near, arc + far);
  corner.angle =
      kPi - std::atan2(corner.before.cross(corner.behind).norm(), corner.before.dot(corner.behind));
  return corner;
}

/// Whether the way goes there from one leg into the other of two that meet in a wider vessel.
bool crosses(const std::vector<Branch>& tree, const Junction& junction) {
  const int own = tree[static_cast<std::size_t>(junction.fork)].parent;
  const simulate::Bifurcation fork{own, junction.fork, junction.trunk == junction.fork};
  return junction.taken && !junction.entered && simulate::bifurcation_width(tree, fork);
}

/// Direction of the way where it has not yet come to the fork of a junction.
Vec3 direction_before(const Centerline& way, const Junction& junction) {
  const double fork = std::max(0.0, junction.level - radius_at(way, junction.level));
  return chord(way, fork - std::max(10.0, 4.0 * radius_at(way, fork)), fork);
}

/// The branches, the given one too, at which the vessel that it leaves parts within the ball of the
/// fork.
std::vector<int> list_parts(const std::vector<Branch>& tree, int child) {
  const Branch& branch = tree[static_cast<std::size_t>(child)];
  std::vector<int> parts;
  for (std::size_t b = 0; b < tree.size(); ++b) {
    if (tree[b].parent != branch.parent) continue;
    const double apart = std::abs(tree[b].parent_arc - branch.parent_arc);
    const int other = static_cast<int>(b);
    if (apart <= simulate::own_start(branch) && simulate::parts(tree, other))
      parts.push_back(other);
  }
  return parts;
}

/// Whether none of those is before it along the line that it leaves.
bool is_first_part(const std::vector<Branch>& tree, int child) {
  const auto place = [&](int part) {
    return std::pair(tree[static_cast<std::size_t>(part)].parent_arc, part);
  };
  const std::vector<int> parts = list_parts(tree, child);
  return std::none_of(parts.begin(), parts.end(),
                      [&](int part) { return place(part) < place(child); });
}

/// Where the trunk parts at `arc` of the way, which goes on along the tree's line: as it turns into
/// a branch, since either of the two may be the line's.
Junction part_at(const Centerline& way, double arc, const std::vector<Branch>& tree, int fork) {
  const Branch& branch = tree[static_cast<std::size_t>(fork)];
  Junction junction{.trunk = branch.parent, .branch = branch.parent, .taken = true};
  junction.fork = fork;
  junction.level = arc;
  junction.arc = std::min(arc + simulate::own_start(branch), length_of(way));
  junction.point = point_at(way, junction.arc);
  junction.radius = radius_at(way, junction.arc);
  junction.trunk_direction = direction_before(way, junction);
  junction.branch_direction = direction_beyond(way, junction.arc);
  return junction;
}

/// At `arc` of the way, where `child` leaves the tree's branch that the way comes along, for the
/// child where that is what the way takes. None where the other of the two is a stump.
std::optional<Junction> junction_at(const simulate::Way& of, double arc, int child, bool takes) {
  const std::vector<Branch>& tree = of.tree();
  const Centerline& way = of.path();
  const Branch& branch = tree[static_cast<std::size_t>(child)];
  const int own = branch.parent;
  const Centerline& line = tree[static_cast<std::size_t>(own)].line;
  const Trunk trunk = trunk_at(tree, child);
  if (simulate::is_entered(tree, child)) return entry_at(of, arc, child, takes);
  const bool goes_on = is_trunk(tree, child);
  Junction junction;
  if (!takes) {
    if (simulate::is_stump(tree, child)) return {};
    // The way leaves the child where that is the trunk.
    junction = goes_on ? junction_of(way, arc, trunk, way, arc)
                       : junction_of(way, arc, trunk, branch.line, 0.0);
  } else if (goes_on) {
    // The way stays in the trunk, and what goes on of the tree's branch leaves it.
    if (simulate::ends_soon(line, branch.parent_arc + simulate::own_start(branch))) return {};
    junction = junction_of(way, arc, trunk, line, branch.parent_arc);
  } else {
    junction = junction_of(way, arc, trunk, way, arc);
  }
  junction.trunk = goes_on ? child : own;
  junction.branch = goes_on ? own : child;
  const std::optional<simulate::Bifurcation>& fork = of.bifurcation();
  junction.fork = child;
  const bool across = crosses(tree, junction);
  junction.bifurcation = across || (fork && fork->child == child);
  if (across || (takes && !goes_on && !list_parts(tree, child).empty())) {
    junction.trunk_direction = direction_before(way, junction);
  }
  return junction;
}

/// Makes one turn of two at one level: of the way into a stem without length, and out of that.
void join_turns(std::vector<Junction>& junctions) {
  for (std::size_t k = 1; k < junctions.size();) {
    const Junction& stem = junctions[k - 1];
    Junction& own = junctions[k];
    const bool turns = stem.taken && own.taken && !stem.entered && !own.entered &&
                       !stem.bifurcation && !own.bifurcation && stem.trunk != stem.branch;
    if (!turns || own.trunk != stem.branch || own.level != stem.level) {
      ++k;
      continue;
    }
    own.trunk = stem.trunk;
    own.trunk_direction = stem.trunk_direction;
    junctions.erase(junctions.begin() + static_cast<std::ptrdiff_t>(k) - 1);
  }
}

}  // namespace

double length_of(const Centerline& line) { return line.arc_length(line.arc_length.size() - 1); }

LinePart find_part(const Centerline& line, double arc) {
  expects(line.points.cols() >= 2);
  const Eigen::Index k = segment_at(line, arc);
  const double step = line.arc_length(k + 1) - line.arc_length(k);
  return {k, step > 0.0 ? std::clamp((arc - line.arc_length(k)) / step, 0.0, 1.0) : 0.0};
}

double turn_of(const Junction& junction) {
  const double cosine = junction.trunk_direction.dot(junction.branch_direction);
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

std::string leaving_name(const std::vector<preprocess::Branch>& tree, const Junction& junction) {
  const bool goes_on = tree[static_cast<std::size_t>(junction.fork)].parent == junction.branch;
  const double begins = goes_on
                            ? simulate::begins_behind(tree, junction.fork)
                            : simulate::own_start(tree[static_cast<std::size_t>(junction.branch)]);
  std::string name = branch_name(tree, junction.branch, begins);
  const std::string number = "branch " + std::to_string(junction.branch + 1);
  if (junction.entered && name == number) return "the wider vessel (" + number + ")";
  // The trunk parts, and the way's own part has no other name than the trunk.
  if (junction.trunk != junction.branch || name != trunk_name(tree, junction)) return name;
  const double other = simulate::own_start(tree[static_cast<std::size_t>(junction.fork)]);
  return name + ", past " + branch_name(tree, junction.fork, other);
}

std::string trunk_name(const std::vector<preprocess::Branch>& tree, const Junction& junction) {
  const Branch& fork = tree[static_cast<std::size_t>(junction.fork)];
  const bool along = junction.trunk == fork.parent || crosses(tree, junction);
  if (!along) return branch_name(tree, junction.trunk, 0.0);
  const double before = fork.parent_arc - simulate::own_start(fork) - 1.0;  // of its ball    [mm]
  return branch_name(tree, fork.parent, std::max(0.0, before));
}

Vec3 point_at(const Centerline& line, double arc) {
  const auto [k, part] = find_part(line, arc);
  return (1.0 - part) * line.points.col(k) + part * line.points.col(k + 1);
}

Narrowest find_narrowest(const Centerline& way, double length) {
  const double end = length_of(way);
  Eigen::Index narrowest = -1;
  for (const bool ends_too : {false, true}) {
    for (Eigen::Index k = 0; k < way.points.cols(); ++k) {
      const double arc = way.arc_length(k), radius = way.radius(k);
      if (arc > length || (!ends_too && (arc < radius || end - arc < radius))) continue;
      if (narrowest < 0 || radius < way.radius(narrowest)) narrowest = k;
    }
    if (narrowest >= 0) break;
  }
  expects(narrowest >= 0);
  return {2.0 * way.radius(narrowest), way.arc_length(narrowest), way.points.col(narrowest)};
}

double tortuosity(const Centerline& way) {
  const Vec3 start = way.points.col(0), end = way.points.col(way.points.cols() - 1);
  return std::max(1.0, length_of(way) / (end - start).norm());  // rounding of a straight line
}

Corner find_sharpest_bend(const Centerline& way, const std::vector<Junction>& junctions,
                          double arm) {
  // A middle line rounds a corner: the arms there would take several degrees off.
  constexpr double kRounded = 0.15, kShortest = 0.3;  // parts of an arm
  const Unfolded unfolded = unfold(way, list_turns(way, junctions));
  const Centerline line = line_through(unfolded.points);
  const double length = length_of(line);
  arm = std::min(arm, length / 3.0);

  std::size_t found = 0;
  double least = kPi;
  for (std::size_t k = 0; k < unfolded.points.size(); ++k) {
    const double arc = line.arc_length(static_cast<Eigen::Index>(k));
    const double shortest = unfolded.is_corner[k] ? kShortest * arm : arm;
    if (std::min(arc, length - arc) < shortest) continue;
    const double angle = corner_at(line, arc, 0.0, arm).angle;
    if (angle >= least) continue;
    least = angle;
    found = k;
  }
  Corner sharpest;
  if (least < kPi) {
    sharpest = corner_at(line, line.arc_length(static_cast<Eigen::Index>(found)), kRounded * arm,
                         (1.0 - kRounded) * arm);
    sharpest.arc = unfolded.arc[found];
    sharpest.point = point_at(way, sharpest.arc);
  }
  sharpest.arm = arm;
  return sharpest;
}

std::vector<Junction> find_junctions(const simulate::Way& of) {
  const Centerline& way = of.path();
  const std::vector<Branch>& tree = of.tree();
  const Vec3 end = way.points.col(way.points.cols() - 1);
  constexpr double kFacing = 1.0;  // two ostia that differ by less are at one level        [mm]
  const std::vector<int> chain = of.branches();
  std::vector<Junction> junctions;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    // The stretch of the branch that the way goes along.
    const int own = chain[k];
    const int next = k + 1 < chain.size() ? chain[k + 1] : -1;
    const Centerline& line = tree[static_cast<std::size_t>(own)].line;
    const double left_at = next >= 0 ? tree[static_cast<std::size_t>(next)].parent_arc
                                     : preprocess::find_place(end, line).arc;

    // A branch that faces the one that the way takes may begin a little later.
    const bool turns = next >= 0 && !is_trunk(tree, next) && !simulate::is_entered(tree, next) &&
                       !simulate::runs_back(tree, next);
    const double last = turns ? left_at + 2.0 * radius_at(line, left_at) : left_at;

    std::vector<Junction> here;
    double level = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < tree.size(); ++b) {
      const int child = static_cast<int>(b);
      if (tree[b].parent != own || tree[b].parent_arc > last) continue;
      if (simulate::runs_back(tree, child)) continue;
      const bool ends_trunk = is_trunk(tree, child) || simulate::is_entered(tree, child);
      if (tree[b].parent_arc > left_at && ends_trunk) continue;
      const double arc = preprocess::find_place(point_at(line, tree[b].parent_arc), way).arc;
      const bool stays = left_at > tree[b].parent_arc + simulate::own_start(tree[b]);
      const bool parts = stays && simulate::parts(tree, child) && is_first_part(tree, child);
      const std::optional<Junction> junction =
          parts ? part_at(way, arc, tree, child) : junction_at(of, arc, child, child == next);
      if (!junction) continue;
      here.push_back(*junction);
      if (turns && child == next) level = junction->level;
    }
    // The stem that it branches from comes before it: where that is short their ostia overlap.
    std::stable_partition(here.begin(), here.end(),
                          [&](const Junction& junction) { return junction.fork != next; });
    double stem = 0.0;
    for (Junction& junction : here) {
      if (!junction.taken && junction.level > level + kFacing) continue;
      if (!junction.taken) junction.level = junction.arc = std::min(junction.level, level);
      if (junction.fork == next) junction.level = std::max(junction.level, stem);
      if (junction.taken) stem = std::max(stem, junction.level);
      junctions.push_back(junction);
    }
  }
  // What is no place of the way: the target may lie before the level of its branch's ostium.
  std::erase_if(junctions, [&](const Junction& junction) {
    return !junction.taken && (junction.level < 0.0 || junction.level > length_of(way));
  });
  for (Junction& junction : junctions) {
    junction.level = std::clamp(junction.level, 0.0, length_of(way));
  }
  std::stable_sort(junctions.begin(), junctions.end(), [](const Junction& a, const Junction& b) {
    return std::tie(a.level, a.taken) < std::tie(b.level, b.taken);
  });
  join_turns(junctions);
  return junctions;
}

}  // namespace wireplan::plan
