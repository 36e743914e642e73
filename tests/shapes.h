#pragma once
/// Closed triangle surfaces made in code, for tests and benchmarks. All are one piece, manifold and
/// oriented outward. Vertices lie on the smooth shape, so a faceted tube or sphere is the inscribed
/// one: its volume is short by a part that falls with edge^2.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::shapes {

/// A line through corners [mm], with a point every half millimetre or somewhat less.
inline Centerline line_through(const std::vector<Vec3>& corners, double radius) {
  std::vector<Vec3> points = {corners.front()};
  for (std::size_t k = 1; k < corners.size(); ++k) {
    const Vec3 edge = corners[k] - corners[k - 1];
    const int parts = static_cast<int>(std::ceil(edge.norm() / 0.5));
    for (int i = 1; i <= parts; ++i) points.push_back(corners[k - 1] + edge * i / parts);
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  Centerline line{Eigen::Matrix3Xd(3, count), Eigen::VectorXd::Constant(count, radius), {}};
  for (Eigen::Index k = 0; k < count; ++k) {
    line.points.col(k) = points[static_cast<std::size_t>(k)];
  }
  line.arc_length = arc_length_of(line.points);
  return line;
}

/// A circle of vertices: center + radius (cos a u + sin a v) at `sides` even angles from `phase`.
struct Ring {
  Vec3 center = Vec3::Zero(), u = Vec3::UnitX(), v = Vec3::UnitY();  // mm; unit vectors
  double radius = 1.0;                                               // [mm]
  int sides = 6;
  double phase = 0.0;  // of the first vertex, in steps of 2 pi / sides
};

inline Surface as_surface(const std::vector<Vec3>& vertices,
                          const std::vector<Eigen::Vector3i>& triangles) {
  Surface surface;
  surface.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    surface.vertices.col(static_cast<Eigen::Index>(k)) = vertices[k];
  }
  surface.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    surface.triangles.col(static_cast<Eigen::Index>(k)) = triangles[k];
  }
  return surface;
}

/// Skin over rings from one closing point to another; each ring turns counter-clockwise seen from
/// the end. Neighbouring rings may differ in their number of sides.
inline Surface skin(const Vec3& start, const std::vector<Ring>& rings, const Vec3& end) {
  std::vector<Vec3> vertices = {start};
  std::vector<Eigen::Vector3i> triangles;
  std::vector<int> first;
  for (const Ring& ring : rings) {
    first.push_back(static_cast<int>(vertices.size()));
    for (int k = 0; k < ring.sides; ++k) {
      const double angle = 2.0 * kPi * (k + ring.phase) / ring.sides;
      vertices.push_back(ring.center +
                         ring.radius * (std::cos(angle) * ring.u + std::sin(angle) * ring.v));
    }
  }
  const int last = static_cast<int>(vertices.size());
  vertices.push_back(end);
  const auto at = [&](std::size_t r, int k) { return first[r] + k % rings[r].sides; };

  // A fan at either end, and between two rings always the step that lags behind in angle.
  for (int k = 0; k < rings.front().sides; ++k) {
    triangles.emplace_back(0, at(0, k + 1), at(0, k));
  }
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    const Ring &a = rings[r], &b = rings[r + 1];
    for (int i = 0, j = 0; i < a.sides || j < b.sides;) {
      const double next_a = (i + 1 + a.phase) / a.sides, next_b = (j + 1 + b.phase) / b.sides;
      if (j == b.sides || (i < a.sides && next_a <= next_b)) {
        triangles.emplace_back(at(r, i), at(r, i + 1), at(r + 1, j));
        ++i;
      } else {
        triangles.emplace_back(at(r, i), at(r + 1, j + 1), at(r + 1, j));
        ++j;
      }
    }
  }
  for (int k = 0; k < rings.back().sides; ++k) {
    triangles.emplace_back(at(rings.size() - 1, k), at(rings.size() - 1, k + 1), last);
  }

  return as_surface(vertices, triangles);
}

