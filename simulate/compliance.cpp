#include "simulate/compliance.h"

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

Eigen::Matrix3Xd vertex_normals(const Surface& surface) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, surface.vertices.cols());
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    const Eigen::Vector3i t = surface.triangles.col(k);
    std::array<Vec3, 3> p;
    for (int c = 0; c < 3; ++c) p[c] = surface.vertices.col(t[c]);
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    for (int c = 0; c < 3; ++c) {
      const Vec3 u = p[(c + 1) % 3] - p[c], v = p[(c + 2) % 3] - p[c];
      normals.col(t[c]) += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
    }
  }
  for (auto normal : normals.colwise()) normal.normalize();  // leaves zeros as they are
  return normals;
}

// ---------------------------------------------------------------- solves along the tree

/// Solves L L' x = f for several right sides at once, each with forces on a few vertices, and the
/// displacements of a few, reading only the columns of L between them and the root of the
/// elimination tree: the parent of a vertex is the first one below it in its columns, and all that
/// stand in its columns are ancestors (Davis, "Direct Methods for Sparse Linear Systems", chapters
/// 3 and 4).
class TreeSolver {
 public:
  using Lanes = Eigen::Matrix<double, 3, WallCompliance::kGroup, Eigen::RowMajor>;
  struct Force {
    int place, lane;
    Vec3 force;
  };
  TreeSolver(const SparseMatrix& L, const std::vector<Force>& forces)
      : L_(L), slot_(static_cast<std::size_t>(L.cols()) / 3, -1) {
    // L y = f: y is 0 off the paths from the vertices to the root, on which children come first.
    for (const Force& f : forces) {
      for (int p = f.place; p >= 0 && slot_[p] < 0; p = columns(p).parent()) {
        slot_[p] = 0;
        path_.push_back(p);
      }
    }
    std::sort(path_.begin(), path_.end());
    x_.reserve(slot_.size() / 4);  // seldom more: growing would double it
    for (const int p : path_) add_slot(p);
    for (const Force& f : forces) x_[slot_[f.place]].col(f.lane) += f.force;
    for (const int p : path_) {
      const Columns c = columns(p);
      Lanes& y = x_[slot_[p]];
      c.diagonal.triangularView<Eigen::Lower>().solveInPlace(y);
      for (int e = 0; e < c.size; e += 3) {
        Lanes& x = x_[slot_[c.row[e] / 3]];
        for (int d = 0; d < 3; ++d) {
          for (int k = 0; k < 3; ++k) x.row(k) -= c.value[d][e + k] * y.row(d);
        }
      }
    }
  }

  const Lanes& displacement(int place) {
    // L' x = y, downward from the first ancestor that is solved.
    path_.clear();
    for (int p = place; p >= 0 && !is_solved(p); p = columns(p).parent()) path_.push_back(p);
    for (auto it = path_.rbegin(); it != path_.rend(); ++it) {
      if (slot_[*it] < 0) add_slot(*it);
      const Columns c = columns(*it);
      // Half of the lanes at a time: their sums then stay in registers.
      constexpr int kHalf = WallCompliance::kGroup / 2;
      for (int half = 0; half < WallCompliance::kGroup; half += kHalf) {
        Eigen::Matrix<double, 3, kHalf, Eigen::RowMajor> sum =
            x_[slot_[*it]].middleCols<kHalf>(half);
        for (int e = 0; e < c.size; e += 3) {
          const auto x = x_[slot_[c.row[e] / 3]].middleCols<kHalf>(half);
          for (int d = 0; d < 3; ++d) {
            for (int k = 0; k < 3; ++k) sum.row(d) -= c.value[d][e + k] * x.row(k);
          }
        }
        x_[slot_[*it]].middleCols<kHalf>(half) = sum;
      }
      c.diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace(x_[slot_[*it]]);
      solved_[slot_[*it]] = 1;
    }
    return x_[slot_[place]];
  }

