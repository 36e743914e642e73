#include "simulate/insertion/start_line.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace wireplan::simulate {

namespace {

constexpr double kSmallestSlopeKnown = 1e-6;  // of the field: else it knows no wall there
constexpr double kInward = 0.1;               // toward a point that the field knows       [mm]
constexpr int kRounds = 8;                    // away from the wall: it is curved

/// Where on the line the place nearest to a point is: the edge and the part of it.
struct LinePlace {
  Eigen::Index edge = 0;
  double part = 0.0, squared = INFINITY;  // distance [mm^2]
};

LinePlace find_on_line(const Eigen::Matrix3Xd& line, const Vec3& point) {
  LinePlace best;
  for (Eigen::Index i = 0; i + 1 < line.cols(); ++i) {
    const Vec3 a = line.col(i), edge = line.col(i + 1) - a;
    const double squared = edge.squaredNorm();
    const double part = squared > 0.0 ? std::clamp((point - a).dot(edge) / squared, 0.0, 1.0) : 0.0;
    const double off = (a + part * edge - point).squaredNorm();
    if (off < best.squared) best = {i, part, off};
  }
  if (line.cols() == 1) best.squared = (line.col(0) - point).squaredNorm();
  return best;
}

/// Away from the wall until it is `radius` off, if the field knows the wall there.
std::optional<Vec3> leave_wall_by(const Lumen& lumen, double radius, Vec3 point) {
  for (int k = 0; k < kRounds; ++k) {
    const WallSample wall = lumen.sample(point);
    if (wall.distance >= radius) return point;
    const double slope = wall.gradient.norm();
    if (slope < kSmallestSlopeKnown) return std::nullopt;
    point += (radius - wall.distance) / slope * wall.gradient.normalized();
  }
  return point;
}

/// Distances from a's points to b's line: sum and largest, each point for its share of length.
void add_distances(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b, double& sum, double& share,
                   double& largest) {
  const Eigen::Index n = a.cols();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double before = i > 0 ? (a.col(i) - a.col(i - 1)).norm() : 0.0;
    const double after = i + 1 < n ? (a.col(i + 1) - a.col(i)).norm() : 0.0;
    const double own = n > 1 ? 0.5 * (before + after) : 1.0;
    const double off = std::sqrt(find_on_line(b, a.col(i)).squared);
    sum += own * off;
    share += own;
    largest = std::max(largest, off);
  }
}

}  // namespace

double arc_length(const Eigen::Matrix3Xd& line) {
  const Eigen::Index n = line.cols();
  return (line.rightCols(n - 1) - line.leftCols(n - 1)).colwise().norm().sum();
}

Eigen::Matrix3Xd line_from_entry(const Eigen::Matrix3Xd& line, const Vec3& entry) {
  const LinePlace place = find_on_line(line, entry);
  const Eigen::Index ahead = place.edge + (place.part >= 1.0 ? 2 : place.part > 0.0 ? 1 : 0);
  Eigen::Matrix3Xd from(3, line.cols() - ahead + 1);
  from.col(0) = entry;
  from.rightCols(line.cols() - ahead) = line.rightCols(line.cols() - ahead);
  return from;
}

PlaceOnLine place_at_arc(const Eigen::Matrix3Xd& line, double arc) {
  for (Eigen::Index i = 0; i + 1 < line.cols(); ++i) {
    const double length = (line.col(i + 1) - line.col(i)).norm();
    const bool last = i + 2 == line.cols();
    if (length > 0.0 && (arc <= length || last)) return {i, arc / length};
    arc -= length;
  }
  return {line.cols() - 1, 0.0};
}

Vec3 point_on(const Eigen::Matrix3Xd& line, const PlaceOnLine& place) {
  if (place.before + 1 == line.cols()) return line.col(place.before);
  return line.col(place.before) +
         place.part * (line.col(place.before + 1) - line.col(place.before));
}

Vec3 point_at_arc(const Eigen::Matrix3Xd& line, double arc) {
  return point_on(line, place_at_arc(line, arc));
}

Eigen::Matrix3Xd line_up_to(const Eigen::Matrix3Xd& line, double arc) {
  Eigen::Index count = 1;
  double length = 0.0;
  while (count < line.cols()) {
    length += (line.col(count) - line.col(count - 1)).norm();
    if (length >= arc) break;
    ++count;
  }
  if (count >= line.cols()) return line;
  Eigen::Matrix3Xd part(3, count + 1);
  part.leftCols(count) = line.leftCols(count);
  part.col(count) = point_at_arc(line, std::max(0.0, arc));
  return part;
}

void bring_into_lumen(const Lumen& lumen, double radius, int first, Eigen::Matrix3Xd& points) {
  const int n = static_cast<int>(points.cols());
  std::vector<bool> known(static_cast<std::size_t>(n), false);
  for (int i = first; i < n; ++i) {
    const std::optional<Vec3> inside = leave_wall_by(lumen, radius, points.col(i));
    if (!inside) continue;
    points.col(i) = *inside;
    known[static_cast<std::size_t>(i)] = true;
  }
  for (int i = first; i < n; ++i) {
    if (known[static_cast<std::size_t>(i)]) continue;
    int toward = i - 1;  // the introducer's point is in the lumen, and those before i are by now
    if (i == 0) {
      while (++toward < n && !known[static_cast<std::size_t>(toward)]) {
      }
      if (toward == n) return;
    }
    const Vec3 way = points.col(toward) - points.col(i);
    const double length = way.norm();
    for (int step = 1; step * kInward < length; ++step) {
      const Vec3 here = points.col(i) + step * kInward / length * way;
      const std::optional<Vec3> inside = leave_wall_by(lumen, radius, here);
      if (!inside) continue;
      points.col(i) = *inside;
      break;
    }
  }
}

LineDistance find_distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  LineDistance distance;
  double sum = 0.0, share = 0.0;
  add_distances(a, b, sum, share, distance.largest);
  add_distances(b, a, sum, share, distance.largest);
  distance.mean = share > 0.0 ? sum / share : 0.0;
  distance.tip = (a.rightCols<1>() - b.rightCols<1>()).norm();
  return distance;
}

Vec3 nearest_on_line(const Eigen::Matrix3Xd& line, const Vec3& point) {
  const LinePlace place = find_on_line(line, point);
  if (line.cols() == 1) return line.col(0);
  return (1.0 - place.part) * line.col(place.edge) + place.part * line.col(place.edge + 1);
}

}  // namespace wireplan::simulate
