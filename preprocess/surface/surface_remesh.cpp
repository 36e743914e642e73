#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <queue>
#include <sstream>
#include <utility>
#include <vector>

#include "preprocess/surface/cgal_calls.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_mend.h"
#include "preprocess/surface/vertex_graph.h"
#include "preprocess/surface/wall_tree.h"

namespace wireplan::preprocess {
namespace {

constexpr int kIterations = 3;  // more hardly changes the angles
constexpr int kTries = 6, kLocalTries = 2;
constexpr double kFiner = 0.8;  // from try to try, where local refinement did not help
// Edges are at most this part of the local radius: about 12 round a vessel, and facets that lie
// within 3 % of the radius.
constexpr double kEdgePerRadius = 0.5;
constexpr double kClassRatio = std::numbers::sqrt2;  // of the edge lengths of neighbouring parts
constexpr double kLeastPart = 0.25;  // of the surface's own edges: it tells nothing finer
constexpr int kMostClasses = 24;     // down to 0.004 mm
// Creases that turn by more than this (rims of caps, folds between branches) are kept as lines:
// relaxing vertices across them is what makes sheets cut each other.
constexpr double kCreaseDeg = 60.0;
constexpr double kMaxTriangles = 3e6;     // several GB of half-edges beyond
constexpr double kGrading = 0.3;          // growth of the edge length per way along the surface
constexpr Eigen::Index kSamples = 40000;  // triangles at which the radius is measured

/// Lets no value exceed a neighbour's by more than kGrading of the way between them.
void grade(const Surface& surface, const Neighbours& neighbours, Eigen::VectorXd& values) {
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (int v = 0; v < values.size(); ++v) queue.emplace(values(v), v);
  while (!queue.empty()) {
    const auto [value, v] = queue.top();
    queue.pop();
    if (value > values(v)) continue;
    const auto begin = neighbours.first[static_cast<std::size_t>(v)];
    const auto end = neighbours.first[static_cast<std::size_t>(v) + 1];
    for (std::size_t k = begin; k < end; ++k) {
      const int w = neighbours.list[k];
      const double way = (surface.vertices.col(v) - surface.vertices.col(w)).norm();
      if (values(w) <= value + kGrading * way) continue;
      values(w) = value + kGrading * way;
      queue.emplace(values(w), w);
    }
  }
}

/// Edge length wanted at each vertex: a part of half the way to the wall opposite, which is the
/// radius of a vessel, and grows slowly along the surface, so that caps and the roots of branches
/// are as fine as the side beside them.
Eigen::VectorXd wanted_edges(const Surface& surface, double longest) {
  const Eigen::Index n = surface.vertices.cols(), m = surface.triangles.cols();
  const Neighbours neighbours = find_neighbours(surface);
  const WallTree wall(surface);
  const Eigen::Index stride = std::max<Eigen::Index>(1, m / kSamples), samples = (m - 1) / stride;
  Eigen::VectorXd measured(samples + 1);
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index k = 0; k <= samples; ++k) {
    const Eigen::Vector3i t = surface.triangles.col(k * stride);
    const Vec3 a = surface.vertices.col(t(0)), b = surface.vertices.col(t(1)),
               c = surface.vertices.col(t(2));
    const Vec3 inward = (c - a).cross(b - a).normalized();
    measured(k) = 0.5 * kEdgePerRadius *
                  wall.free_way((a + b + c) / 3.0, inward, 2.0 * longest / kEdgePerRadius);
  }

  // Each vertex has the mean of its triangles' values; between the samples, the surroundings'.
  Eigen::VectorXd edge = Eigen::VectorXd::Zero(n), weight = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k <= samples; ++k) {
    for (const int v : surface.triangles.col(k * stride)) {
      edge(v) += measured(k);
      weight(v) += 1.0;
    }
  }
  edge = edge.cwiseQuotient(weight.cwiseMax(1.0));
  if (stride > 1) average(neighbours, 2 + static_cast<int>(stride), edge, weight);
  for (Eigen::Index v = 0; v < n; ++v) {
    if (weight(v) < 1e-9) edge(v) = longest;  // no sample near
  }
  edge = edge.cwiseMax(kLeastPart * mean_edge(surface)).eval();
  grade(surface, neighbours, edge);
  return edge.cwiseMin(longest);
}

/// Edge length of a class: 0 is the asked one, the others are the same whatever was asked, so that
/// a longer asked one does not make thin parts finer by chance.
double class_edge(int k, double longest) {
  constexpr double kFirst = 16.0;  // mm
  return k == 0 ? longest : kFirst * std::pow(kClassRatio, 1 - k);
}

/// Class of each triangle: the one nearest to the shortest edge that its corners want.
std::vector<int> classes_of(const Surface& surface, const Eigen::VectorXd& edge, double longest) {
  std::vector<int> classes;
  for (const auto& t : surface.triangles.colwise()) {
    const double shortest = std::min({edge(t(0)), edge(t(1)), edge(t(2))});
    const double steps = std::log(class_edge(1, longest) / shortest) / std::log(kClassRatio);
    const int nearest = 1 + std::clamp(static_cast<int>(std::lround(steps)), 0, kMostClasses);
    classes.push_back(class_edge(nearest, longest) < longest && shortest < longest ? nearest : 0);
  }
  return classes;
}