/// Tube round a polyline (3, n >= 2) with a radius [mm] at each of its points and flat caps at both
/// ends. One ring per point: the spacing of the points is the edge length along the tube.
inline Surface tube(const Eigen::Matrix3Xd& axis, const Eigen::VectorXd& radius, int sides) {
  const Eigen::Index n = axis.cols();
  expects(n >= 2 && radius.size() == n && sides >= 3);

  // Rings square to the mean direction at each point, the frame carried along without turning.
  std::vector<Ring> rings;
  Vec3 u = Vec3::Zero();
  for (Eigen::Index k = 0; k < n; ++k) {
    Vec3 tangent = Vec3::Zero();
    if (k > 0) tangent += (axis.col(k) - axis.col(k - 1)).normalized();
    if (k + 1 < n) tangent += (axis.col(k + 1) - axis.col(k)).normalized();
    tangent.normalize();
    if (k == 0) u = std::abs(tangent.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
    u = (u - u.dot(tangent) * tangent).normalized();
    rings.push_back({.center = axis.col(k),
                     .u = u,
                     .v = tangent.cross(u),
                     .radius = radius(k),
                     .sides = sides,
                     .phase = k % 2 == 0 ? 0.0 : 0.5});
  }

  // Caps of concentric rings, about as fine as the rim.
  const auto cap = [&](const Ring& rim) {
    std::vector<Ring> inner;
    const int steps = std::max(1, static_cast<int>(std::lround(sides / (2.0 * kPi))));
    for (int k = 1; k < steps; ++k) {
      Ring ring = rim;
      ring.radius = rim.radius * k / steps;
      ring.sides = std::max(5, static_cast<int>(std::lround(double(sides) * k / steps)));
      inner.push_back(ring);
    }
    return inner;
  };
  std::vector<Ring> all = cap(rings.front());
  all.insert(all.end(), rings.begin(), rings.end());
  const std::vector<Ring> end_cap = cap(rings.back());
  all.insert(all.end(), end_cap.rbegin(), end_cap.rend());
  return skin(axis.col(0), all, axis.col(n - 1));
}

/// Polyline that enters along +z from the origin for `lead_in`, bends toward +x by `angle` [rad] on
/// an arc of `bend_radius`, and goes on straight for `lead_out`; points about `step` apart.   [mm]
inline Eigen::Matrix3Xd bend_axis(double bend_radius, double angle, double lead_in, double lead_out,
                                  double step) {
  std::vector<Vec3> points = {Vec3::Zero()};
  const auto pieces = [&](double length) {
    return std::max(1, static_cast<int>(std::lround(length / step)));
  };
  const Vec3 toward(std::sin(angle), 0.0, std::cos(angle));
  const Vec3 arc_end(bend_radius * (1.0 - std::cos(angle)), 0.0,
                     lead_in + bend_radius * std::sin(angle));
  if (lead_in > 0.0) {
    const int count = pieces(lead_in);
    for (int k = 1; k <= count; ++k) points.emplace_back(0.0, 0.0, lead_in * k / count);
  }
  if (angle > 0.0) {
    const int count = pieces(bend_radius * angle);
    for (int k = 1; k <= count; ++k) {
      const double turned = angle * k / count;
      points.emplace_back(bend_radius * (1.0 - std::cos(turned)), 0.0,
                          lead_in + bend_radius * std::sin(turned));
    }
  }
  if (lead_out > 0.0) {
    const int count = pieces(lead_out);
    for (int k = 1; k <= count; ++k) points.push_back(arc_end + toward * (lead_out * k / count));
  }
  Eigen::Matrix3Xd axis(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k)
    axis.col(static_cast<Eigen::Index>(k)) = points[k];
  return axis;
}

/// Helix about z from the +x axis, counter-clockwise and up by `pitch` per turn, over `angle`
/// [rad]; points about `step` apart.                                                       [mm]
inline Eigen::Matrix3Xd helix_axis(double radius, double pitch, double angle, double step) {
  const double climb = pitch / (2.0 * kPi);
  const int count =
      std::max(1, static_cast<int>(std::lround(angle * std::hypot(radius, climb) / step)));
  Eigen::Matrix3Xd axis(3, count + 1);
  for (int k = 0; k <= count; ++k) {
    const double turned = angle * k / count;
    axis.col(k) << radius * std::cos(turned), radius * std::sin(turned), climb * turned;
  }
  return axis;
}

/// Tube of one radius round `bend_axis`, edges about `edge` long.
inline Surface bend_tube(double radius, double bend_radius, double angle, double lead_in,
                         double lead_out, double edge) {
  expects(radius < bend_radius);
  const double spacing = edge * std::sqrt(0.75);  // rows of even-sided triangles
  const Eigen::Matrix3Xd axis = bend_axis(bend_radius, angle, lead_in, lead_out, spacing);
  const int sides = std::max(6, static_cast<int>(std::ceil(2.0 * kPi * radius / edge)));
  return tube(axis, Eigen::VectorXd::Constant(axis.cols(), radius), sides);
}

/// Tube along +z from z = 0 to z = length, edges about `edge` long.
inline Surface straight_tube(double radius, double length, double edge) {
  const int rows = std::max(1, static_cast<int>(std::lround(length / (edge * std::sqrt(0.75)))));
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, rows + 1);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(rows + 1, 0.0, length);
  const int sides = std::max(6, static_cast<int>(std::ceil(2.0 * kPi * radius / edge)));
  return tube(axis, Eigen::VectorXd::Constant(rows + 1, radius), sides);
}

