#include "simulate/contact/yielding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "simulate/wire/lanes.h"

namespace wireplan::simulate {

void Yielding::Envelope::reset(const std::vector<int>& first) {
  end_.resize(first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    std::fill(end_.begin() + first[i], end_.begin() + static_cast<std::ptrdiff_t>(i) + 1,
              static_cast<int>(i) + 1);
  }
  rows_.clear();
  std::size_t offset = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    rows_.push_back({first[i], static_cast<std::size_t>(end_[i] - first[i]), offset});
    offset += rows_.back().size;
  }
  values_.assign(offset, 0.0);
}

// ---------------------------------------------------------------- C

namespace {

constexpr std::size_t kInBox = 8;  // feet
constexpr double kFar = std::numeric_limits<double>::infinity();

}  // namespace

bool Yielding::may_couple(std::size_t i, std::size_t j) const {
  if (table_.rows_of(i)[0] == ComplianceTable::kNoRow ||
      table_.rows_of(j)[0] == ComplianceTable::kNoRow) {
    return false;
  }
  const auto from = foot_place_.col(static_cast<Eigen::Index>(i));
  const auto to = foot_place_.col(static_cast<Eigen::Index>(j));
  return (from - to).squaredNorm() <= squared_reach_;
}

bool Yielding::may_couple(std::size_t i, const Box& box) const {
  const auto place = foot_place_.col(static_cast<Eigen::Index>(i));
  const Vec3 off = (box.low - place).cwiseMax(place - box.high).cwiseMax(0.0);
  return off.squaredNorm() <= squared_reach_;
}

/// Round the feet's vertices; of points without a foot, nothing.
void Yielding::find_boxes() {
  const auto m = static_cast<std::size_t>(foot_place_.cols());
  boxes_.assign((m + kInBox - 1) / kInBox, {Vec3::Constant(kFar), Vec3::Constant(-kFar)});
  for (std::size_t i = 0; i < m; ++i) {
    if (table_.rows_of(i)[0] == ComplianceTable::kNoRow) continue;
    Box& box = boxes_[i / kInBox];
    box.low = box.low.cwiseMin(foot_place_.col(static_cast<Eigen::Index>(i)));
    box.high = box.high.cwiseMax(foot_place_.col(static_cast<Eigen::Index>(i)));
  }
}

double Yielding::compliance_between(const std::vector<SurfacePoint>& feet, std::size_t i,
                                    std::size_t j) {
  if (known_[i] >= 0 && known_[j] >= 0) {
    return known_[j] >= before_.first(known_[i]) ? before_.row(known_[i])[known_[j]] : 0.0;
  }
  if (!may_couple(i, j)) return 0.0;
  return table_.between(table_.rows_of(i), feet[i].weight, table_.rows_of(j), feet[j].weight);
}

/// The first foot that moves under a force at the i-th, or it itself.
int Yielding::find_first_coupled(const std::vector<SurfacePoint>& feet, std::size_t i) {
  if (table_.rows_of(i)[0] == ComplianceTable::kNoRow) return static_cast<int>(i);
  for (std::size_t b = 0; kInBox * b < i; ++b) {
    if (!may_couple(i, boxes_[b])) continue;
    for (std::size_t j = kInBox * b; j < std::min(i, kInBox * (b + 1)); ++j) {
      if (compliance_between(feet, i, j) != 0.0) return static_cast<int>(j);
    }
  }
  return static_cast<int>(i);
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
  const std::size_t m = feet.size();
  squared_reach_ = wall.reach() * wall.reach();
  table_.take(wall, feet);
  foot_place_.resize(3, static_cast<Eigen::Index>(m));
  for (std::size_t i = 0; i < m; ++i) {
    if (feet[i].triangle < 0) continue;
    foot_place_.col(static_cast<Eigen::Index>(i)) = wall.vertices().col(feet[i].vertex[0]);
  }
  find_boxes();
  find_known(feet);
  first_coupled_.resize(m);
  std::swap(compliance_, before_);
  for (std::size_t i = 0; i < m; ++i) first_coupled_[i] = find_first_coupled(feet, i);
  compliance_.reset(first_coupled_);
  for (std::size_t i = 0; i < m; ++i) {
    double* row = compliance_.row(static_cast<int>(i));
    for (auto j = static_cast<std::size_t>(first_coupled_[i]); j <= i; ++j) {
      row[j] = compliance_.row(static_cast<int>(j))[i] = compliance_between(feet, i, j);
    }
  }
  feet_ = feet;
}

namespace {

/// w += the columns of points with a force, times it.
template <class Row>
WIREPLAN_INLINE void add_columns(const Row* columns, const double* values, const double* f,
                                 std::size_t count, double* w) {
  for (std::size_t j = 0; j < count; ++j) {
    if (f[j] == 0.0) continue;
    lanes::add_scaled(f[j], values + columns[j].offset, w + columns[j].first, columns[j].size);
  }
}

template <class Row>
WIREPLAN_WIDE void add_columns_wide(const Row* columns, const double* values, const double* f,
                                    std::size_t count, double* w) {
  add_columns(columns, values, f, count, w);
}

/// w += three columns for each of some points, times their motion.
template <class Row>
WIREPLAN_INLINE void add_slopes(const Row* columns, const std::vector<int>& sloped,
                                const std::vector<std::size_t>& offset, const double* values,
                                const double* motion, double* w) {
  for (std::size_t k = 0; k < sloped.size(); ++k) {
    const auto j = static_cast<std::size_t>(sloped[k]);
    for (std::size_t c = 0; c < 3; ++c) {
      lanes::add_scaled(motion[3 * j + c], values + offset[k] + c * columns[j].size,
                        w + columns[j].first, columns[j].size);
    }
  }
}

template <class Row>
WIREPLAN_WIDE void add_slopes_wide(const Row* columns, const std::vector<int>& sloped,
                                   const std::vector<std::size_t>& offset, const double* values,
                                   const double* motion, double* w) {
  add_slopes(columns, sloped, offset, values, motion, w);
}

}  // namespace

