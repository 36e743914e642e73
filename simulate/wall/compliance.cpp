#include "simulate/wall/compliance.h"

#include <metis.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <mutex>
#include <string>

namespace wireplan::simulate {

namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

// ---------------------------------------------------------------- stiffness, paper Eq. (16)

/// Isotropic elasticity: stress = lambda tr(strain) I + 2 mu strain                       [MPa]
struct Lame {
  double lambda, mu;
};

Lame find_lame(const Wall& wall) {
  const double E = wall.young_modulus, nu = wall.poisson_ratio;
  if (!(E > 0.0 && std::isfinite(E))) {
    throw Error("wall: Young modulus is " + text_of(E) +
                " MPa, expected more than 0; for a wall that does not yield, choose the rigid one");
  }
  if (!(nu > -1.0 && nu < 0.5)) {
    throw Error("wall: Poisson ratio is " + text_of(nu) +
                ", expected more than -1 and less than 0.5; 0.3 to 0.45 are usual");
  }
  return {.lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), .mu = 0.5 * E / (1.0 + nu)};
}

/// Stiffness of tetrahedron k over the displacements of the corners of its triangle. With g_i the
/// gradient of the linear shape function that is 1 at corner i, the block of corners i and j is
/// V (lambda g_i g_j' + mu g_j g_i' + mu (g_i . g_j) I).
Matrix9 tetrahedron_stiffness(const Surface& surface, const Wall& wall, const Lame& lame,
                              Eigen::Index k) {
  Mat3 edges;  // from the apex to the corners
  for (int c = 0; c < 3; ++c) {
    edges.col(c) = surface.vertices.col(surface.triangles(c, k)) - wall.apexes.col(k);
  }
  const double volume = -edges.determinant() / 6.0;
  const Mat3 gradients = edges.inverse();  // in its rows
  if (!(volume > 0.0) || !gradients.allFinite()) {
    throw Error("wall: tetrahedron " + std::to_string(k) + " has a volume of " + text_of(volume) +
                " mm^3, expected more than 0 with its apex outside; remesh the surface and extrude "
                "the wall again");
  }
  Matrix9 stiffness;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vec3 g_i = gradients.row(i), g_j = gradients.row(j);
      stiffness.block<3, 3>(3 * i, 3 * j) =
          volume * (lame.lambda * g_i * g_j.transpose() + lame.mu * g_j * g_i.transpose() +
                    lame.mu * g_i.dot(g_j) * Mat3::Identity());
    }
  }
  return stiffness;
}

/// K by blocks of vertices: a symmetric pattern, each vertex joined to itself and its neighbours.
struct BlockStiffness {
  std::vector<int> start, neighbour;  // (v+1) and per block; neighbours in ascending order
  std::vector<Mat3> block;            //                                                 [N/mm]

  Mat3& at(int a, int b) {
    const auto first = neighbour.begin() + start[a], last = neighbour.begin() + start[a + 1];
    return block[static_cast<std::size_t>(std::lower_bound(first, last, b) - neighbour.begin())];
  }
};

BlockStiffness assemble(const Surface& surface, const Wall& wall) {
  expects(wall.apexes.cols() == surface.triangles.cols());
  const Lame lame = find_lame(wall);

  // The pattern: pairs of vertices that share a triangle.
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(9 * static_cast<std::size_t>(surface.triangles.cols()));
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    for (const int a : surface.triangles.col(k)) {
      for (const int b : surface.triangles.col(k)) pairs.emplace_back(a, b);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  BlockStiffness result;
  result.start.assign(static_cast<std::size_t>(surface.vertices.cols()) + 1, 0);
  for (const auto& [a, b] : pairs) {
    ++result.start[a + 1];
    result.neighbour.push_back(b);
  }
  for (std::size_t a = 1; a < result.start.size(); ++a) result.start[a] += result.start[a - 1];

  // The sum over tetrahedra.
  result.block.assign(pairs.size(), Mat3::Zero());
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    const Matrix9 stiffness = tetrahedron_stiffness(surface, wall, lame, k);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        result.at(surface.triangles(i, k), surface.triangles(j, k)) +=
            stiffness.block<3, 3>(3 * i, 3 * j);
      }
    }
  }
  return result;
}

