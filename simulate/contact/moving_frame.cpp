#include "simulate/contact/moving_frame.h"

#include <Eigen/LU>

namespace wireplan::simulate {

namespace {

/// A place is found to within this and then put right to first order, which leaves some 1e-15 mm
/// and parts of 1e-8 of G [mm].
constexpr double kNear = 1e-7;
constexpr int kMostRounds = 40;

/// No step of the place is longer: where sections are pushed together G is nearly singular [mm].
constexpr double kLongest = 4.0;

}  // namespace

void MovingFrame::find(const SectionChain& chain, const Eigen::Matrix3Xd& u, const Vec3& point) {
  if (weights.empty()) {
    rest = point;
    chain.find_weights(rest, false, weights);
  }
  for (int round = 0; round < kMostRounds; ++round) {
    Vec3 moved = Vec3::Zero();
    Mat3 G = Mat3::Identity();
    for (const SectionChain::Weight& weight : weights) {
      moved += weight.value * u.col(weight.node);
      G += u.col(weight.node) * weight.slope.transpose();
    }
    inverse = G.inverse();
    const Vec3 missing = point - rest - moved;
    Vec3 step = inverse * missing;
    const double length = step.norm();
    if (length <= kNear) {
      rest += step;
      for (SectionChain::Weight& weight : weights) weight.value += weight.slope.dot(step);
      return;
    }
    if (!(length <= kLongest)) {
      step = length < 1e300 ? Vec3((kLongest / length) * step) : Vec3(missing.normalized());
    }
    rest += step;
    chain.find_weights(rest, false, weights);
  }
}

void MovingFrame::find_bend(const SectionChain& chain, const Eigen::Matrix3Xd& u, const Vec3& force,
                            Mat3& B, std::vector<Vec3>& r,
                            std::vector<SectionChain::Weight>& scratch) const {
  chain.find_weights(rest, true, scratch);
  B.setZero();
  r.clear();
  for (const SectionChain::Weight& weight : scratch)
    B += force.dot(u.col(weight.node)) * weight.bend;
  for (const SectionChain::Weight& weight : weights) {
    r.emplace_back(inverse.transpose() * weight.slope);
  }
}

}  // namespace wireplan::simulate