 private:
  /// The three columns of a vertex: its own block, then rows that they have in common.
  struct Columns {
    Mat3 diagonal;
    int size;
    const int* row;
    std::array<const double*, 3> value;
    int parent() const { return size > 0 ? row[0] / 3 : -1; }
  };
  Columns columns(int place) const {
    const int* outer = L_.outerIndexPtr() + 3 * place;
    const double* values = L_.valuePtr();
    const double *u = values + outer[0], *v = values + outer[1], *w = values + outer[2];
    Columns c{.diagonal = Mat3::Zero(),
              .size = outer[3] - outer[2] - 1,
              .row = L_.innerIndexPtr() + outer[2] + 1,
              .value = {u + 3, v + 2, w + 1}};
    c.diagonal << u[0], 0.0, 0.0, u[1], v[0], 0.0, u[2], v[1], w[0];
    return c;
  }
  bool is_solved(int place) const { return slot_[place] >= 0 && solved_[slot_[place]] != 0; }
  void add_slot(int place) {
    slot_[place] = static_cast<int>(x_.size());
    x_.push_back(Lanes::Zero());
    solved_.push_back(0);
  }

  const SparseMatrix& L_;
  std::vector<int> slot_;  // of each place in x_; -1: not read so far
  std::vector<Lanes> x_;
  std::vector<char> solved_;  // of each slot
  std::vector<int> path_;
};

}  // namespace

Eigen::SparseMatrix<double> wall_stiffness(const Surface& surface, const Wall& wall) {
  std::vector<int> place(static_cast<std::size_t>(surface.vertices.cols()));
  for (std::size_t a = 0; a < place.size(); ++a) place[a] = static_cast<int>(a);
  return expand(assemble(surface, wall), place);
}

WallCompliance::WallCompliance(const Surface& surface, const Wall& wall)
    : normals_(vertex_normals(surface)),
      responses_(static_cast<std::size_t>(surface.vertices.cols())) {
  BlockStiffness blocks = assemble(surface, wall);
  place_ = elimination_places(blocks);
  const SparseMatrix stiffness = expand(blocks, place_);
  neighbour_start_ = std::move(blocks.start);
  neighbour_ = std::move(blocks.neighbour);
  find_groups();

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
}

WallCompliance::~WallCompliance() {
  for (const std::atomic<const Response*>& response : responses_) delete response.load();
}

void WallCompliance::find_groups() {
  group_of_.assign(place_.size(), -1);
  group_start_ = {0};
  for (int a = 0; a < static_cast<int>(place_.size()); ++a) {
    if (place_[a] < 0 || group_of_[a] >= 0) continue;
    // Breadth first over vertices that have no group yet.
    const int number = static_cast<int>(group_start_.size()) - 1;
    const std::size_t start = group_.size();
    group_.push_back(a);
    group_of_[a] = number;
    for (std::size_t at = start; at < group_.size(); ++at) {
      for (int e = neighbour_start_[group_[at]]; e < neighbour_start_[group_[at] + 1]; ++e) {
        const int b = neighbour_[e];
        if (group_of_[b] >= 0 || group_.size() == start + kGroup) continue;
        group_.push_back(b);
        group_of_[b] = number;
      }
    }
    group_start_.push_back(static_cast<int>(group_.size()));
  }
}

const WallCompliance::Response& WallCompliance::response(int vertex) const {
  expects(vertex >= 0 && vertex < normals_.cols() && place_[vertex] >= 0);
  const Response* kept = responses_[vertex].load(std::memory_order_acquire);
  return kept != nullptr ? *kept : find_group(vertex);
}