/// The blocks as one matrix, vertex a at place[a], or left out at -1.
SparseMatrix expand(const BlockStiffness& blocks, const std::vector<int>& place) {
  const int vertices = static_cast<int>(place.size());
  std::vector<int> vertex_at(place.size(), -1);
  for (int a = 0; a < vertices; ++a) {
    if (place[a] >= 0) vertex_at[place[a]] = a;
  }
  const int placed =
      static_cast<int>(std::count_if(place.begin(), place.end(), [](int at) { return at >= 0; }));

  SparseMatrix matrix(3 * placed, 3 * placed);
  matrix.reserve(9 * static_cast<Eigen::Index>(blocks.block.size()));
  std::vector<std::pair<int, const Mat3*>> column;
  for (int at = 0; at < placed; ++at) {
    const int b = vertex_at[at];
    column.clear();
    for (int e = blocks.start[b]; e < blocks.start[b + 1]; ++e) {
      column.emplace_back(place[blocks.neighbour[e]], &blocks.block[e]);
    }
    std::sort(column.begin(), column.end());
    for (int d = 0; d < 3; ++d) {
      matrix.startVec(3 * at + d);
      for (const auto& [row, block] : column) {
        // Block (b, a), of which this is the transpose: K is symmetric.
        for (int c = 0; c < 3; ++c) {
          matrix.insertBack(3 * row + c, 3 * at + d) = (*block)(d, c);
        }
      }
    }
  }
  matrix.finalize();
  return matrix;
}

/// Places of the vertices in an order of elimination by nested dissection, in which a vertex has
/// few ancestors; -1 for those without a triangle.
std::vector<int> elimination_places(const BlockStiffness& blocks) {
  const int vertices = static_cast<int>(blocks.start.size()) - 1;
  std::vector<int> place(static_cast<std::size_t>(vertices), -1), used;
  for (int a = 0; a < vertices; ++a) {
    if (blocks.start[a] == blocks.start[a + 1]) continue;
    place[a] = static_cast<int>(used.size());
    used.push_back(a);
  }
  std::vector<idx_t> start = {0}, neighbour;  // the graph, without the vertices themselves
  for (const int a : used) {
    for (int e = blocks.start[a]; e < blocks.start[a + 1]; ++e) {
      if (blocks.neighbour[e] != a) neighbour.push_back(place[blocks.neighbour[e]]);
    }
    start.push_back(static_cast<idx_t>(neighbour.size()));
  }
  auto count = static_cast<idx_t>(used.size());
  std::vector<idx_t> at(used.size()), place_in_order(used.size());
  static std::mutex one_at_a_time;  // METIS seeds and draws from rand()
  const std::lock_guard lock(one_at_a_time);
  if (METIS_NodeND(&count, start.data(), neighbour.data(), nullptr, nullptr, at.data(),
                   place_in_order.data()) != METIS_OK) {
    throw Error("wall: METIS found no order of elimination for " + std::to_string(count) +
                " vertices; make a coarser surface");
  }
  for (std::size_t k = 0; k < used.size(); ++k)
    place[used[k]] = static_cast<int>(place_in_order[k]);
  return place;
}

// ---------------------------------------------------------------- normals

Eigen::Matrix3Xd unit_vertex_normals(const Surface& surface) {
  Eigen::Matrix3Xd normals = angle_weighted_normals(surface);
  for (auto normal : normals.colwise()) normal.normalize();  // leaves zeros as they are
  return normals;
}

// ---------------------------------------------------------------- columns of the factor

/// The three columns of a vertex in L: its own block, then rows that they have in common. The first
/// of these is its parent in the elimination tree, and all of them are ancestors (Davis, "Direct
/// Methods for Sparse Linear Systems", chapters 3 and 4).
struct Columns {
  Mat3 diagonal;
  int size;
  const int* row;
  std::array<const double*, 3> value;

  Columns(const SparseMatrix& L, int place) : diagonal(Mat3::Zero()) {
    const int* outer = L.outerIndexPtr() + 3 * place;
    const double* values = L.valuePtr();
    const double *u = values + outer[0], *v = values + outer[1], *w = values + outer[2];
    diagonal << u[0], 0.0, 0.0, u[1], v[0], 0.0, u[2], v[1], w[0];
    size = outer[3] - outer[2] - 1;
    row = L.innerIndexPtr() + outer[2] + 1;
    value = {u + 3, v + 2, w + 1};
  }
  int parent() const { return size > 0 ? row[0] / 3 : -1; }
};

}  // namespace

Eigen::SparseMatrix<double> wall_stiffness(const Surface& surface, const Wall& wall) {
  std::vector<int> place(static_cast<std::size_t>(surface.vertices.cols()));
  for (std::size_t a = 0; a < place.size(); ++a) place[a] = static_cast<int>(a);
  return expand(assemble(surface, wall), place);
}

