#include "simulate/yielding.h"

#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

int Yielding::slot_of(const WallCompliance& wall, int vertex) {
  const auto known = std::lower_bound(
      slots_.begin(), slots_.end(), vertex,
      [](const std::pair<int, int>& entry, int wanted) { return entry.first < wanted; });
  if (known != slots_.end() && known->first == vertex) return known->second;
  const int slot = static_cast<int>(slots_.size());
  const WallCompliance::Response& response = wall.response(vertex);
  double* row = table_.data() + static_cast<std::size_t>(slot) * table_side_;
  auto from = response.vertices.begin();
  slots_.insert(known, {vertex, slot});
  for (const auto& [other, place] : slots_) {  // ascending, as the response is
    from = std::lower_bound(from, response.vertices.end(), other);
    const bool found = from != response.vertices.end() && *from == other;
    const double c =
        found ? response.displacement[static_cast<std::size_t>(from - response.vertices.begin())]
              : 0.0;
    row[place] = c;
    table_[static_cast<std::size_t>(place) * table_side_ + static_cast<std::size_t>(slot)] = c;
  }
  return slot;
}

void Yielding::set_feet(const WallCompliance& wall, const std::vector<SurfacePoint>& feet) {
  const std::size_t m = feet.size();
  start_.resize(m);
  offset_.resize(m);
  compliance_.values.clear();

  // The feet's vertices in the table; when it is full, it starts anew with these.
  if (slots_.size() + 3 * m > table_side_) {
    slots_.clear();
    table_side_ = std::max({table_side_, kSmallestTable, 2 * 3 * m});
    table_.resize(table_side_ * table_side_);
  }
  foot_slots_.resize(m);
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      foot_slots_[i][a] = feet[i].triangle < 0 ? 0 : slot_of(wall, feet[i].vertex[a]);
    }
  }

  // Rows of C, each from the first foot that moves under a force at its own.
  const auto compliance_between = [&](std::size_t i, std::size_t j) {
    double sum = 0.0;
    for (int a = 0; a < 3; ++a) {
      const double* row =
          table_.data() +
          static_cast<std::size_t>(foot_slots_[i][static_cast<std::size_t>(a)]) * table_side_;
      sum += feet[i].weight[a] * (feet[j].weight[0] * row[foot_slots_[j][0]] +
                                  feet[j].weight[1] * row[foot_slots_[j][1]] +
                                  feet[j].weight[2] * row[foot_slots_[j][2]]);
    }
    return sum;
  };
  for (std::size_t i = 0; i < m; ++i) {
    std::size_t first = 0;
    while (first < i && compliance_between(i, first) == 0.0) ++first;
    start_[i] = static_cast<int>(first);
    offset_[i] = static_cast<std::ptrdiff_t>(compliance_.values.size());
    for (std::size_t j = first; j <= i; ++j) {
      compliance_.values.push_back(compliance_between(i, j));
    }
  }
  last_coupled_.resize(m);
  for (int i = 0; i < size(); ++i) {
    for (int j = first_coupled(i); j <= i; ++j) last_coupled_[static_cast<std::size_t>(j)] = i;
  }
  factor_.values.resize(compliance_.values.size());
  inverse_.values.resize(compliance_.values.size());
}

void Yielding::find_slopes(const std::vector<SurfacePoint>& feet, const std::vector<Mat3>& slopes) {
  slope_.resize(compliance_.values.size());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const std::size_t first = static_cast<std::size_t>(start_[i]);
    for (std::size_t j = first; j <= i; ++j) {
      Mat3 response;  // between the vertices of either foot
      for (std::size_t a = 0; a < 3; ++a) {
        const double* row =
            table_.data() + static_cast<std::size_t>(foot_slots_[i][a]) * table_side_;
        for (std::size_t b = 0; b < 3; ++b) {
          response(static_cast<int>(a), static_cast<int>(b)) = row[foot_slots_[j][b]];
        }
      }
      auto& slope = slope_[static_cast<std::size_t>(offset_[i]) + j - first];
      slope.col(0) = slopes[i].transpose() * (response * feet[j].weight);
      slope.col(1) = slopes[j].transpose() * (response.transpose() * feet[i].weight);
    }
  }
}

void Yielding::add_change_of_compliance(const Eigen::Matrix3Xd& motion, const Eigen::VectorXd& f,
                                        Eigen::VectorXd& w) const {
  for (int i = 0; i < size(); ++i) {
    const auto* row = slope_.data() + offset_[static_cast<std::size_t>(i)] - first_coupled(i);
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
    const double* row = compliance_.row(*this, i);
    for (int j = first_coupled(i); j < i; ++j) {
      w[i] += row[j] * f[j];
      w[j] += row[j] * f[i];
    }
    w[i] += row[i] * f[i];
  }
}

void Yielding::factor() {
  for (int i = 0; i < size(); ++i) {
    const double* c = compliance_.row(*this, i);
    double* row = factor_.row(*this, i);
    for (int j = first_coupled(i); j <= i; ++j) {
      double sum = root_[i] * c[j] * root_[j];
      const double* above = factor_.row(*this, j);
      const int first = std::max(first_coupled(i), first_coupled(j));
      sum -= Eigen::Map<const Eigen::VectorXd>(row + first, j - first)
                 .dot(Eigen::Map<const Eigen::VectorXd>(above + first, j - first));
      row[j] = j < i ? sum / above[j] : std::sqrt(1.0 + sum);
    }
  }
}

void Yielding::solve_factored(Eigen::VectorXd& v) const {
  for (int i = 0; i < size(); ++i) {
    const double* row = factor_.row(*this, i);
    for (int k = first_coupled(i); k < i; ++k) v[i] -= row[k] * v[k];
    v[i] /= row[i];
  }
  for (int i = size() - 1; i >= 0; --i) {
    const double* row = factor_.row(*this, i);
    v[i] /= row[i];
    for (int k = first_coupled(i); k < i; ++k) v[k] -= row[k] * v[i];
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
  for (int j = size() - 1; j >= 0; --j) {
    const double diagonal = factor_.row(*this, j)[j];
    const int last = last_coupled_[static_cast<std::size_t>(j)];
    const auto couples = [&](int k) { return first_coupled(k) <= j; };
    for (int i = last; i >= j; --i) {
      if (!couples(i)) continue;
      double sum = i == j ? 1.0 / diagonal : 0.0;
      for (int k = j + 1; k <= last; ++k) {
        if (!couples(k)) continue;
        sum -= factor_.row(*this, k)[j] * inverse_.row(*this, std::max(i, k))[std::min(i, k)];
      }
      inverse_.row(*this, i)[j] = sum / diagonal;
    }
  }
}

double Yielding::stiffness(int i, int j) const {
  if (j < first_coupled(i)) return 0.0;
  return root_[i] * inverse_.row(*this, i)[j] * root_[j];
}

void Yielding::multiply_by_stiffness(Eigen::VectorXd& v) const {
  v.array() *= root_.array();
  solve_factored(v);
  v.array() *= root_.array();
}

}  // namespace wireplan::simulate