void Yielding::multiply_by_compliance(const Eigen::VectorXd& f, Eigen::VectorXd& w) const {
  w.setZero(size());
  const auto points = static_cast<std::size_t>(size());
  if (has_wide_registers()) {
    add_columns_wide(compliance_.rows(), compliance_.values(), f.data(), points, w.data());
  } else {
    add_columns(compliance_.rows(), compliance_.values(), f.data(), points, w.data());
  }
}

// ---------------------------------------------------------------- how C f changes

void Yielding::find_slopes(const std::vector<SurfacePoint>& feet, const std::vector<Mat3>& slopes,
                           const Eigen::VectorXd& f) {
  own_slope_.setZero(3, size());  // first per weight of each foot, in place of its motion
  sloped_.clear();
  slope_offset_.clear();
  std::size_t offset = 0;
  for (int j = 0; j < size(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    if (f[j] == 0.0) continue;
    const Envelope::Row& column = compliance_.rows()[j];
    sloped_.push_back(j);
    slope_offset_.push_back(offset);
    slopes_.resize(std::max(slopes_.size(), offset + 3 * column.size));
    for (std::size_t k = 0; k < column.size; ++k) {
      const std::size_t i = static_cast<std::size_t>(column.first) + k;
      double* const slope = slopes_.data() + offset + k;
      if (!may_couple(i, at)) {
        for (std::size_t c = 0; c < 3; ++c) slope[c * column.size] = 0.0;
        continue;
      }
      Mat3 response;  // between the vertices of either foot
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          response(static_cast<int>(a), static_cast<int>(b)) =
              table_.entry(table_.rows_of(i)[a], table_.rows_of(at)[b]);
        }
      }
      const Vec3 over_motion =
          f[j] * (slopes[at].transpose() * (response.transpose() * feet[i].weight));
      for (std::size_t c = 0; c < 3; ++c) {
        slope[c * column.size] = over_motion[static_cast<Eigen::Index>(c)];
      }
      own_slope_.col(static_cast<Eigen::Index>(i)) += f[j] * (response * feet[at].weight);
    }
    offset += 3 * column.size;
  }
  for (int i = 0; i < size(); ++i) {
    own_slope_.col(i) =
        (slopes[static_cast<std::size_t>(i)].transpose() * own_slope_.col(i)).eval();
  }
}

void Yielding::add_change_of_compliance(const Eigen::Matrix3Xd& motion, Eigen::VectorXd& w) const {
  for (int i = 0; i < size(); ++i) w[i] += own_slope_.col(i).dot(motion.col(i));
  if (has_wide_registers()) {
    add_slopes_wide(compliance_.rows(), sloped_, slope_offset_, slopes_.data(), motion.data(),
                    w.data());
  } else {
    add_slopes(compliance_.rows(), sloped_, slope_offset_, slopes_.data(), motion.data(), w.data());
  }
}

// ---------------------------------------------------------------- forces

void Yielding::factor() {
  pressed_.clear();
  place_.clear();
  factor_.clear();
  for (int i = 0; i < size(); ++i) {
    place_.push_back(root_[i] > 0.0 ? static_cast<int>(pressed_.size()) : -1);
    if (root_[i] > 0.0) pressed_.push_back(i);
  }
  const int count = static_cast<int>(pressed_.size());
  const auto point = [&](int p) { return pressed_[static_cast<std::size_t>(p)]; };
  for (int begin = 0; begin < count; begin = factor_.rows()) {
    const int end = std::min(count, begin + static_cast<int>(kLane));
    int coupled = point(begin);  // the first point that one of these rows couples with
    for (int p = begin; p < end; ++p) coupled = std::min(coupled, first_coupled(point(p)));
    int first = begin;
    while (first > 0 && point(first - 1) >= coupled) --first;
    factor_.add_rows(first);
    for (int p = begin; p < end; ++p) {
      const int i = point(p);
      const double* c = compliance_.row(i);
      for (int q = p; q >= first && point(q) >= first_coupled(i); --q) {
        factor_.at(p, q) = root_[i] * c[point(q)] * root_[point(q)];
      }
      factor_.at(p, p) += 1.0;
    }
    for (int p = end; p < factor_.rows(); ++p) factor_.at(p, p) = 1.0;
  }
  factor_.factor();
}

void Yielding::solve_factored(Eigen::VectorXd& v) {
  values_.assign(static_cast<std::size_t>(factor_.rows()), 0.0);
  for (std::size_t p = 0; p < pressed_.size(); ++p) values_[p] = v[pressed_[p]];
  factor_.solve(values_.data());
  for (std::size_t p = 0; p < pressed_.size(); ++p) v[pressed_[p]] = values_[p];
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
  factor_.invert();
}

double Yielding::stiffness(int i, int j) const {
  const int p = place_[static_cast<std::size_t>(i)], q = place_[static_cast<std::size_t>(j)];
  return p < 0 || q < 0 || q < first_pressed(p) ? 0.0 : pressed_stiffness(p, q);
}

void Yielding::multiply_by_stiffness(Eigen::VectorXd& v) {
  v.array() *= root_.array();
  solve_factored(v);
  v.array() *= root_.array();
}

}  // namespace wireplan::simulate
