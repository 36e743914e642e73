#include "preprocess/centerline/centerline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "preprocess/centerline/branch_start.h"
#include "preprocess/centerline/grid_search.h"
#include "preprocess/centerline/nearest_wall.h"
#include "preprocess/centerline/section_width.h"
#include "preprocess/surface/surface.h"

namespace wireplan::preprocess {
namespace {

// The search grid starts with about this many nodes in the lumen, and is halved down to this
// spacing [mm] where the lumen is too thin for it. That of the tree, which is not, starts finer.
constexpr double kNodesWanted = 20e3, kTreeNodesWanted = 80e3, kFinestGrid = 0.12;
// A search of so many nodes is not made again at half the spacing: it would need eight times as
// many, more than kMostNodes.
constexpr std::size_t kTooManyToHalve = 1'000'000;
constexpr std::size_t kFewPoints = 5;  // fewer have no direction
constexpr int kRounds = 2;             // of moving to the ridge and smoothing
// Smoothing along the line, as part of the inscribed radius. It shortens the radius r of a bend by
// sigma^2/(2r): in a bend as sharp as r = 3 R, by 0.24 % of R.
constexpr double kSmoothing = 0.12;

// -------------------------------------------------------------------------------- the search

void require_inside(const Surface& surface, const std::string& name, const Vec3& point) {
  constexpr double kOnTheWall = 1e-6;  // mm
  const InsideAnswer answer = locate_point(surface, point);
  if (answer.inside && answer.distance > kOnTheWall) return;
  throw Error(name + " " + place_text(point) + " mm lies outside the vessel surface, " +
              number_text(answer.distance) +
              " mm from the wall; expected a point in the lumen. Move it inward, or check that "
              "point and surface share one frame (LPS, mm)");
}

struct RawPath {
  Points points;         // access to target, inside the lumen all the way
  double spacing = 0.0;  // of the grid it was found on
};

/// Searches from the target, which mostly lies in the thinner vessel: then most of the wide one is
/// never visited.
RawPath search_path(const NearestWall& wall, const Surface& surface, const Vec3& access,
                    const Vec3& target, const Points& way, double first_spacing) {
  const auto search_on = [&](double spacing, const Vec3& from, const Vec3& to) {
    const double depth = 2.0 * spacing;  // there every ball meets the grid
    return GridSearch(wall, surface, spacing, leave_wall(wall, from, depth),
                      leave_wall(wall, to, depth));
  };
  const auto middle_of = [](GridSearch& search) {
    search.stay_near(search.path());
    expects(search.run(Cost::kMiddle));  // the route itself is such a path
    return RawPath{.points = search.path(), .spacing = search.spacing()};
  };
  double spacing = first_spacing;
  for (;; spacing *= 0.5) {
    GridSearch search = search_on(spacing, target, access);
    if (search.run(Cost::kRoute)) {
      const Guide guide(wall, way);
      if (guide.departure_of(search.path())) {
        for (double finer = spacing; finer >= kFinestGrid; finer *= 0.5) {
          GridSearch along = search_on(finer, target, access);
          along.follow(guide);
          if (along.run(Cost::kRoute)) return middle_of(along);
          if (along.count() > kTooManyToHalve) break;
        }
      }
      return middle_of(search);
    }
    if (0.5 * spacing < kFinestGrid || search.count() > kTooManyToHalve) break;
  }

  // Not connected: the user sees how far one comes from the access, on the first grid.
  GridSearch search = search_on(first_spacing, access, target);
  search.run(Cost::kRoute);
  const Vec3 reached = search.nearest_reached(target);
  throw Error("target " + place_text(target) + " mm is not connected to access " +
              place_text(access) + " mm inside the vessel surface (finest search grid " +
              number_text(spacing) + " mm): the nearest place reached, " + place_text(reached) +
              " mm, is " + number_text((target - reached).norm()) +
              " mm from the target, expected a lumen that is open there; look whether the band of "
              "the segmentation cuts the vessel there, or the surface's pieces hardly touch: mend "
              "it there, or move the target");
}

// ---------------------------------------------------------------------------------- the ridge

std::vector<double> arc_length(const Points& line) {
  std::vector<double> s(line.size(), 0.0);
  for (std::size_t i = 1; i < line.size(); ++i) s[i] = s[i - 1] + (line[i] - line[i - 1]).norm();
  return s;
}

/// Equally spaced points from end to end, about `sample` apart, at least two.
Points resample(const Points& line, double sample) {
  const std::vector<double> s = arc_length(line);
  const int intervals = std::max(1, static_cast<int>(std::lround(s.back() / sample)));
  Points points;
  std::size_t i = 1;
  for (int k = 0; k <= intervals; ++k) {
    const double at = s.back() * k / intervals;
    while (i + 1 < s.size() && s[i] < at) ++i;
    const double length = s[i] - s[i - 1];
    const double f = length > 0.0 ? std::clamp((at - s[i - 1]) / length, 0.0, 1.0) : 0.0;
    points.push_back((1.0 - f) * line[i - 1] + f * line[i]);
  }
  return points;
}

/// Width of a Gaussian along the line: sigma = max(least, part of the inscribed radius).
struct Smoothing {
  double least = 0.0;  // [mm]
  double part = 0.0;
};

/// Gaussian smoothing of points that are `sample` apart. The window is symmetric and shrinks toward
/// the ends, which stay. A point that would leave its inscribed ball, and so perhaps the lumen,
/// stays as well.
Points smooth(const NearestWall& wall, const Points& line, double sample,
              const Smoothing& smoothing) {
  const int n = static_cast<int>(line.size());
  const auto at = [&](int i) -> const Vec3& { return line[static_cast<std::size_t>(i)]; };
  Points result = line;
  Nearest near = wall.find(line.front());
  for (int i = 1; i + 1 < n; ++i) {
    near = wall.find(at(i), near);
    const double sigma = std::max(smoothing.least, smoothing.part * near.distance) / sample;
    const int half = std::min({static_cast<int>(std::ceil(3.0 * sigma)), i, n - 1 - i});
    Vec3 sum = at(i);
    double weights = 1.0;
    for (int k = 1; k <= half; ++k) {
      const double weight = std::exp(-0.5 * k * k / (sigma * sigma));
      sum += weight * (at(i - k) + at(i + k));
      weights += 2.0 * weight;
    }
    const Vec3 moved = sum / weights;
    if ((moved - at(i)).norm() < 0.9 * near.distance) result[static_cast<std::size_t>(i)] = moved;
  }
  return result;
}

/// Steps of a climb, the first as a part of the inscribed radius. The first climb reaches 1.25
/// radii, later ones mend what smoothing moved.
struct Climb {
  double first_step = 0.25;
  int steps = 25;
};
constexpr Climb kFirstClimb{}, kLaterClimb{.first_step = 0.08, .steps = 16};

/// Ascends the wall distance in the plane through `point` across `tangent`, by steps along the
/// gradient that shrink geometrically (it jumps at the ridge, so its length tells nothing). Never
/// leaves the ball that is known to be free. `near` is a hint and is updated.
Vec3 climb(const NearestWall& wall, Vec3 point, const Vec3& tangent, Nearest& near,
           const Climb& how = kFirstClimb) {
  constexpr double kDecay = 0.8;
  near = wall.find(point, near);
  Nearest here = near;
  Vec3 best = point;
  double step = how.first_step * here.distance;
  for (int i = 0; i < how.steps && here.distance > 0.0; ++i, step *= kDecay) {
    const Vec3 gradient = (point - here.foot) / here.distance;
    const Vec3 across = gradient - gradient.dot(tangent) * tangent;
    point += std::min(step, 0.9 * here.distance) * across;
    here = wall.find(point, here);
    if (here.distance <= near.distance) continue;
    near = here;
    best = point;
  }
  return best;
}

/// Direction of the line at point i, over some points on both sides.
Vec3 tangent_at(const Points& line, std::size_t i) {
  constexpr std::size_t kSpan = 3;
  const std::size_t from = i < kSpan ? 0 : i - kSpan, to = std::min(line.size() - 1, i + kSpan);
  return (line[to] - line[from]).normalized();
}

Points move_to_ridge(const NearestWall& wall, const Points& line, const Climb& how) {
  Points moved;
  Nearest near = wall.find(line.front());
  for (std::size_t i = 0; i < line.size(); ++i) {
    moved.push_back(climb(wall, line[i], tangent_at(line, i), near, how));
  }
  return moved;
}

/// Without its two ends, where the path still climbs from access and target to the ridge: what is
/// within one inscribed radius of an end. A path too short for that is kept.
Points without_ends(const NearestWall& wall, const Points& line) {
  const std::vector<double> s = arc_length(line);
  std::size_t first = 0, last = line.size() - 1;
  while (first < last && s[first] < wall.find(line[first]).distance) ++first;
  while (first < last && s.back() - s[last] < wall.find(line[last]).distance) --last;
  if (last - first < 4) return line;
  return {line.begin() + static_cast<std::ptrdiff_t>(first),
          line.begin() + static_cast<std::ptrdiff_t>(last) + 1};
}

/// Without its last 1.5 radii: the way to the farthest place of an end, mostly a cap's corner,
/// leaves the middle where the cap is as near as the side. A line too short for that is kept.
Points without_tip(const NearestWall& wall, const Points& line) {
  constexpr double kRadii = 1.5;
  const std::vector<double> s = arc_length(line);
  std::size_t last = line.size() - 1;
  while (last > 0 && s.back() - s[last] < kRadii * wall.find(line[last]).distance) --last;
  last = std::max(last, std::min(kFewPoints, line.size()) - 2);
  return {line.begin(), line.begin() + static_cast<std::ptrdiff_t>(last) + 1};
}

/// Continues the line along the ridge beyond its last point, in steps of `sample`, until
/// done(direction) or the wall is ahead. Where the nearest wall is a cap ahead, the distance says
/// nothing about the middle, and the line goes straight on.
template <class Done>
void extend_until(const NearestWall& wall, Points& line, double sample, int most_steps,
                  const Done& done) {
  constexpr std::size_t kSpan = 8;    // points whose chord is the direction
  constexpr double kCapAhead = -0.5;  // slope of the distance along the line, -1 before a flat cap
  Nearest near = wall.find(line.back());
  for (int i = 0; i < most_steps; ++i) {
    const std::size_t back = line.size() - 1 - std::min(kSpan, line.size() - 1);
    const Vec3 tangent = (line.back() - line[back]).normalized();
    if (done(tangent) || near.distance <= sample) return;
    const Vec3 next = line.back() + sample * tangent;
    near = wall.find(next, near);
    const bool cap_ahead = (next - near.foot).dot(tangent) < kCapAhead * near.distance;
    line.push_back(cap_ahead ? next : climb(wall, next, tangent, near));
  }
}

/// Until it has passed `end`.
void extend(const NearestWall& wall, Points& line, const Vec3& end, double sample) {
  extend_until(wall, line, sample, 10 + static_cast<int>(2.0 * (end - line.back()).norm() / sample),
               [&](const Vec3& tangent) { return (end - line.back()).dot(tangent) <= 0.0; });
}

/// By a length. Throws Error where the vessel ends before.
void extend_beyond(const NearestWall& wall, Points& line, double length, double sample) {
  double gone = 0.0;
  std::size_t last = line.size() - 1;
  extend_until(wall, line, sample, 10 + static_cast<int>(2.0 * length / sample), [&](const Vec3&) {
    for (; last + 1 < line.size(); ++last) gone += (line[last + 1] - line[last]).norm();
    return gone >= length;
  });
  if (gone >= length) {  // back by what the last step went too far
    const Vec3 step = line.back() - line[line.size() - 2];
    line.back() -= (gone - length) * step.normalized();
    return;
  }
  throw Error("the vessel ends " + number_text(std::floor(gone)) +
              " mm beyond the target; give a target.beyond_mm below that (" + number_text(length) +
              " mm was asked)");
}

/// The same straight on to the wall ahead: for an end that lies in a corner of a cap, to which the
/// ridge would lead.
void extend_straight(const NearestWall& wall, Points& line, const Vec3& end, double sample) {
  constexpr double kSpan = 3.0, kAtWall = 0.2;  // radii whose chord is the direction; of wall ahead
  const double radius = wall.find(line.back()).distance, at_wall = kAtWall * radius;
  const auto span = static_cast<std::size_t>(std::max(2.0, std::round(kSpan * radius / sample)));
  const std::size_t back = line.size() - 1 - std::min(span, line.size() - 1);
  const Vec3 tangent = (line.back() - line[back]).normalized();
  const double step = std::min(sample, at_wall);
  while ((end - line.back()).dot(tangent) > 0.0) {
    const Vec3 next = line.back() + step * tangent;
    if (wall.find(next).distance < at_wall) break;
    line.push_back(next);
  }
}

/// Ends the line at its place nearest to `end`, which is sought no farther back than it can be when
/// the line ends abreast of it: one that comes by `end` earlier, in another vessel, is not cut
/// there.
void cut_after(Points& line, const Vec3& end, double sample) {
  const double reach = 2.0 * (line.back() - end).norm() + sample;
  std::size_t best = line.size() - 1;
  Vec3 foot = line.back();
  double walked = 0.0;
  for (std::size_t i = line.size() - 1; i > 0 && walked < reach; --i) {
    const Vec3 a = line[i - 1], edge = line[i] - a;
    const double length = edge.norm();
    if (length == 0.0) continue;
    walked += length;
    const Vec3 q = a + std::clamp((end - a).dot(edge) / (length * length), 0.0, 1.0) * edge;
    if ((q - end).norm() < (foot - end).norm()) {
      best = i;
      foot = q;
    }
  }
  line.resize(best);
  line.push_back(foot);
}

/// Radii near the line's ends, where the nearest wall is a cap across it: those of the next point
/// that is nearer to the side. `inward` is 1 from the first point on, -1 from the last.
void mend_radii_at_cap(const NearestWall& wall, Centerline& line, int inward) {
  constexpr double kAcross = 0.5;    // cosine between the line and the way to the wall
  constexpr Eigen::Index kSpan = 8;  // points whose chord is the line's direction
  const Eigen::Index n = line.points.cols(), first = inward > 0 ? 0 : n - 1;
  const Vec3 end = line.points.col(first);
  const Vec3 outward =
      (end - line.points.col(first + inward * std::min(kSpan, n - 1))).normalized();
  Nearest near = wall.find(end);
  Eigen::Index i = first;
  for (; i >= 0 && i < n; i += inward) {
    const Vec3 p = line.points.col(i);
    near = wall.find(p, near);
    if ((near.foot - p).dot(outward) < kAcross * near.distance) break;
  }
  if (i < 0 || i >= n) return;  // all of it: a line shorter than the lumen is wide
  for (Eigen::Index k = first; k != i; k += inward) line.radius(k) = line.radius(i);
}

/// Arc length and inscribed radius of a line.
Centerline measured(const NearestWall& wall, const Points& line) {
  const auto n = static_cast<Eigen::Index>(line.size());
  const std::vector<double> s = arc_length(line);
  Centerline result{.points = Eigen::Matrix3Xd(3, n),
                    .radius = Eigen::VectorXd(n),
                    .arc_length = Eigen::Map<const Eigen::VectorXd>(s.data(), n)};
  Nearest near = wall.find(line.front());
  for (Eigen::Index i = 0; i < n; ++i) {
    result.points.col(i) = line[static_cast<std::size_t>(i)];
    near = wall.find(result.points.col(i), near);
    result.radius(i) = near.distance;
  }
  if (n > 1) {
    mend_radii_at_cap(wall, result, 1);
    mend_radii_at_cap(wall, result, -1);
  }
  return result;
}

double first_spacing(const Surface& surface, double nodes_wanted,
                     const CenterlineOptions& options) {
  return options.grid_mm > 0.0 ? options.grid_mm
                               : grid_spacing(std::abs(signed_volume(surface)), nodes_wanted);
}

// ---------------------------------------------------------------------------------- the tree

/// A way through the grid from the tree to an end, as numbers of nodes.
struct Twig {
  std::vector<int> nodes;  // the first one is in the tree already, but for the first twig
  int parent = -1;         // twig of that node
};

void refuse_bush(const GridSearch& search, const std::vector<Twig>& twigs) {
  const auto end_of = [&](const Twig& twig) {
    return place_text(search.at(static_cast<std::size_t>(twig.nodes.back())).point);
  };
  throw Error("the lumen has over " + std::to_string(twigs.size() - 1) + " dead ends, from " +
              end_of(twigs.front()) + " to " + end_of(twigs.back()) +
              " mm: an organ, the skin of a body or noise, expected a tree of vessels; take a "
              "narrower band (segmentation.lower_hu, upper_hu), raise segmentation.smoothing_mm or "
              "neck_opening_mm, or smooth the surface, so that arteries alone are left");
}

/// The ends of the lumen and the ways there, the farthest first.
std::vector<Twig> find_twigs(GridSearch& search) {
  constexpr double kCovered = 1.5;         // radii round a line that belong to it
  constexpr std::size_t kMostTwigs = 500;  // real trees have up to 50; each costs some 0.05 s
  search.run_everywhere(Cost::kRoute);
  std::vector<std::pair<double, int>> farthest_first;
  for (std::size_t i = 2; i < search.count(); ++i) {
    const Node& n = search.at(i);
    if (std::isfinite(n.cost) && n.wall.distance > 0.5 * search.spacing()) {
      farthest_first.emplace_back(-n.cost, static_cast<int>(i));
    }
  }
  std::sort(farthest_first.begin(), farthest_first.end());
  search.run_everywhere(Cost::kMiddle);

  std::vector<Twig> twigs;
  std::vector<char> covered(search.count(), 0);
  std::vector<int> owner(search.count(), -1);  // twig that passes a node
  for (const auto& [cost, end] : farthest_first) {
    if (covered[static_cast<std::size_t>(end)] != 0) continue;
    Twig twig;
    int at = end;
    for (; at >= 0 && owner[static_cast<std::size_t>(at)] < 0;
         at = search.at(static_cast<std::size_t>(at)).parent) {
      twig.nodes.push_back(at);
    }
    if (at >= 0) {
      twig.parent = owner[static_cast<std::size_t>(at)];
      twig.nodes.push_back(at);
    }
    std::reverse(twig.nodes.begin(), twig.nodes.end());

    // What it covers is no end again; whether it is long enough to be a vessel is another question.
    double length = 0.0;
    GridBall before;
    for (std::size_t k = 0; k < twig.nodes.size(); ++k) {
      const Node& n = search.at(static_cast<std::size_t>(twig.nodes[k]));
      if (k > 0) {
        length += (n.point - search.at(static_cast<std::size_t>(twig.nodes[k - 1])).point).norm();
      }
      const GridBall ball{.center = n.point,
                          .radius = kCovered * n.wall.distance + 2.0 * search.spacing()};
      search.visit_ball(ball, before,
                        [&](int near) { covered[static_cast<std::size_t>(near)] = 1; });
      before = ball;
    }
    const double from = search.at(static_cast<std::size_t>(twig.nodes.front())).wall.distance;
    std::vector<double> radii;
    for (const int n : twig.nodes)
      radii.push_back(search.at(static_cast<std::size_t>(n)).wall.distance);
    const double widest = median(std::move(radii));
    if (twig.parent >= 0 && length < from + widest + 2.0 * search.spacing()) continue;
    const int number = static_cast<int>(twigs.size());
    for (std::size_t k = twig.parent >= 0 ? 1 : 0; k < twig.nodes.size(); ++k) {
      owner[static_cast<std::size_t>(twig.nodes[k])] = number;
    }
    twigs.push_back(std::move(twig));
    if (twigs.size() > kMostTwigs) refuse_bush(search, twigs);
  }
  return twigs;
}

/// The way along a twig to the node that another begins at, and on along that; the other's own
/// where there is none.
std::vector<int> joined(const std::vector<int>& twig, const std::vector<int>& other) {
  std::vector<int> nodes(twig.begin(), std::find(twig.begin(), twig.end(), other.front()));
  if (nodes.size() == twig.size()) nodes.clear();
  nodes.insert(nodes.end(), other.begin(), other.end());
  return nodes;
}

/// Whether a branch runs in its parent's lumen all along: an edge of a lumen that is not round, as
/// that of a dissected aorta, whose ridge ends aside.
bool runs_in_parent(const Surface& surface, const Branch& branch,
                    const std::vector<Branch>& branches) {
  const Centerline& line = branch.line;
  const Centerline& parent = branches[static_cast<std::size_t>(branch.parent)].line;
  const Eigen::Index last = line.points.cols() - 1;
  const double start = line.radius(0), end = line.arc_length(last) - 0.3 * line.radius(last);
  for (const double part : {1.0, 0.5, 0.25, 0.75}) {  // the end, where most differ, first
    const double at = start + part * (end - start);
    if (at <= 0.0) continue;
    Eigen::Index k = 0;
    while (k < last && line.arc_length(k) < at) ++k;
    if (!shares_section(surface, line, k, parent)) return false;
  }
  return true;
}

}  // namespace

std::vector<Branch> find_tree(const Surface& surface, const Vec3& root,
                              const CenterlineOptions& options) {
  expects(options.sample_mm > 0.0 && options.grid_mm >= 0.0);
  require_inside(surface, "access", root);
  const NearestWall wall(surface);
  const double spacing = first_spacing(surface, kTreeNodesWanted, options),
               sample = options.sample_mm;
  const Vec3 inside = leave_wall(wall, root, 2.0 * spacing);
  GridSearch search(wall, surface, spacing, inside, inside);

  std::vector<Branch> branches;
  std::vector<int> branch_of;  // of each twig; its parent's where it is none itself
  const std::vector<Twig> twigs = find_twigs(search);
  std::vector<std::vector<int>> edges(twigs.size());  // nodes of twigs that are edges of a lumen
  for (std::size_t t = 0; t < twigs.size(); ++t) {
    const Twig& twig = twigs[t];
    const int parent = twig.parent < 0 ? -1 : branch_of[static_cast<std::size_t>(twig.parent)];
    const std::vector<int> nodes =
        twig.parent < 0 ? twig.nodes
                        : joined(edges[static_cast<std::size_t>(twig.parent)], twig.nodes);
    Points line;
    for (const int n : nodes) line.push_back(search.at(static_cast<std::size_t>(n)).point);
    const Vec3 end = line.back();
    line = smooth(wall, resample(line, sample), sample, {.least = 2.0 * spacing});
    line = without_tip(wall, without_ends(wall, line));
    if (parent >= 0 && line.size() < kFewPoints) {  // a corner of its parent's end
      branch_of.push_back(parent);
      continue;
    }

    // To the ridge; within the parent's ball the ridge is the parent's, so the line starts at it.
    for (int round = 0; round < kRounds; ++round) {
      line =
          resample(smooth(wall, move_to_ridge(wall, line, round == 0 ? kFirstClimb : kLaterClimb),
                          sample, {.least = sample, .part = kSmoothing}),
                   sample);
    }
    extend_straight(wall, line, end, sample);
    const auto finished = [&](const Points& points) {
      return measured(wall, smooth(wall, resample(points, sample), sample,
                                   {.least = sample, .part = kSmoothing}));
    };
    if (parent < 0) {
      std::reverse(line.begin(), line.end());
      extend(wall, line, root, sample);
      cut_after(line, root, sample);
      std::reverse(line.begin(), line.end());
      branches.push_back({.line = finished(line)});
      branch_of.push_back(0);
      continue;
    }
    const auto begun = [&](const BranchStart& start) {
      const Centerline& from = branches[static_cast<std::size_t>(start.parent)].line;
      return Branch{.line = finished(begin_line(from, start, line)),
                    .parent = start.parent,
                    .parent_arc = from.arc_length(start.at)};
    };
    const BranchStart start = find_branch_start(branches, parent, line);
    if (line.size() < start.own_first + kFewPoints ||
        runs_in_parent(surface, begun(start_whole(branches, parent, line)), branches)) {
      branch_of.push_back(parent);
      edges[t] = nodes;
      continue;
    }
    branch_of.push_back(static_cast<int>(branches.size()));
    branches.push_back(begun(start));
  }
  return branches;
}

Centerline find_centerline(const Surface& surface, const Vec3& access, const Vec3& target,
                           const CenterlineOptions& options) {
  expects(options.sample_mm > 0.0 && options.grid_mm >= 0.0);
  require_inside(surface, "access", access);
  require_inside(surface, "target", target);
  const NearestWall wall(surface);

  // Cheapest path on the grid, rid of its steps.
  const RawPath raw = search_path(wall, surface, access, target, options.guide,
                                  first_spacing(surface, kNodesWanted, options));
  const double sample = options.sample_mm;
  Points line = smooth(wall, resample(raw.points, sample), sample, {.least = 2.0 * raw.spacing});

  // To the ridge, in the planes across the line.
  line = without_ends(wall, line);
  for (int round = 0; round < kRounds; ++round) {
    line = resample(smooth(wall, move_to_ridge(wall, line, round == 0 ? kFirstClimb : kLaterClimb),
                           sample, {.least = sample, .part = kSmoothing}),
                    sample);
  }

  // Both ends: along the ridge to the places nearest to target and access.
  const Vec3 ends[] = {target, access};
  for (const Vec3& end : ends) {
    extend(wall, line, end, sample);
    cut_after(line, end, sample);
    if (&end == ends && options.beyond_mm > 0.0)
      extend_beyond(wall, line, options.beyond_mm, sample);
    std::reverse(line.begin(), line.end());
  }
  if (arc_length(line).back() < sample) {
    throw Error("target " + place_text(target) + " mm and access " + place_text(access) +
                " mm lie at the same place along the vessel; expected at least " +
                number_text(sample) + " mm between them. Check the target point");
  }
  line = smooth(wall, resample(line, sample), sample, {.least = sample, .part = kSmoothing});

  return measured(wall, line);
}

std::optional<Vec3> find_departure(const Surface& surface, const Centerline& line,
                                   const std::vector<Vec3>& guide) {
  const NearestWall wall(surface);
  Points points;
  for (const Vec3& p : line.points.colwise()) points.push_back(p);
  return Guide(wall, guide).departure_of(points);
}

Vec3 start_tangent(const Centerline& line, double span) {
  expects(line.points.cols() >= 2 && span > 0.0);
  Eigen::Index i = 1;
  while (i + 1 < line.points.cols() && line.arc_length(i) < span) ++i;
  const double length = line.arc_length(i) - line.arc_length(i - 1);
  const double f = std::min(1.0, (span - line.arc_length(i - 1)) / length);
  const Vec3 end = (1.0 - f) * line.points.col(i - 1) + f * line.points.col(i);
  return (end - line.points.col(0)).normalized();
}

}  // namespace wireplan::preprocess