/// Each part of the surface to its own edge length, the coarsest first.
std::optional<Surface> remesh_once(const Surface& surface, const std::vector<int>& classes,
                                   double longest) {
  const int finest = *std::max_element(classes.begin(), classes.end());
  std::vector<double> edges;
  for (int k = 0; k <= finest; ++k) edges.push_back(class_edge(k, longest));
  return remesh_parts(surface, classes, edges, kCreaseDeg, kIterations);
}

/// True where the mean edge is the wanted one within a tenth and none is over twice as long.
bool has_edges(const Surface& surface, const Eigen::VectorXd& edge) {
  double sum = 0.0;
  for (const auto& t : surface.triangles.colwise()) {
    for (int k = 0; k < 3; ++k) {
      const int a = t(k), b = t((k + 1) % 3);
      const double part =
          (surface.vertices.col(b) - surface.vertices.col(a)).norm() / std::min(edge(a), edge(b));
      if (part > 2.0) return false;
      sum += part;
    }
  }
  return std::abs(sum / static_cast<double>(3 * surface.triangles.cols()) - 1.0) <= 0.1;
}

/// Number of even-sided triangles that would cover the surface.
double triangles_needed(const Surface& surface, const std::vector<int>& classes, double longest) {
  double needed = 0.0;
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    const Vec3 a = surface.vertices.col(surface.triangles(0, t));
    const Vec3 ab = surface.vertices.col(surface.triangles(1, t)) - a;
    const Vec3 ac = surface.vertices.col(surface.triangles(2, t)) - a;
    const double edge = class_edge(classes[static_cast<std::size_t>(t)], longest);
    needed += 0.5 * ab.cross(ac).norm() / (std::sqrt(3.0) / 4.0 * edge * edge);
  }
  return needed;
}

/// Asks for edges half as long near triangles of `result` that cut each other.
void refine_near(const Surface& result, const std::vector<int>& cut, const Surface& surface,
                 Eigen::VectorXd& edge, double longest) {
  for (const int t : cut) {
    const Eigen::Vector3i corners = result.triangles.col(t);
    const Vec3 middle = (result.vertices.col(corners(0)) + result.vertices.col(corners(1)) +
                         result.vertices.col(corners(2))) /
                        3.0;
    double reach = 1.5 * longest;
    for (int k = 0; k < 3; ++k) {
      reach = std::max(reach, 2.0 * (result.vertices.col(corners(k)) - middle).norm());
    }
    for (Eigen::Index v = 0; v < edge.size(); ++v) {
      if ((surface.vertices.col(v) - middle).squaredNorm() > reach * reach) continue;
      edge(v) = -std::abs(edge(v));
    }
  }
  for (double& length : edge) length = length < 0.0 ? -0.5 * length : length;
}

}  // namespace

Surface remesh(const Surface& surface, double edge_length_mm) {
  return remesh(surface, check_surface(surface), edge_length_mm);
}

Surface remesh(const Surface& surface, const SurfaceCheck& before, double edge_length_mm) {
  expects(edge_length_mm > 0.0 && surface.triangles.cols() > 0);
  require_sound(before, "surface before remeshing");
  Eigen::VectorXd edge = wanted_edges(surface, edge_length_mm);
  if (has_edges(surface, edge)) return surface;

  // A remesh may push close sheets through each other, or pinch a thin branch: then finer there,
  // what is left of it made anew, and at last finer and even everywhere.
  std::ostringstream tried;
  double longest = edge_length_mm;
  for (int k = 0; k < kTries; ++k) {
    const std::vector<int> classes = classes_of(surface, edge, longest);
    if (triangles_needed(surface, classes, longest) > kMaxTriangles) {
      tried << "; " << longest << " mm: more than " << kMaxTriangles << " triangles";
      break;
    }
    std::optional<Surface> result = remesh_once(surface, classes, longest);
    std::vector<int> cutting;
    if (result) {
      SurfaceCheck after = check_surface(*result, cutting);
      if (k + 1 >= kLocalTries && after.self_intersections > 0) {
        std::vector<Mend> mends;
        result = without_intersections(*result, mends);
        after = check_surface(*result);
      }
      if (is_sound(after) && after.euler_number == before.euler_number) return *result;
      tried << "; " << longest << " mm: " << after.self_intersections
            << " pairs of triangles cut each other, Euler number " << after.euler_number;
    } else {
      tried << "; " << longest << " mm: no mesh came of it";
    }
    if (result && k + 1 < kLocalTries) {
      refine_near(*result, cutting, surface, edge, longest);
    } else {
      longest *= kFiner;
      edge.setConstant(longest);
    }
  }
  throw Error("surface.edge_length_mm is " + (std::ostringstream() << edge_length_mm).str() +
              ", and no remesh to it is sound (Euler number before: " +
              std::to_string(before.euler_number) + tried.str() +
              "). Choose about half the radius of the thinnest vessel that matters, or smooth the "
              "surface in a mesh editor");
}

}  // namespace wireplan::preprocess
