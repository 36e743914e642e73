#include "simulate/wire/bend_to.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace wireplan::simulate {
namespace {

constexpr int kMostSolves = 60;          // most take 4
constexpr double kClosed = 1e-9;         // gap that is none, of the wire's length
constexpr double kMostTurnOfEdge = 0.3;  // of an edge in one round                            [rad]
constexpr double kStraight = 1e-7;       // sine up to which two edges have one direction
// A clamped wire is shorter by so much of its sideways move, squared and over its length.
constexpr double kSidewaysShortens = 0.6;

Mat3 cross(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Rotation vector of the shortest turn from one unit vector to another that is not opposite.
Vec3 turn_between(const Vec3& from, const Vec3& to) {
  const Vec3 axis = from.cross(to);
  const double sine = axis.norm();
  if (sine == 0.0) return Vec3::Zero();
  return (std::atan2(sine, from.dot(to)) / sine) * axis;
}

/// Angle per moment between the edges of a node, or between an end's edge and its clamp.
double compliance_of(const Rod& rod, const DirectedEnds& ends, int i) {
  if (i == 0) return ends.start ? 1.0 / rod.proximal_bend : 0.0;
  if (i == rod.nodes() - 1) return ends.end ? 1.0 / rod.distal_bend : 0.0;
  return 1.0 / rod.bend[i];
}

bool is_straight(const BentWire& wire) {
  const Vec3 along = wire.edges.col(0).normalized();
  for (Eigen::Index i = 1; i < wire.edges.cols(); ++i) {
    const Vec3 edge = wire.edges.col(i);
    if (along.cross(edge).norm() > kStraight * edge.norm()) return false;
  }
  return true;
}

}  // namespace

Mat3 rotation_by(const Vec3& vector) {
  const double angle = vector.norm();
  if (angle == 0.0) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Matrix3Xd find_least_bending(const Rod& rod, const DirectedEnds& ends,
                                    const Eigen::Matrix3Xd& edges, const Vec3& gap,
                                    const Vec3& turn) {
  const int n = rod.nodes();
  const double length = rod.rest_length.sum();
  // Arms from the nodes to the end, in lengths of the wire.
  Eigen::Matrix3Xd arm = Eigen::Matrix3Xd::Zero(3, n);
  for (int i = n - 2; i >= 0; --i) arm.col(i) = arm.col(i + 1) + edges.col(i) / length;
  Eigen::VectorXd compliance(n);
  for (int i = 0; i < n; ++i) compliance[i] = compliance_of(rod, ends, i);
  compliance /= compliance.sum();

  // Unknowns: force, couple, rotation of the start. Rows: gap, turn, moment at the start.
  Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 1> b = Eigen::Matrix<double, 9, 1>::Zero();
  b << gap / length, turn, Vec3::Zero();
  for (int i = 0; i < n; ++i) {
    const Mat3 X = cross(arm.col(i));
    A.block<3, 3>(0, 0) -= compliance[i] * X * X;
    A.block<3, 3>(0, 3) -= compliance[i] * X;
    A.block<3, 3>(3, 0) += compliance[i] * X;
    A.block<3, 3>(3, 3) += compliance[i] * Mat3::Identity();
  }
  if (ends.start) {
    A.block<3, 3>(6, 6).setIdentity();
  } else {
    A.block<3, 3>(0, 6) = -cross(arm.col(0));
    A.block<3, 3>(3, 6).setIdentity();
    A.block<3, 3>(6, 0) = cross(arm.col(0));
    A.block<3, 3>(6, 3).setIdentity();
  }
  if (!ends.end) {  // no couple, and the end turns as it may
    A.block<3, 9>(3, 0).setZero();
    A.block<9, 3>(0, 3).setZero();
    A.block<3, 3>(3, 3).setIdentity();
    b.segment<3>(3).setZero();
  }
  const Eigen::Matrix<double, 9, 1> found = A.completeOrthogonalDecomposition().solve(b);

  Eigen::Matrix3Xd rotations(3, n);
  const Vec3 force = found.segment<3>(0), couple = found.segment<3>(3);
  Vec3 turned = found.segment<3>(6);
  for (int i = 0; i < n; ++i) {
    turned += compliance[i] * (couple + Vec3(arm.col(i)).cross(force));
    rotations.col(i) = turned;
  }
  return rotations;
}

bool bend_to(const Rod& rod, const DirectedEnds& ends, const Vec3& point, const Vec3& direction,
             BentWire& wire) {
  for (int round = 0; round < kMostSolves; ++round) {
    const Vec3 gap = point - wire.end();
    const Vec3 turn = ends.end ? turn_between(wire.end_direction, direction) : Vec3::Zero();
    if (gap.norm() <= kClosed * rod.rest_length.sum() && turn.norm() <= kClosed) return true;
    const Eigen::Matrix3Xd rotations = find_least_bending(rod, ends, wire.edges, gap, turn);
    const double most = std::sqrt(rotations.colwise().squaredNorm().maxCoeff());
    if (!std::isfinite(most)) return false;
    const double part = std::min(1.0, kMostTurnOfEdge / most);
    const Eigen::Index n = rotations.cols();
    for (Eigen::Index i = 0; i + 1 < n; ++i) {
      wire.edges.col(i) = (rotation_by(part * rotations.col(i)) * wire.edges.col(i)).eval();
    }
    wire.end_direction = rotation_by(part * rotations.col(n - 1)) * wire.end_direction;
  }
  return false;
}

void bend_end_to(const Rod& rod, const DirectedEnds& ends, const Vec3& point, double most,
                 Eigen::Ref<Eigen::Matrix3Xd> x) {
  constexpr int kEnough = 2;  // rounds: what is left is of fourth order
  const Eigen::Index n = x.cols();
  for (int round = 0; round < kEnough; ++round) {
    const Eigen::Matrix3Xd edges = x.rightCols(n - 1) - x.leftCols(n - 1);
    const Vec3 gap = point - x.col(n - 1);
    const Eigen::Matrix3Xd rotations = find_least_bending(rod, ends, edges, gap, Vec3::Zero());
    if (!(rotations.colwise().squaredNorm().maxCoeff() <= most * most)) return;
    for (Eigen::Index i = 0; i + 1 < n; ++i) {
      x.col(i + 1) = x.col(i) + rotation_by(rotations.col(i)) * edges.col(i);
    }
  }
}

void buckle_column(const Rod& rod, const Vec3& point, const std::optional<Vec3>& plane,
                   BentWire& wire) {
  if (!is_straight(wire)) return;
  const double length = rod.rest_length.sum();
  const Vec3 gap = point - wire.end(), along = wire.edges.col(0).normalized();
  const double less = -gap.dot(along) - kSidewaysShortens * gap.cross(along).squaredNorm() / length;
  if (less <= kClosed * length) return;
  const Vec3 axis = plane ? *plane : along.cross(reference_normal(along));
  const double most = 2.0 * std::sqrt(less / length);
  for (int i = 0; i + 1 < rod.nodes(); ++i) {
    const double to_tip = 0.5 * (rod.tip_distance[i] + rod.tip_distance[i + 1]);
    const double lean = most * std::sin(2.0 * kPi * to_tip / length);
    wire.edges.col(i) = (rotation_by(lean * axis) * wire.edges.col(i)).eval();
  }
}

}  // namespace wireplan::simulate
