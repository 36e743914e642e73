#pragma once
/// A surface as a graph of its vertices, and averages over it; for the .cpp files here.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// Neighbours of each vertex: those of v are list[first[v]] to list[first[v + 1]].
struct Neighbours {
  std::vector<std::size_t> first;
  std::vector<int> list;
};

inline Neighbours find_neighbours(const Surface& surface) {
  Neighbours result;
  result.first.assign(static_cast<std::size_t>(surface.vertices.cols()) + 1, 0);
  for (const auto& t : surface.triangles.colwise()) {
    for (int k = 0; k < 3; ++k) ++result.first[static_cast<std::size_t>(t(k)) + 1];
  }
  for (std::size_t v = 1; v < result.first.size(); ++v) result.first[v] += result.first[v - 1];
  std::vector<std::size_t> next(result.first.begin(), result.first.end() - 1);
  result.list.resize(result.first.back());
  // On a closed oriented surface each neighbour is the next corner of exactly one triangle.
  for (const auto& t : surface.triangles.colwise()) {
    for (int k = 0; k < 3; ++k) {
      result.list[next[static_cast<std::size_t>(t(k))]++] = t((k + 1) % 3);
    }
  }
  return result;
}

/// Averages the values at vertices over their neighbours, `passes` times. In each pass half of the
/// new value is the vertex's own. Values count by their weights: a vertex of weight 0 takes what
/// its neighbours have.
inline void average(const Neighbours& neighbours, int passes, Eigen::VectorXd& values,
                    Eigen::VectorXd& weights) {
  const Eigen::Index n = values.size();
  Eigen::VectorXd sums = values.cwiseProduct(weights), next_sums(n), next_weights(n);
  for (int pass = 0; pass < passes; ++pass) {
#pragma omp parallel for schedule(static) if (n > 20000)
    for (Eigen::Index v = 0; v < n; ++v) {
      const std::size_t begin = neighbours.first[static_cast<std::size_t>(v)];
      const std::size_t end = neighbours.first[static_cast<std::size_t>(v) + 1];
      double sum = 0.0, weight = 0.0;
      for (std::size_t k = begin; k < end; ++k) {
        sum += sums(neighbours.list[k]);
        weight += weights(neighbours.list[k]);
      }
      const double share = end > begin ? 0.5 / static_cast<double>(end - begin) : 0.0;
      next_sums(v) = 0.5 * sums(v) + share * sum;
      next_weights(v) = 0.5 * weights(v) + share * weight;
    }
    sums.swap(next_sums);
    weights.swap(next_weights);
  }
  values = sums.cwiseQuotient(weights.cwiseMax(std::numeric_limits<double>::min()));
}

inline double mean_edge(const Surface& surface) {
  double sum = 0.0;
  for (const auto& t : surface.triangles.colwise()) {
    sum += (surface.vertices.col(t(1)) - surface.vertices.col(t(0))).norm();
  }
  return sum / static_cast<double>(surface.triangles.cols());
}

/// How many passes of average() spread values by `distance`: one spreads by edge / sqrt(2).
inline double passes_within(double distance, double edge) {
  return std::clamp(2.0 * std::pow(distance / edge, 2), 1.0, 200.0);
}
/// The same in whole passes.
inline int passes_for(double distance, double edge) {
  return static_cast<int>(std::lround(passes_within(distance, edge)));
}

}  // namespace wireplan::preprocess