/// Sphere of circles of latitude, edges about `edge` long.
inline Surface sphere(const Vec3& center, double radius, double edge) {
  const int rows =
      std::max(3, static_cast<int>(std::lround(kPi * radius / (edge * std::sqrt(0.75)))));
  std::vector<Ring> rings;
  for (int k = 1; k < rows; ++k) {
    const double polar = kPi * k / rows, across = radius * std::sin(polar);
    const int sides = std::max(5, static_cast<int>(std::lround(2.0 * kPi * across / edge)));
    rings.push_back({.center = center - radius * std::cos(polar) * Vec3::UnitZ(),
                     .radius = across,
                     .sides = sides,
                     .phase = k % 2 == 0 ? 0.0 : 0.5});
  }
  return skin(center - radius * Vec3::UnitZ(), rings, center + radius * Vec3::UnitZ());
}

/// Box of 8 vertices and 12 triangles.
inline Surface box(const Vec3& low, const Vec3& high) {
  Surface surface;
  surface.vertices.resize(3, 8);
  for (int k = 0; k < 8; ++k) {
    surface.vertices.col(k) = Vec3((k & 1) ? high.x() : low.x(), (k & 2) ? high.y() : low.y(),
                                   (k & 4) ? high.z() : low.z());
  }
  surface.triangles.resize(3, 12);
  surface.triangles.transpose() << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,  //
      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5;
  return surface;
}

/// Box whose faces are grids of `parts` squares a side, each of two triangles.
inline Surface divided_box(const Vec3& low, const Vec3& high, int parts) {
  std::vector<Vec3> vertices;
  std::map<std::array<int, 3>, int> index_of;
  const auto vertex = [&](const std::array<int, 3>& n) {
    const auto [place, fresh] = index_of.try_emplace(n, static_cast<int>(vertices.size()));
    if (fresh) {
      vertices.push_back(low + (high - low).cwiseProduct(Vec3(n[0], n[1], n[2])) / parts);
    }
    return place->second;
  };
  std::vector<Eigen::Vector3i> triangles;
  for (int d = 0; d < 3; ++d) {
    for (const int side : {0, parts}) {
      for (int i = 0; i < parts; ++i) {
        for (int j = 0; j < parts; ++j) {
          const auto corner = [&](int a, int b) {
            std::array<int, 3> n{};
            n[d] = side;
            n[(d + 1) % 3] = i + a;
            n[(d + 2) % 3] = j + b;
            return vertex(n);
          };
          const int p = corner(0, 0), q = corner(1, 0), r = corner(1, 1), s = corner(0, 1);
          triangles.push_back(side > 0 ? Eigen::Vector3i(p, q, r) : Eigen::Vector3i(p, r, q));
          triangles.push_back(side > 0 ? Eigen::Vector3i(p, r, s) : Eigen::Vector3i(p, s, r));
        }
      }
    }
  }
  return as_surface(vertices, triangles);
}