const WallCompliance::Response& WallCompliance::find_group(int vertex) const {
  // Two threads may find the same group; both find the same responses, and one of each is kept.
  const int* first = group_.data() + group_start_[group_of_[vertex]];
  const int* last = group_.data() + group_start_[group_of_[vertex] + 1];
  std::vector<Response> found = find_responses({first, last});
  for (const int* member = first; member != last; ++member) {
    auto response = std::make_unique<const Response>(std::move(found[member - first]));
    const Response* none = nullptr;
    if (!responses_[*member].compare_exchange_strong(none, response.get(),
                                                     std::memory_order_acq_rel)) {
      continue;
    }
    ++response_count_;
    response_bytes_ +=
        sizeof(Response) + response->vertices.size() * (sizeof(int) + sizeof(double));
    (void)response.release();
  }
  return *responses_[vertex].load(std::memory_order_acquire);
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

std::vector<WallCompliance::Response> WallCompliance::find_responses(
    const std::vector<int>& group) const {
  using Lane = Eigen::Array<double, 1, kGroup>;
  const int count = static_cast<int>(group.size());
  std::vector<TreeSolver::Force> forces;
  for (int lane = 0; lane < count; ++lane) {
    for_each_part(group[lane], [&](int b, double part) {
      forces.push_back({place_[b], lane, part * normals_.col(b)});
    });
  }
  TreeSolver solver(cholesky_.matrixL().nestedExpression(), forces);

  // Normal motion of the vertices looked at so far, at their numbers.
  std::vector<int> number(static_cast<std::size_t>(normals_.cols()), -1);
  std::vector<Lane> normal;
  const auto look_at = [&](int b) -> Lane {
    const auto& displacement = solver.displacement(place_[b]);
    if (number[b] < 0) {
      number[b] = static_cast<int>(normal.size());
      normal.push_back(normals_.col(b).transpose() * displacement);
    }
    return displacement.colwise().norm();
  };
  const auto motion_of_point = [&](int b) {
    Lane displacement = Lane::Zero();
    for_each_part(b, [&](int c, double part) { displacement += part * normal[number[c]]; });
    return displacement;
  };

  // Rings of neighbours, breadth first, until a whole ring hardly moves, in whatever direction:
  // past a sharp edge of the surface a sideways motion is a normal one.
  Lane least = Lane::Constant(std::numeric_limits<double>::infinity());
  for (int lane = 0; lane < count; ++lane) {
    for_each_part(group[lane], [&](int b, double) { look_at(b); });
    least[lane] = kKeptFraction * motion_of_point(group[lane])[lane];
  }
  std::vector<char> seen(static_cast<std::size_t>(normals_.cols()), 0);
  for (const int a : group) seen[a] = 1;
  std::vector<int> ring = group, next, inner;
  for (bool moves = true; moves && !ring.empty(); std::swap(ring, next)) {
    next.clear();
    moves = false;
    inner.insert(inner.end(), ring.begin(), ring.end());
    for (const int a : ring) {
      for (int e = neighbour_start_[a]; e < neighbour_start_[a + 1]; ++e) {
        const int b = neighbour_[e];
        if (seen[b] != 0) continue;
        seen[b] = 1;
        moves = (look_at(b) >= least).any() || moves;
        next.push_back(b);
      }
    }
  }

  // What a point at each of them moves by, in ascending order.
  std::sort(inner.begin(), inner.end());
  std::vector<Response> responses(group.size());
  for (const int b : inner) {
    const Lane displacement = motion_of_point(b);
    for (int lane = 0; lane < count; ++lane) {
      if (std::abs(displacement[lane]) < least[lane]) continue;
      responses[lane].vertices.push_back(b);
      responses[lane].displacement.push_back(displacement[lane]);
    }
  }
  for (Response& response : responses) {
    response.vertices.shrink_to_fit();
    response.displacement.shrink_to_fit();
  }
  return responses;
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
         (neighbour_start_.size() + neighbour_.size() + place_.size() + group_of_.size() +
          group_start_.size() + group_.size()) *
             sizeof(int) +
         static_cast<std::size_t>(normals_.size()) * sizeof(double) +
         responses_.size() * sizeof(responses_[0]) + response_bytes_;
}

}  // namespace wireplan::simulate