WallCompliance::WallCompliance(const Surface& surface, const Wall& wall)
    : vertices_(surface.vertices),
      normals_(unit_vertex_normals(surface)),
      responses_(static_cast<std::size_t>(surface.vertices.cols())) {
  BlockStiffness blocks = assemble(surface, wall);
  place_ = elimination_places(blocks);
  const SparseMatrix stiffness = expand(blocks, place_);
  neighbour_start_ = std::move(blocks.start);
  neighbour_ = std::move(blocks.neighbour);

  // Factor, and see that the forces that move all vertices by 1 mm do so again.
  cholesky_.compute(stiffness);
  double error = std::numeric_limits<double>::infinity();
  if (cholesky_.info() == Eigen::Success) {
    const Eigen::VectorXd moved = Eigen::VectorXd::Ones(stiffness.cols());
    error = (cholesky_.solve(stiffness * moved) - moved).cwiseAbs().maxCoeff();
  }
  if (!(error < kKeptFraction)) {
    throw Error(
        "wall: its stiffness cannot be factored: displacements come back with an error of " +
        text_of(error) + " mm per mm, expected below " + text_of(kKeptFraction) +
        "; remesh the surface, so that no tetrahedron is far flatter than the others");
  }
  reach_ = find_reach();
}

/// Motion fades by a constant factor per distance, which is the wall's thickness and Poisson
/// ratio's doing: measured under a few forces, with half as much again to be safe.
double WallCompliance::find_reach() const {
  constexpr int kForces = 4;
  constexpr double kSafe = 1.5;
  const Eigen::Index count = normals_.cols();
  double reach = 0.0;
  for (int k = 0; k < kForces; ++k) {
    Eigen::Index vertex = k * count / kForces;
    while (vertex < count && place_[vertex] < 0) ++vertex;
    if (vertex == count) continue;
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, count);
    force.col(vertex) = normals_.col(vertex);
    const Eigen::Matrix3Xd moved = displacements(force);
    const double felt = kKeptFraction * moved.col(vertex).norm();
    for (Eigen::Index other = 0; other < count; ++other) {
      if (moved.col(other).norm() < felt) continue;
      reach = std::max(reach, (vertices_.col(other) - vertices_.col(vertex)).norm());
    }
  }
  return kSafe * reach;
}

WallCompliance::~WallCompliance() {
  for (const std::atomic<const HalfResponse*>& response : responses_) delete response.load();
}

const WallCompliance::HalfResponse& WallCompliance::half_response(int vertex) const {
  expects(vertex >= 0 && vertex < normals_.cols() && place_[vertex] >= 0);
  std::atomic<const HalfResponse*>& kept = responses_[vertex];
  if (const HalfResponse* known = kept.load(std::memory_order_acquire)) return *known;

  // Two threads may find the same one, each to the same bit; the first is kept.
  auto found = std::make_unique<const HalfResponse>(find_response(vertex));
  const HalfResponse* known = nullptr;
  if (!kept.compare_exchange_strong(known, found.get(), std::memory_order_acq_rel)) return *known;
  ++response_count_;
  response_bytes_ +=
      sizeof(HalfResponse) + found->places.size() * (sizeof(int) + 3 * sizeof(double));
  return *found.release();
}

template <class Visit>
void WallCompliance::for_each_part(int vertex, Visit&& visit) const {
  const int start = neighbour_start_[vertex], end = neighbour_start_[vertex + 1];
  for (int e = start; e < end; ++e) {
    const int b = neighbour_[e];
    visit(b, b == vertex ? 0.5 : 0.5 / (end - start - 1));
  }
}

std::vector<WallCompliance::Part> WallCompliance::spread(int vertex) const {
  std::vector<Part> parts;
  for_each_part(vertex, [&](int b, double part) { parts.push_back({b, part}); });
  return parts;
}