/// Where `depth`, positive inside, is zero within a box that holds the shape: marching tetrahedra
/// on a grid of the given spacing. Unlike the other shapes, its triangles may be slivers.
template <class Depth>
Surface level_set(const Depth& depth, const Vec3& low, const Vec3& high, double spacing) {
  const Eigen::Array3i nodes = ((high - low).array() / spacing).ceil().cast<int>() + 1;
  const auto index = [&](const Eigen::Array3i& n) {
    return n[0] + nodes[0] * (n[1] + nodes[1] * n[2]);
  };
  const auto place = [&](int k) -> Vec3 {
    return low + spacing * Vec3(k % nodes[0], k / nodes[0] % nodes[1], k / nodes[0] / nodes[1]);
  };
  std::vector<double> value(static_cast<std::size_t>(nodes.prod()));
  for (int k = 0; k < nodes.prod(); ++k) {
    const double found = depth(place(k));
    // A vertex on a node would collapse triangles.
    value[static_cast<std::size_t>(k)] = std::abs(found) < 1e-3 * spacing ? 1e-3 * spacing : found;
  }
  const auto at = [&](int k) { return value[static_cast<std::size_t>(k)]; };
  std::vector<Vec3> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::map<std::pair<int, int>, int> vertex_of;  // of the edge between two nodes
  const auto vertex = [&](int a, int b) {
    const auto [found, fresh] =
        vertex_of.try_emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
    if (fresh) {
      const double part = at(a) / (at(a) - at(b));
      vertices.push_back((1.0 - part) * place(a) + part * place(b));
    }
    return found->second;
  };
  const auto add_facing = [&](int a, int b, int c, const Vec3& outside) {
    const Vec3 &p = vertices[static_cast<std::size_t>(a)],
               &q = vertices[static_cast<std::size_t>(b)],
               &r = vertices[static_cast<std::size_t>(c)];
    const bool outward = (q - p).cross(r - p).dot(outside - p) > 0.0;
    triangles.emplace_back(a, outward ? b : c, outward ? c : b);
  };
  const auto add_tetrahedron = [&](const std::array<int, 4>& corners) {
    std::vector<int> in, out;
    for (const int k : corners) (at(k) > 0.0 ? in : out).push_back(k);
    if (in.size() == 1 || out.size() == 1) {
      const bool one_in = in.size() == 1;
      const int one = one_in ? in[0] : out[0];
      const std::vector<int>& rest = one_in ? out : in;
      const int a = vertex(one, rest[0]), b = vertex(one, rest[1]), c = vertex(one, rest[2]);
      add_facing(a, b, c, one_in ? place(rest[0]) : place(one));
    } else if (in.size() == 2) {
      const int a = vertex(in[0], out[0]), b = vertex(in[0], out[1]), c = vertex(in[1], out[1]),
                d = vertex(in[1], out[0]);
      add_facing(a, b, c, place(out[1]));
      add_facing(a, c, d, place(out[0]));
    }
  };
  // Six tetrahedra round a diagonal of each cell.
  const std::array<std::array<int, 3>, 6> orders = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (int k = 0; k + 1 < nodes[2]; ++k) {
    for (int j = 0; j + 1 < nodes[1]; ++j) {
      for (int i = 0; i + 1 < nodes[0]; ++i) {
        for (const std::array<int, 3>& order : orders) {
          Eigen::Array3i n(i, j, k);
          std::array<int, 4> corners{index(n)};
          for (std::size_t c = 0; c < 3; ++c) {
            ++n[order[c]];
            corners[c + 1] = index(n);
          }
          add_tetrahedron(corners);
        }
      }
    }
  }
  return as_surface(vertices, triangles);
}

/// How deep a point is inside a straight tube with flat ends, from a to b; negative outside.
inline double depth_in_tube(const Vec3& p, const Vec3& a, const Vec3& b, double radius) {
  const Vec3 axis = (b - a).normalized();
  const double along = axis.dot(p - a);
  const double from_axis = (p - a - along * axis).norm();
  return std::min({radius - from_axis, along, (b - a).norm() - along});
}

/// Both surfaces in one, unjoined.
inline Surface joined(const Surface& a, const Surface& b) {
  Surface both;
  both.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  both.vertices << a.vertices, b.vertices;
  both.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  both.triangles << a.triangles,
      (b.triangles.array() + static_cast<int>(a.vertices.cols())).matrix();
  return both;
}

/// The wall that preprocess extrudes: an apex over the middle of each triangle; E in MPa.
inline Wall extruded_wall(const Surface& surface, double thickness, double young_modulus) {
  Wall wall{.apexes = Eigen::Matrix3Xd(3, surface.triangles.cols()),
            .height = Eigen::VectorXd::Constant(surface.triangles.cols(), thickness),
            .young_modulus = young_modulus,
            .poisson_ratio = 0.3};
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    const Vec3 a = surface.vertices.col(surface.triangles(0, k)),
               b = surface.vertices.col(surface.triangles(1, k)),
               c = surface.vertices.col(surface.triangles(2, k));
    wall.apexes.col(k) = (a + b + c) / 3.0 + thickness * (b - a).cross(c - a).normalized();
  }
  return wall;
}

/// The same surface inside out.
inline Surface inside_out(Surface surface) {
  surface.triangles.row(1).swap(surface.triangles.row(2));
  return surface;
}

}  // namespace wireplan::shapes
