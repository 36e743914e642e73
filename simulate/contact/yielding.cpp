#include "simulate/contact/yielding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace wireplan::simulate {

void Yielding::Envelope::clear() {
  first_.clear();
  offset_.clear();
  values_.clear();
}

void Yielding::Envelope::add_row(int first) {
  offset_.push_back(static_cast<std::ptrdiff_t>(values_.size()) - first);
  values_.resize(values_.size() + static_cast<std::size_t>(size() - first + 1));
  first_.push_back(first);
}

void Yielding::grow() {
  const std::size_t side = std::max(kSmallestTable, 2 * table_side_);
  std::vector<double> grown(side * side);
  for (std::size_t row = 0; row < table_side_; ++row) {
    std::copy_n(table_.begin() + static_cast<std::ptrdiff_t>(row * table_side_), table_side_,
                grown.begin() + static_cast<std::ptrdiff_t>(row * side));
  }
  table_ = std::move(grown);
  for (std::size_t row = side; row-- > table_side_;) free_rows_.push_back(static_cast<int>(row));
  vertex_.resize(side);
  half_.resize(side);
  table_side_ = side;
}

void Yielding::free_rows(const std::vector<SurfacePoint>& feet) {
  needed_.assign(table_side_, 0);
  for (const SurfacePoint& foot : feet) {
    if (foot.triangle < 0) continue;
    for (const int vertex : foot.vertex) {
      const int row = row_[static_cast<std::size_t>(vertex)];
      if (row >= 0) needed_[static_cast<std::size_t>(row)] = 1;
    }
  }
  for (std::size_t row = 0; row < table_side_; ++row) {
    if (needed_[row] != 0) continue;
    row_[static_cast<std::size_t>(vertex_[row])] = kNoRow;
    free_rows_.push_back(static_cast<int>(row));
  }
}

int Yielding::row_of(const WallCompliance& wall, int vertex,
                     const std::vector<SurfacePoint>& feet) {
  int& row = row_[static_cast<std::size_t>(vertex)];
  if (row >= 0) return row;
  if (free_rows_.empty()) free_rows(feet);
  if (free_rows_.empty()) grow();
  row = free_rows_.back();
  free_rows_.pop_back();
  vertex_[static_cast<std::size_t>(row)] = vertex;
  half_[static_cast<std::size_t>(row)] = &wall.half_response(vertex);
  for (int other = 0; other < static_cast<int>(table_side_); ++other) {
    entry(row, other) = entry(other, row) = std::numeric_limits<double>::quiet_NaN();
  }
  return row;
}

void Yielding::find_entry(int a, int b) {
  if (!std::isnan(entry(a, b))) return;
  entry(a, b) = entry(b, a) = WallCompliance::between(*half_[static_cast<std::size_t>(a)],
                                                      *half_[static_cast<std::size_t>(b)]);
}

void Yielding::find_known(const std::vector<SurfacePoint>& feet) {
  constexpr std::size_t kMostGone = 8;  // in a row; chosen
  known_.assign(feet.size(), -1);
  std::size_t next = 0;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const std::size_t end = std::min(feet_.size(), next + kMostGone);
    for (std::size_t k = next; k < end; ++k) {
      if (feet_[k].triangle != feet[i].triangle || feet_[k].weight != feet[i].weight) continue;
      known_[i] = static_cast<int>(k);
      next = k + 1;
      break;
    }
  }
}

