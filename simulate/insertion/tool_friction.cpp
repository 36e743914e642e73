// What tools do to each other, of ToolBench.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "simulate/insertion/tool_bench.h"

namespace wireplan::simulate {

/// Of a tool at the nodes, (3, n): EI times how much it is bent away from its natural curve [N mm].
Eigen::Matrix3Xd ToolBench::moments(int tool) const {
  const RodState& state = now_.state;
  const Rod& rod = now_.composite.rod;
  const Eigen::Index n = state.x.cols();
  const Wire& wire = scene_.tools[static_cast<std::size_t>(tool)].wire;
  const double insertion = now_.places[static_cast<std::size_t>(tool)].insertion;
  const Eigen::VectorXd angle = angles(tool);
  Eigen::Matrix3Xd moment = Eigen::Matrix3Xd::Zero(3, n);
  Vec3 t_a = scene_.direction, d = reference_normal(t_a);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const Vec3 t_b = edge_tangent(state, i);
    const ToolSpot spot = look_at(wire, insertion - static_cast<double>(i) * rod.rest_length[0]);
    d = parallel_transport(d, t_a, t_b);
    if (spot.there) {
      const Vec3 turn = (2.0 / (1.0 + t_a.dot(t_b))) * t_a.cross(t_b);
      moment.col(i) = (spot.EI / rod.share[i]) * turn;
      if (angle.size() > 0) {
        const double a = i > 0 ? 0.5 * (angle[i - 1] + angle[i]) : angle[0];
        const Vec3 toward = std::cos(a) * d + std::sin(a) * t_b.cross(d);
        moment.col(i) -= spot.EI * spot.curvature * t_b.cross(toward);
      }
    }
    t_a = t_b;
  }
  return moment;
}

/// Where the inner tool is to bend at once by a curvature k, as at a mouth, the play c lets it do
/// so over the length sqrt(2 c / k), and no force acts over less.
double ToolBench::bridged_length(std::size_t outer, const Eigen::Matrix3Xd& moment) const {
  const Tool& inner = scene_.tools[outer + 1];
  const double play = scene_.tools[outer].inner_radius - inner.wire.radius;
  double most = 0.0;
  for (Eigen::Index i = 0; i < moment.cols(); ++i) {
    const double s = static_cast<double>(i) * now_.composite.rod.rest_length[0];
    const double EI = look_at(inner.wire, now_.places[outer + 1].insertion - s).EI;
    most = std::max(most, moment.col(i).norm() / EI);
  }
  return most > 0.0 && play > 0.0 ? std::sqrt(2.0 * play / most) : 0.0;
}

ToolContact ToolBench::find_contact(std::size_t outer, const ToolMove& by) const {
  const std::size_t inner = outer + 1;
  const double h = now_.composite.rod.rest_length[0];
  const double overlap = std::min(now_.places[outer].insertion, now_.places[inner].insertion);
  const Eigen::Matrix3Xd moment = moments(static_cast<int>(inner));
  const Eigen::Index n = moment.cols();
  // Moments go on beyond the ends as they end: straight in the introducer, free at the tip.
  const auto at = [&](double place) -> Vec3 {
    const double inside = std::max(0.0, place);
    const auto i = static_cast<Eigen::Index>(inside);
    if (i + 1 >= n) return Vec3::Zero();
    const double part = inside - static_cast<double>(i);
    return (1.0 - part) * moment.col(i) + part * moment.col(i + 1);
  };
  const double reach = std::max(h, bridged_length(outer, moment)), stride = reach / h;
  const double along = std::abs(now_.force[inner]);
  double hand = along;  // grows from the mouth to the introducer
  ToolContact contact;
  Vec3 t_b = Vec3::Zero();
  for (Eigen::Index i = n - 2; i >= 0; --i) {
    const Vec3 t_a = i > 0 ? edge_tangent(now_.state, i - 1) : scene_.direction;
    t_b = edge_tangent(now_.state, i);
    const auto node = static_cast<double>(i);
    if (node * h > overlap + reach) continue;
    const double bent =
        (at(node + stride) - 2.0 * at(node) + at(node - stride)).norm() * h / (reach * reach);
    // Of a node of which the outer tool covers a part.
    const double part = std::clamp((overlap - (node - 0.5) * h) / h, 0.0, 1.0);
    const double turn = part * std::atan2(t_a.cross(t_b).norm(), t_a.dot(t_b));
    const double grown = std::exp(scene_.friction * turn);
    const double normal =
        bent + (scene_.friction > 0.0 ? hand * (grown - 1.0) / scene_.friction : hand * turn);
    contact.normal_force += normal;
    hand += scene_.friction * normal;
  }
  const double slide = by.push[inner] - by.push[outer];
  const double spin = scene_.tools[inner].wire.radius * (by.turn[inner] - by.turn[outer]);
  const double slip = std::hypot(slide, spin);
  if (slip == 0.0) return contact;
  contact.friction_force = (hand - along) * slide / slip;
  contact.friction_torque = (hand - along) * scene_.tools[inner].wire.radius * spin / slip;
  return contact;
}

}  // namespace wireplan::simulate
