#include "preprocess/segment/label_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// How many voxel faces join each pair of classes, and how many voxels each has.
struct Contacts {
  std::size_t classes;
  std::vector<std::size_t> faces, voxels;
  std::size_t between(std::size_t a, std::size_t b) const { return faces[a * classes + b]; }
};

Contacts count_contacts(const LabelMask& labels, std::size_t classes) {
  Contacts found{classes, std::vector<std::size_t>(classes * classes, 0),
                 std::vector<std::size_t>(classes, 0)};
  for (std::size_t n = 0; n < labels.class_of.size(); ++n) {
    if (labels.class_of[n] == 0) continue;
    const std::size_t here = labels.class_of[n] - 1U;
    ++found.voxels[here];
    for_each_face_neighbour(labels.mask.grid, n, [&](std::size_t m) {
      if (labels.class_of[m] == 0 || labels.class_of[m] == here + 1) return;
      ++found.faces[here * classes + labels.class_of[m] - 1U];
    });
  }
  return found;
}

/// The class with most voxels.
std::size_t trunk_of(const Contacts& contacts) {
  return static_cast<std::size_t>(std::max_element(contacts.voxels.begin(), contacts.voxels.end()) -
                                  contacts.voxels.begin());
}

/// -1 for the trunk, and for what nothing joins to it.
int find_parent(const Contacts& contacts, std::size_t index) {
  const std::size_t trunk = trunk_of(contacts);
  std::vector<int> steps(contacts.classes, -1);
  std::vector<std::size_t> queue = {trunk};
  steps[trunk] = 0;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (std::size_t other = 0; other < contacts.classes; ++other) {
      if (steps[other] >= 0 || contacts.between(queue[next], other) == 0) continue;
      steps[other] = steps[queue[next]] + 1;
      queue.push_back(other);
    }
  }
  int parent = -1;
  for (std::size_t other = 0; other < contacts.classes && index != trunk; ++other) {
    if (steps[other] < 0 || steps[other] != steps[index] - 1) continue;
    const std::size_t faces = contacts.between(index, other);
    if (faces == 0) continue;
    if (parent < 0 || faces > contacts.between(index, static_cast<std::size_t>(parent))) {
      parent = static_cast<int>(other);
    }
  }
  return parent;
}

/// A class alone, on the part of the grid that holds it.
struct Alone {
  Grid grid;
  Labels inside;                    // 1 in the class
  std::vector<std::size_t> ostium;  // its voxels that touch the parent
};

Alone cut_class(const LabelMask& labels, std::size_t index, int parent) {
  const Grid& whole = labels.mask.grid;
  Labels inside(labels.class_of.size(), 0);
  std::size_t some = 0;
  for (std::size_t n = 0; n < inside.size(); ++n) {
    inside[n] = labels.class_of[n] == index + 1 ? 1 : 0;
    if (inside[n] != 0) some = n;
  }
  const Voxel seed = voxel_at(whole, some);
  const Box box = grown(bounding_box(whole, inside, {seed, seed}), Voxel{1, 1, 1}, whole);
  Alone alone{cropped(whole, box), crop_values(whole, box, inside), {}};
  const Labels classes = crop_values(whole, box, labels.class_of);
  for (std::size_t n = 0; n < classes.size(); ++n) {
    if (alone.inside[n] == 0) continue;
    bool touches = false;
    for_each_face_neighbour(alone.grid, n, [&](std::size_t m) {
      touches = touches || (parent >= 0 && classes[m] == parent + 1);
    });
    if (touches) alone.ostium.push_back(n);
  }
  return alone;
}

/// How far each voxel is from the start, through the class and from voxel to voxel [mm].
std::vector<double> distances_from(const Alone& alone, const std::vector<std::size_t>& start) {
  std::vector<double> far(alone.inside.size(), kFar);
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const std::size_t n : start) {
    far[n] = 0.0;
    queue.push({0.0, n});
  }
  while (!queue.empty()) {
    const auto [here, n] = queue.top();
    queue.pop();
    if (here > far[n]) continue;
    const Voxel v = voxel_at(alone.grid, n);
    for (const std::size_t m : neighbourhood(alone.grid, v, 1)) {
      if (alone.inside[m] == 0) continue;
      const Voxel w = voxel_at(alone.grid, m);
      const double step =
          alone.grid.spacing.cwiseProduct(Vec3(w[0] - v[0], w[1] - v[1], w[2] - v[2])).norm();
      if (here + step >= far[m]) continue;
      far[m] = here + step;
      queue.push({far[m], m});
    }
  }
  return far;
}

std::size_t farthest(const std::vector<double>& far) {
  std::size_t best = 0;
  double most = -1.0;
  for (std::size_t n = 0; n < far.size(); ++n) {
    if (far[n] == kFar || far[n] <= most) continue;
    most = far[n];
    best = n;
  }
  return best;
}

Vec3 mean_center(const Grid& grid, const std::vector<std::size_t>& voxels) {
  Vec3 sum = Vec3::Zero();
  for (const std::size_t n : voxels) sum += center_of(grid, n);
  return sum / static_cast<double>(voxels.size());
}

/// The voxels of one layer that are connected with `n`.
std::vector<std::size_t> layer_round(const Alone& alone, const std::vector<int>& layer,
                                     std::size_t n, Labels& seen) {
  std::vector<std::size_t> queue = {n};
  seen[n] = 1;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (const std::size_t m : neighbourhood(alone.grid, voxel_at(alone.grid, queue[next]), 1)) {
      if (seen[m] != 0 || layer[m] != layer[n]) continue;
      seen[m] = 1;
      queue.push_back(m);
    }
  }
  return queue;
}