void Yielding::set_feet(const WallCompliance& wall, const std::vector<SurfacePoint>& feet) {
  row_.resize(static_cast<std::size_t>(wall.normals().cols()), kNoRow);
  const std::size_t m = feet.size();
  squared_reach_ = wall.reach() * wall.reach();
  foot_rows_.resize(m);
  foot_place_.resize(3, static_cast<Eigen::Index>(m));
  for (std::size_t i = 0; i < m; ++i) {
    const bool stands = feet[i].triangle >= 0;
    for (std::size_t a = 0; a < 3; ++a) {
      foot_rows_[i][a] = stands ? row_of(wall, feet[i].vertex[a], feet) : kNoRow;
    }
    if (stands)
      foot_place_.col(static_cast<Eigen::Index>(i)) = wall.vertices().col(feet[i].vertex[0]);
  }

  // Rows of C, each from the first foot that moves under a force at its own. What the table does
  // not know yet makes a sum that is no number.
  const auto compliance_between = [&](std::size_t i, std::size_t j) {
    if (known_[i] >= 0 && known_[j] >= 0) {
      return known_[j] >= before_.first(known_[i]) ? before_.row(known_[i])[known_[j]] : 0.0;
    }
    if (!may_couple(i, j)) return 0.0;
    const std::array<int, 3>&rows = foot_rows_[i], &columns = foot_rows_[j];
    const Vec3 &u = feet[i].weight, &v = feet[j].weight;
    const auto sum = [&] {
      const auto part = [&](std::size_t a) {
        const double* row = &entry(rows[a], 0);
        return v[0] * row[columns[0]] + v[1] * row[columns[1]] + v[2] * row[columns[2]];
      };
      return u[0] * part(0) + u[1] * part(1) + u[2] * part(2);
    };
    const double known = sum();
    if (!std::isnan(known)) return known;
    for (const int row : rows) {
      for (const int column : columns) find_entry(row, column);
    }
    return sum();
  };
  find_known(feet);
  std::swap(compliance_, before_);
  compliance_.clear();
  for (std::size_t i = 0; i < m; ++i) {
    std::size_t first = 0;
    while (first < i && compliance_between(i, first) == 0.0) ++first;
    compliance_.add_row(static_cast<int>(first));
    double* row = compliance_.row(static_cast<int>(i));
    for (std::size_t j = first; j <= i; ++j) row[j] = compliance_between(i, j);
  }
  feet_ = feet;
}

void Yielding::find_slopes(const std::vector<SurfacePoint>& feet, const std::vector<Mat3>& slopes) {
  slope_.resize(compliance_.entries());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    auto* slope = slope_.data() + compliance_.offset(static_cast<int>(i));
    for (std::size_t j = static_cast<std::size_t>(first_coupled(static_cast<int>(i))); j <= i;
         ++j) {
      if (!may_couple(i, j)) {
        slope[j].setZero();
        continue;
      }
      Mat3 response;  // between the vertices of either foot
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          response(static_cast<int>(a), static_cast<int>(b)) =
              entry(foot_rows_[i][a], foot_rows_[j][b]);
        }
      }
      slope[j].col(0) = slopes[i].transpose() * (response * feet[j].weight);
      slope[j].col(1) = slopes[j].transpose() * (response.transpose() * feet[i].weight);
    }
  }
}

void Yielding::add_change_of_compliance(const Eigen::Matrix3Xd& motion, const Eigen::VectorXd& f,
                                        Eigen::VectorXd& w) const {
  for (int i = 0; i < size(); ++i) {
    const auto* row = slope_.data() + compliance_.offset(i);
    for (int j = first_coupled(i); j <= i; ++j) {
      const double change = row[j].col(0).dot(motion.col(i)) + row[j].col(1).dot(motion.col(j));
      w[i] += change * f[j];
      if (j < i) w[j] += change * f[i];
    }
  }
}

void Yielding::multiply_by_compliance(const Eigen::VectorXd& f, Eigen::VectorXd& w) const {
  w.setZero(size());
  for (int i = 0; i < size(); ++i) {
    const int first = first_coupled(i), before = i - first;
    const Eigen::Map<const Eigen::VectorXd> row(compliance_.row(i) + first, before);
    w[i] += row.dot(f.segment(first, before)) + compliance_.row(i)[i] * f[i];
    w.segment(first, before) += row * f[i];
  }
}

void Yielding::factor() {
  stiff_.clear();
  place_.clear();
  factor_.clear();
  reciprocal_.clear();
  for (int i = 0; i < size(); ++i) {
    place_.push_back(root_[i] > 0.0 ? factor_.size() : -1);
    if (root_[i] == 0.0) continue;
    const int p = factor_.size();
    int first = p;
    while (first > 0 && stiff_[static_cast<std::size_t>(first - 1)] >= first_coupled(i)) --first;
    stiff_.push_back(i);
    factor_.add_row(first);
    const double* c = compliance_.row(i);
    double* row = factor_.row(p);
    for (int q = first; q <= p; ++q) {
      const int j = stiff_[static_cast<std::size_t>(q)];
      const double* above = factor_.row(q);
      double sum = root_[i] * c[j] * root_[j];
      for (int k = std::max(first, factor_.first(q)); k < q; ++k) sum -= row[k] * above[k];
      row[q] = q < p ? sum * reciprocal_[static_cast<std::size_t>(q)] : std::sqrt(1.0 + sum);
    }
    reciprocal_.push_back(1.0 / row[p]);
  }
}