WallCompliance::HalfResponse WallCompliance::find_response(int vertex) const {
  // Motion fades with distance: where two vertices feel each other by kKeptFraction or more, what
  // one of them neglects counts kNegligible^2 / kKeptFraction at most, which is below rounding.
  constexpr double kNegligible = 1e-3 * kKeptFraction;
  const SparseMatrix& L = cholesky_.matrixL().nestedExpression();

  // The places that the force is felt at: the paths from its vertices to the root.
  std::vector<int> places, at(place_.size(), -1);
  for_each_part(vertex, [&](int b, double) {
    for (int p = place_[b]; p >= 0 && at[p] < 0; p = Columns(L, p).parent()) {
      at[p] = 0;
      places.push_back(p);
    }
  });
  std::sort(places.begin(), places.end());  // children first
  for (std::size_t k = 0; k < places.size(); ++k) at[places[k]] = static_cast<int>(k);
  Eigen::Matrix3Xd y = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(places.size()));
  for_each_part(vertex, [&](int b, double part) { y.col(at[place_[b]]) = part * normals_.col(b); });

  // L y = f, up to the last that is not negligible.
  double largest = 0.0;
  Eigen::Index count = 0;
  for (Eigen::Index k = 0; k < y.cols(); ++k) {
    const Columns c(L, places[static_cast<std::size_t>(k)]);
    Vec3 here = y.col(k);
    c.diagonal.triangularView<Eigen::Lower>().solveInPlace(here);
    y.col(k) = here;
    const double size = here.norm();
    if (size <= kNegligible * largest) continue;
    largest = std::max(largest, size);
    count = k + 1;
    for (int e = 0; e < c.size; e += 3) {
      const auto part = [&](int d) -> Vec3 {
        return here[d] * Eigen::Map<const Vec3>(c.value[d] + e);
      };
      y.col(at[c.row[e] / 3]) -= part(0) + part(1) + part(2);  // read and written once
    }
  }
  const int above = static_cast<int>(y.cols() - count);
  places.resize(static_cast<std::size_t>(count));
  places.shrink_to_fit();
  y.conservativeResize(Eigen::NoChange, count);
  const double compliance = y.squaredNorm();
  return {std::move(places), std::move(y), at[place_[vertex]], above, compliance};
}

double WallCompliance::between(const HalfResponse& a, const HalfResponse& b) {
  if (a.above < b.above) return between(b, a);
  // An edge of the surface joins a vertex with an ancestor or a descendant. So the places from the
  // vertex's own on are a path toward the root, and those before it lie below it. Two paths that
  // meet are one from there on, as far as both are kept.
  int i = static_cast<int>(a.places.size()) - 1;
  int j = static_cast<int>(b.places.size()) - 1 - (a.above - b.above);
  j = std::max(j, b.own - 1);
  double sum = 0.0;
  const auto take = [&](int count) {  // the next ones toward the leaves, the same in both
    i -= count;
    j -= count;
    sum += a.values.middleCols(i + 1, count).cwiseProduct(b.values.middleCols(j + 1, count)).sum();
  };
  // The paths, which part once: where is found by bisection.
  int same = 0, apart = std::min(i - a.own, j - b.own) + 2;
  while (apart - same > 1) {
    const int middle = same == 0 ? 1 : (same + apart) / 2;
    (a.places[i + 1 - middle] == b.places[j + 1 - middle] ? same : apart) = middle;
  }
  take(same);
  while (i >= 0 && j >= 0 && (i < a.own || j < b.own)) {
    int count = 0;
    while (i >= count && j >= count && a.places[i - count] == b.places[j - count]) ++count;
    take(count);
    if (i < 0 || j < 0 || (i >= a.own && j >= b.own)) break;
    --(a.places[i] > b.places[j] ? i : j);
  }
  return std::abs(sum) < kKeptFraction * std::min(a.compliance, b.compliance) ? 0.0 : sum;
}

Eigen::Matrix3Xd WallCompliance::displacements(const Eigen::Matrix3Xd& forces) const {
  expects(forces.cols() == normals_.cols());
  Eigen::Matrix3Xd placed(3, cholesky_.rows() / 3);
  for (Eigen::Index a = 0; a < forces.cols(); ++a) {
    if (place_[a] >= 0) placed.col(place_[a]) = forces.col(a);
  }
  const Eigen::VectorXd solution = cholesky_.solve(placed.reshaped());
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, forces.cols());
  for (Eigen::Index a = 0; a < forces.cols(); ++a) {
    if (place_[a] >= 0) result.col(a) = solution.segment<3>(3 * place_[a]);
  }
  return result;
}

std::size_t WallCompliance::memory_bytes() const {
  const SparseMatrix& L = cholesky_.matrixL().nestedExpression();
  return static_cast<std::size_t>(L.nonZeros()) * (sizeof(double) + sizeof(int)) +
         (neighbour_start_.size() + neighbour_.size() + place_.size()) * sizeof(int) +
         static_cast<std::size_t>(vertices_.size() + normals_.size()) * sizeof(double) +
         responses_.size() * sizeof(responses_[0]) + response_bytes_;
}

}  // namespace wireplan::simulate