/// Middles of the layers of equal distance, from the start to the end.
std::vector<Vec3> middles(const Alone& alone, const std::vector<double>& far, std::size_t end) {
  const double thick = 1.5 * alone.grid.spacing.maxCoeff();
  std::vector<int> layer(far.size(), -1);
  for (std::size_t n = 0; n < far.size(); ++n) {
    if (far[n] != kFar) layer[n] = static_cast<int>(far[n] / thick);
  }
  std::vector<Vec3> points;
  Labels seen(far.size(), 0);
  std::size_t at = end;
  int last = layer[end] + 1;
  while (true) {
    if (layer[at] < last) {
      last = layer[at];
      points.push_back(mean_center(alone.grid, layer_round(alone, layer, at, seen)));
    }
    if (far[at] == 0.0) break;
    std::size_t next = at;
    for (const std::size_t m : neighbourhood(alone.grid, voxel_at(alone.grid, at), 1)) {
      if (alone.inside[m] != 0 && far[m] < far[next]) next = m;
    }
    expects(next != at);
    at = next;
  }
  std::reverse(points.begin(), points.end());
  return points;
}

/// Steps between layers' middles jump by parts of a voxel: the mean with the neighbours.
void smooth_middles(std::vector<Vec3>& points) {
  for (int round = 0; round < 2; ++round) {
    const std::vector<Vec3> before = points;
    for (std::size_t k = 1; k + 1 < points.size(); ++k) {
      points[k] = 0.25 * before[k - 1] + 0.5 * before[k] + 0.25 * before[k + 1];
    }
  }
}

Vec3 point_at(const LabelledWay& way, double arc) {
  const auto after = std::upper_bound(way.arc.begin(), way.arc.end(), arc);
  if (after == way.arc.begin()) return way.points.front();
  if (after == way.arc.end()) return way.points.back();
  const auto k = static_cast<std::size_t>(after - way.arc.begin());
  const double part = (arc - way.arc[k - 1]) / (way.arc[k] - way.arc[k - 1]);
  return way.points[k - 1] + part * (way.points[k] - way.points[k - 1]);
}

}  // namespace

LabelledWay find_labelled_way(const LabelMask& labels, const std::vector<LabelClass>& classes,
                              std::size_t index) {
  expects(index < classes.size());
  const Contacts contacts = count_contacts(labels, classes.size());
  if (!classes[index].lost.empty()) throw Error(classes[index].lost);
  if (contacts.voxels[index] == 0) {
    throw Error("nothing of " + classes[index].name +
                " is connected with the other labels, expected gaps below 5 mm");
  }
  LabelledWay way;
  way.parent = find_parent(contacts, index);
  if (way.parent < 0 && index != trunk_of(contacts)) {
    throw Error(classes[index].name +
                " touches the other labels at edges alone, expected a branch that joins one of "
                "them; give a point_mm");
  }
  const Alone alone = cut_class(labels, index, way.parent);
  std::vector<std::size_t> start = alone.ostium;
  if (way.parent < 0) {  // from one of its two ends that are farthest apart
    const auto some = static_cast<std::size_t>(
        std::find(alone.inside.begin(), alone.inside.end(), 1) - alone.inside.begin());
    start = {farthest(distances_from(alone, {some}))};
  }
  const std::vector<double> far = distances_from(alone, start);
  way.points = middles(alone, far, farthest(far));
  if (way.parent >= 0) {
    way.points.insert(way.points.begin(), mean_center(alone.grid, alone.ostium));
  }
  smooth_middles(way.points);
  if (way.parent < 0 && way.points.front().z() < way.points.back().z()) {
    std::reverse(way.points.begin(), way.points.end());
  }
  way.arc = {0.0};
  for (std::size_t k = 1; k < way.points.size(); ++k) {
    way.arc.push_back(way.arc.back() + (way.points[k] - way.points[k - 1]).norm());
  }
  return way;
}

Vec3 find_beyond_ostium(const LabelledWay& way, double beyond_mm, const std::string& name) {
  if (way.parent < 0) {
    throw Error(name +
                " is the trunk of the labels and has no ostium, expected a branch of it, or " +
                "an end: superior or inferior");
  }
  if (beyond_mm > way.arc.back()) {
    throw Error("the label of " + name + " ends " + number_text(way.arc.back()) +
                " mm beyond its ostium, expected a place before that");
  }
  return point_at(way, beyond_mm);
}

Vec3 find_end(const LabelMask& labels, const LabelledWay& way, BranchEnd end,
              const std::string& name) {
  constexpr double kAlike = 10.0;  // ends are hardly told apart by their heights
  if ((end == BranchEnd::kDistal) != (way.parent >= 0)) {
    throw Error(name +
                (way.parent >= 0
                     ? " is a branch, expected its distal end"
                     : " is the trunk of the labels, expected its superior or inferior end"));
  }
  if (way.parent < 0 && way.points.front().z() - way.points.back().z() < kAlike) {
    throw Error("the ends of " + name + " at " + place_text(way.points.front()) + " and " +
                place_text(way.points.back()) +
                " mm are about equally high, expected a point (point_mm)");
  }
  const double length = way.arc.back();
  const bool at_front = end == BranchEnd::kSuperior;
  // As wide as a little inward, where the end's own cap is not the nearest wall.
  constexpr double kWidest = 30.0;
  double inward = std::min(0.5 * length, 2.0 * labels.mask.grid.spacing.maxCoeff());
  for (int k = 0; k < 3; ++k) {
    const Vec3 place = point_at(way, at_front ? 1.5 * inward : length - 1.5 * inward);
    inward = std::min(0.5 * length, inscribed_radius(labels.mask, place, kWidest));
  }
  return point_at(way, at_front ? inward : length - inward);
}

}  // namespace wireplan::preprocess