void Yielding::solve_factored(Eigen::VectorXd& v) {
  const int count = factor_.size();
  stiff_values_.resize(count);
  double* x = stiff_values_.data();
  for (int p = 0; p < count; ++p) {
    const double* row = factor_.row(p);
    x[p] = v[stiff_[static_cast<std::size_t>(p)]];
    for (int q = factor_.first(p); q < p; ++q) x[p] -= row[q] * x[q];
    x[p] *= reciprocal_[static_cast<std::size_t>(p)];
  }
  for (int p = count - 1; p >= 0; --p) {
    const double* row = factor_.row(p);
    x[p] *= reciprocal_[static_cast<std::size_t>(p)];
    for (int q = factor_.first(p); q < p; ++q) x[q] -= row[q] * x[p];
    v[stiff_[static_cast<std::size_t>(p)]] = x[p];
  }
}

double Yielding::solve(const ContactLaw& law, const Eigen::VectorXd& gap,
                       const Eigen::VectorXd& share, Eigen::VectorXd& force, Eigen::VectorXd& w) {
  constexpr int kMostRounds = 100;
  constexpr double kTolerance = 1e-12;  // of the displacements                           [mm]
  const int m = size();
  root_.resize(m);
  lawful_.resize(m);
  // The wall lies as `force` presses it; `lawful_` is what the law presses then.
  double law_energy = 0.0;
  const auto evaluate = [&] {
    law_energy = 0.0;
    for (int i = 0; i < m; ++i) {
      const ContactLaw::Value value = law.at(gap[i] + w[i]);
      law_energy += share[i] * value.energy;
      lawful_[i] = -share[i] * value.slope;
      root_[i] = std::sqrt(share[i] * value.curvature);
    }
    return law_energy + 0.5 * force.dot(w);
  };
  multiply_by_compliance(force, w);
  double energy = evaluate();
  for (int round = 0; round < kMostRounds; ++round) {
    // Newton on the energy, convex in w: the step takes the forces to lawful_ + z, with z = D^1/2
    // (I + D^1/2 C D^1/2)^-1 D^1/2 (w - C lawful_).
    residual_ = lawful_ - force;
    multiply_by_compliance(residual_, step_);  // C lawful_ - w
    if (m == 0 || step_.cwiseAbs().maxCoeff() <= kTolerance) break;
    factor();
    residual_ = -step_.cwiseProduct(root_);
    solve_factored(residual_);
    step_ = lawful_ + residual_.cwiseProduct(root_) - force;
    multiply_by_compliance(step_, residual_);
    const double slope = residual_.dot(force - lawful_);
    double part = 1.0, before = energy;
    force += step_;
    w += residual_;
    energy = evaluate();
    while (energy > before + 1e-4 * part * slope + 1e-15 * std::abs(before) && part > 1e-6) {
      force -= 0.5 * part * step_;
      w -= 0.5 * part * residual_;
      part *= 0.5;
      energy = evaluate();
    }
  }
  force = lawful_;
  return law_energy;
}

void Yielding::find_stiffness(const Eigen::VectorXd& law_stiffness) {
  root_ = law_stiffness.cwiseSqrt();
  factor();
  // Inverse of the factored matrix within the envelope (Takahashi), from the last row upward. Rows
  // k > j couple with j where their envelope reaches it; two of them then couple with each other.
  inverse_ = factor_;
  last_coupled_.resize(stiff_.size());
  for (int i = 0; i < factor_.size(); ++i) {
    for (int j = factor_.first(i); j <= i; ++j) last_coupled_[static_cast<std::size_t>(j)] = i;
  }
  for (int j = factor_.size() - 1; j >= 0; --j) {
    const double diagonal = factor_.row(j)[j];
    const int last = last_coupled_[static_cast<std::size_t>(j)];
    const auto couples = [&](int k) { return factor_.first(k) <= j; };
    for (int i = last; i >= j; --i) {
      if (!couples(i)) continue;
      double sum = i == j ? 1.0 / diagonal : 0.0;
      for (int k = j + 1; k <= last; ++k) {
        if (!couples(k)) continue;
        sum -= factor_.row(k)[j] * inverse_.row(std::max(i, k))[std::min(i, k)];
      }
      inverse_.row(i)[j] = sum / diagonal;
    }
  }
}

double Yielding::stiffness(int i, int j) const {
  const int p = place_[static_cast<std::size_t>(i)], q = place_[static_cast<std::size_t>(j)];
  if (p < 0 || q < 0 || q < factor_.first(p)) return 0.0;
  return root_[i] * inverse_.row(p)[q] * root_[j];
}

void Yielding::multiply_by_stiffness(Eigen::VectorXd& v) {
  v.array() *= root_.array();
  solve_factored(v);
  v.array() *= root_.array();
}

}  // namespace wireplan::simulate
