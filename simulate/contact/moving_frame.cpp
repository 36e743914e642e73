#include "simulate/contact/moving_frame.h"

#include <Eigen/LU>

namespace wireplan::simulate {

namespace {

/// A place is found to within this and then put right to first order, which leaves some 1e-15 mm
/// and parts of 1e-8 of G [mm].
constexpr double kNear = 1e-7;
constexpr int kMostCarries = 40;

/// No step of the place is longer: where sections are pushed together G is nearly singular [mm].
constexpr double kLongest = 4.0;

/// Weights this near to where the chain was asked are those of there to second order: what that
/// leaves, by third derivatives of some 0.02/mm^3, is 4e-10 of them [mm].
constexpr double kSeries = 5e-3;

/// For steps no longer than this the inverse of G of before does: where sections moved by as much
/// since, it is some 1e-4 off [mm].
constexpr double kTurned = 2e-3;

/// Within this they lead on to where the chain is asked next, as long as steps are longer than
/// that, so often at most [mm].
constexpr double kGuessed = 2.0, kGuessing = 0.1;
constexpr int kGuesses = 3;

}  // namespace

/// Asks the chain.
void MovingFrame::look(const SectionChain& chain) {
  chain.find_weights(rest_, true, known_);
  known_place_ = rest_;
  weights_ = known_;
}

/// By the series.
void MovingFrame::carry_weights() {
  const Vec3 moved = rest_ - known_place_;
  for (std::size_t k = 0; k < known_.size(); ++k) {
    const Vec3 turned = known_[k].bend * moved;
    weights_[k].value = known_[k].value + moved.dot(known_[k].slope + 0.5 * turned);
    weights_[k].slope = known_[k].slope + turned;
  }
}

/// What is left of a point without its place at rest and how far that has moved.
Vec3 MovingFrame::missing(const Eigen::Matrix3Xd& u, const Vec3& point) const {
  Vec3 left = point - rest_;
  for (const SectionChain::Weight& weight : weights_) {
    left -= weight.value * u.col(weight.node);
  }
  return left;
}

void MovingFrame::find_inverse(const Eigen::Matrix3Xd& u) {
  Mat3 G = Mat3::Identity();
  for (const SectionChain::Weight& weight : weights_) {
    const double* const moved = u.data() + 3 * weight.node;
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) G(r, c) += moved[r] * weight.slope[c];
    }
  }
  inverse_ = G.inverse();
}

void MovingFrame::find(const SectionChain& chain, const Eigen::Matrix3Xd& u, const Vec3& point) {
  if (known_.empty()) {
    rest_ = point;
    look(chain);
    find_inverse(u);
  }
  for (int round = 0; round < kMostCarries; ++round) {
    // The inverse of before does for short steps.
    Vec3 left = missing(u, point), step = inverse_ * left;
    if (step.squaredNorm() > kTurned * kTurned) {
      find_inverse(u);
      step = inverse_ * left;
    }
    const double length = step.norm(), away = (rest_ - known_place_).norm();
    if (length <= kNear && away <= kSeries) {
      find_inverse(u);
      step = inverse_ * left;
      rest_ += step;
      for (SectionChain::Weight& weight : weights_) weight.value += weight.slope.dot(step);
      return;
    }
    if (!(length <= kLongest)) {
      step = length < 1e300 ? Vec3((kLongest / length) * step) : Vec3(left.normalized());
    }
    rest_ += step;
    // Where the series alone leads, the chain is asked once it is there.
    const double next = (rest_ - known_place_).norm();
    const bool there = length <= kGuessing || round >= kGuesses;
    if (next <= kSeries || (next <= kGuessed && !there)) {
      carry_weights();
    } else {
      look(chain);
    }
  }
}

void MovingFrame::find_bend(const Eigen::Matrix3Xd& u, const Vec3& force, Mat3& B,
                            std::vector<Vec3>& r) const {
  B.setZero();
  r.clear();
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    B += force.dot(u.col(weights_[k].node)) * known_[k].bend;
    r.emplace_back(inverse_.transpose() * weights_[k].slope);
  }
}

Eigen::Matrix3Xd places_at_rest(const SectionChain* chain, const Eigen::Matrix3Xd& u,
                                Eigen::Matrix3Xd points) {
  if (chain == nullptr) return points;
  MovingFrame frame;  // each from where the one before was
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    frame.find(*chain, u, points.col(i));
    points.col(i) = frame.rest();
  }
  return points;
}

Eigen::Matrix3Xd end_at_rest(const SectionChain& chain, const Eigen::Matrix3Xd& u,
                             const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, double length) {
  Eigen::Matrix3Xd places(3, nodes.cols());
  MovingFrame frame;
  Eigen::Index first = nodes.cols();
  for (double passed = 0.0; first > 0 && passed < length;) {
    frame.find(chain, u, nodes.col(--first));
    places.col(first) = frame.rest();
    if (first + 1 < nodes.cols()) passed += (places.col(first + 1) - places.col(first)).norm();
  }
  return places.rightCols(nodes.cols() - first);
}

}  // namespace wireplan::simulate
