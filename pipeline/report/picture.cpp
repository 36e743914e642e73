#include "pipeline/report/picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pipeline/files/text.h"

namespace wireplan::pipeline {
namespace {

constexpr int kSamples = 2;  // per pixel and axis
constexpr float kFarAway = -std::numeric_limits<float>::infinity();
const Color kVessel(0.80F, 0.50F, 0.42F), kContact(0.90F, 0.05F, 0.05F);
const Color kAccess(0.10F, 0.35F, 0.90F), kTarget(0.05F, 0.60F, 0.25F);

/// One view, drawn as samples. A sample's depth counts toward the viewer.
struct Panel {
  int width, height;                 // samples
  std::vector<float> depth;          // of the solid thing seen
  std::vector<Color> solid;          // its shaded color
  std::vector<float> transmittance;  // of the vessel layers before it
  std::vector<Color> layers;         // their colors, weighted by opacity
  std::vector<float> layer_weight;   // sum of these weights

  Panel(int w, int h)
      : width(w),
        height(h),
        depth(static_cast<std::size_t>(w) * h),
        solid(depth.size()),
        transmittance(depth.size()),
        layers(depth.size()),
        layer_weight(depth.size()) {}

  void clear() {
    std::fill(depth.begin(), depth.end(), kFarAway);
    std::fill(solid.begin(), solid.end(), kPaper);
    std::fill(transmittance.begin(), transmittance.end(), 1.0F);
    std::fill(layers.begin(), layers.end(), Color::Zero());
    std::fill(layer_weight.begin(), layer_weight.end(), 0.0F);
  }
};

/// Samples of a panel that a box from `low` to `high` covers.
struct SampleBox {
  int x_0, x_1, y_0, y_1;
};
SampleBox covered_samples(const Panel& panel, const Vec3& low, const Vec3& high) {
  const auto clamped = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
  };
  return {clamped(std::floor(low.x()), panel.width), clamped(std::ceil(high.x()), panel.width),
          clamped(std::floor(low.y()), panel.height), clamped(std::ceil(high.y()), panel.height)};
}

/// Diffuse light from above, left of the viewer; `normal` is unit and in view axes.
float shade(const Vec3& normal) {
  static const Vec3 kLight = Vec3(-0.4, 0.5, 0.8).normalized();
  return static_cast<float>(0.45 + 0.55 * std::max(0.0, normal.dot(kLight)));
}

/// A solid round bar from `a` to `b` with round ends, in samples; a ball where they are equal.
void draw_bar(Panel& panel, const Vec3& a, const Vec3& b, double radius, const Color& color) {
  const SampleBox box =
      covered_samples(panel, a.cwiseMin(b).array() - radius, a.cwiseMax(b).array() + radius);
  const Eigen::Vector2d axis = (b - a).head<2>();
  const double squared_length = axis.squaredNorm();
  for (int y = box.y_0; y < box.y_1; ++y) {
    for (int x = box.x_0; x < box.x_1; ++x) {
      // The nearest point of the axis as seen, and the height of the round surface over it.
      const Eigen::Vector2d from_a = Eigen::Vector2d(x + 0.5, y + 0.5) - a.head<2>();
      const double along =
          squared_length > 0.0 ? std::clamp(from_a.dot(axis) / squared_length, 0.0, 1.0) : 0.0;
      const Eigen::Vector2d offset = from_a - along * axis;
      const double squared_height = radius * radius - offset.squaredNorm();
      if (squared_height < 0.0) continue;
      const double height = std::sqrt(squared_height);
      const auto z = static_cast<float>(a.z() + along * (b.z() - a.z()) + height);
      const std::size_t i = static_cast<std::size_t>(y) * panel.width + x;
      if (z <= panel.depth[i]) continue;
      panel.depth[i] = z;
      panel.solid[i] = color * shade(Vec3(offset.x(), offset.y(), height) / radius);
    }
  }
}

/// One translucent triangle of the vessel, `p` in samples and `normal` per corner in view axes.
/// The more a layer is seen from its side the more opaque it is, so outlines show as in an x-ray.
/// Where it is painted it is as opaque as `painted` at least. Blending does not depend on the order
/// of triangles. Solid things must have been drawn before.
void draw_layer(Panel& panel, const std::array<Vec3, 3>& p, const std::array<Vec3, 3>& normal,
                const Color& color, float painted) {
  const Eigen::Vector2d u = (p[1] - p[0]).head<2>(), v = (p[2] - p[0]).head<2>();
  const double area = u.x() * v.y() - u.y() * v.x();
  if (std::abs(area) < 1e-12) return;
  const SampleBox box = covered_samples(panel, p[0].cwiseMin(p[1]).cwiseMin(p[2]),
                                        p[0].cwiseMax(p[1]).cwiseMax(p[2]));
  for (int y = box.y_0; y < box.y_1; ++y) {
    for (int x = box.x_0; x < box.x_1; ++x) {
      const Eigen::Vector2d d = Eigen::Vector2d(x + 0.5, y + 0.5) - p[0].head<2>();
      const double b = (d.x() * v.y() - d.y() * v.x()) / area;
      const double c = (u.x() * d.y() - u.y() * d.x()) / area;
      if (b < 0.0 || c < 0.0 || b + c > 1.0) continue;
      const std::size_t i = static_cast<std::size_t>(y) * panel.width + x;
      const double z = (1.0 - b - c) * p[0].z() + b * p[1].z() + c * p[2].z();
      if (z < panel.depth[i]) continue;  // hidden behind a wire
      Vec3 n = ((1.0 - b - c) * normal[0] + b * normal[1] + c * normal[2]).normalized();
      if (n.z() < 0.0) n = -n;
      const float opacity =
          std::max(painted, static_cast<float>(0.08 + 0.62 * std::pow(1.0 - n.z(), 2.5)));
      panel.transmittance[i] *= 1.0F - opacity;
      panel.layers[i] += opacity * shade(n) * color;
      panel.layer_weight[i] += opacity;
    }
  }
}

/// Averages the panel's samples into pixels of the picture, from column `left` and row `bottom`.
void resolve(const Panel& panel, Picture& picture, int left, int bottom) {
  for (int row = 0; row < panel.height / kSamples; ++row) {
    for (int column = 0; column < panel.width / kSamples; ++column) {
      Color sum = Color::Zero();
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const int x = column * kSamples + s % kSamples, y = row * kSamples + s / kSamples;
        const std::size_t i = static_cast<std::size_t>(y) * panel.width + x;
        sum += panel.transmittance[i] * panel.solid[i];
        if (panel.layer_weight[i] > 0.0F) {
          sum += (1.0F - panel.transmittance[i]) / panel.layer_weight[i] * panel.layers[i];
        }
      }
      const Color mean = sum / static_cast<float>(kSamples * kSamples);
      const std::size_t pixel =
          static_cast<std::size_t>(row + bottom) * picture.width + column + left;
      for (int k = 0; k < 3; ++k) {
        picture.rgb[3 * pixel + k] =
            static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(mean[k], 0.0F, 1.0F)));
      }
    }
  }
}

/// The side of the patient that a direction along an axis points to, as a word or its letter; of
/// axes that are not the patient's the axis, "+x".
std::string side_name(const Vec3& direction, bool patient_axes) {
  static const std::array<std::array<const char*, 2>, 3> kNames{
      {{"right", "left"}, {"anterior", "posterior"}, {"inferior", "superior"}}};
  static const std::array<std::array<const char*, 2>, 3> kAxes{
      {{"-x", "+x"}, {"-y", "+y"}, {"-z", "+z"}}};
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return (patient_axes ? kNames : kAxes)[axis][direction[axis] > 0.0 ? 1 : 0];
}
std::string side_letter(const Vec3& direction, bool patient_axes) {
  const std::string name = side_name(direction, patient_axes);
  if (!patient_axes) return name;
  return std::string(1, static_cast<char>(std::toupper(name.front())));
}

struct Box {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max());
  Vec3 high = Vec3::Constant(std::numeric_limits<double>::lowest());
  void include(const Vec3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};
Box scene_box(const Surface& vessel, const std::vector<PictureWire>& wires,
              const PictureMarks& marks) {
  Box box;
  for (const Vec3& p : vessel.vertices.colwise()) box.include(p);
  for (const PictureWire& wire : wires) {
    for (const Vec3& p : wire.nodes.colwise()) box.include(p);
  }
  if (marks.access) box.include(*marks.access);
  if (marks.target) {
    box.include(marks.target->array() - marks.target_radius);
    box.include(marks.target->array() + marks.target_radius);
  }
  return box;
}

/// Rows of each view are its right, up and toward the viewer, in LPS. Up is the longest axis:
/// toward the head for z, and else such that the target is above the access. The first view is the
/// one that looks at the patient's front where up is z.
std::array<Mat3, 2> choose_views(const Box& box, const PictureMarks& marks) {
  Eigen::Index longest = 2;
  const Vec3 extent = box.high - box.low;
  if (extent.head<2>().maxCoeff() > extent.z()) extent.head<2>().maxCoeff(&longest);
  Vec3 up = Vec3::Unit(longest);
  const bool both = marks.access && marks.target;
  if (longest != 2 && both && (*marks.target)[longest] < (*marks.access)[longest]) up = -up;
  static const std::array<std::array<Vec3, 2>, 3> kTowardViewer{{{-Vec3::UnitY(), Vec3::UnitZ()},
                                                                 {Vec3::UnitZ(), Vec3::UnitX()},
                                                                 {-Vec3::UnitY(), Vec3::UnitX()}}};
  std::array<Mat3, 2> views;
  for (int k = 0; k < 2; ++k) {
    const Vec3& toward = kTowardViewer[longest][k];
    views[k] << up.cross(toward).transpose(), up.transpose(), toward.transpose();
  }
  return views;
}

/// The longest of 1, 2, 5, 10, ... that is at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10.0, std::floor(std::log10(limit)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= limit) return factor * power;
  }
  return power;
}

double largest_force(const std::vector<PictureWire>& wires) {
  double largest = 0.0;
  for (const PictureWire& wire : wires) {
    if (wire.contact_force.size() > 0) largest = std::max(largest, wire.contact_force.maxCoeff());
  }
  return largest;
}

/// What turns mm into samples of a panel: the scene's middle goes to the panel's middle.
struct Projection {
  Mat3 axes;
  Vec3 middle;
  double scale;  // samples per mm
  Vec3 center;   // of the panel, samples
  Vec3 operator()(const Vec3& p) const { return scale * (axes * (p - middle)) + center; }
};

void draw_wire(Panel& panel, const Projection& project, const PictureWire& wire,
               double force_scale) {
  const double radius = std::max(wire.radius * project.scale, 1.0 * kSamples);
  for (Eigen::Index k = 0; k + 1 < wire.nodes.cols(); ++k) {
    draw_bar(panel, project(wire.nodes.col(k)), project(wire.nodes.col(k + 1)), radius, wire.color);
  }
  // A bead where the wall pushes, its area in proportion to the force.
  if (force_scale <= 0.0) return;
  const double largest = std::max(2.0 * radius, 6.0 * kSamples);
  for (Eigen::Index k = 0; k < wire.contact_force.size(); ++k) {
    const double size = largest * std::sqrt(wire.contact_force[k] / force_scale);
    const Vec3 center = project(wire.nodes.col(k));
    if (size > radius) draw_bar(panel, center, center, size, kContact);
  }
}

/// Balls at access and target, and a ring of the target's radius that faces the viewer.
void draw_marks(Panel& panel, const Projection& project, const PictureMarks& marks) {
  const double ball = 5.0 * kSamples;
  if (marks.access) {
    const Vec3 access = project(*marks.access);
    draw_bar(panel, access, access, ball, kAccess);
  }
  if (!marks.target) return;
  const Vec3 target = project(*marks.target);
  draw_bar(panel, target, target, ball, kTarget);
  constexpr int kSides = 64;
  const double radius = std::max(marks.target_radius * project.scale, 2.0 * ball);
  const auto corner = [&](int k) -> Vec3 {
    const double angle = 2.0 * kPi * k / kSides;
    return target + radius * Vec3(std::cos(angle), std::sin(angle), 0.0);
  };
  for (int k = 0; k < kSides; ++k) draw_bar(panel, corner(k), corner(k + 1), kSamples, kTarget);
}

double largest_wall_force(const PictureMarks& marks) {
  return marks.wall_force.empty()
             ? 0.0
             : *std::max_element(marks.wall_force.begin(), marks.wall_force.end());
}

void draw_vessel(Panel& panel, const Projection& project, const Surface& vessel,
                 const PictureMarks& marks) {
  const Eigen::Matrix3Xd normals = area_weighted_normals(vessel);
  const double scale = largest_wall_force(marks);
  for (Eigen::Index m = 0; m < vessel.triangles.cols(); ++m) {
    std::array<Vec3, 3> corners, corner_normals;
    for (int k = 0; k < 3; ++k) {
      const int vertex = vessel.triangles(k, m);
      corners[k] = project(vessel.vertices.col(vertex));
      corner_normals[k] = project.axes * normals.col(vertex);
    }
    const double force = scale > 0.0 ? marks.wall_force[static_cast<std::size_t>(m)] : 0.0;
    // Even a small force shows where a wire touched.
    const float painted = force > 0.0 ? static_cast<float>(0.5 + 0.45 * force / scale) : 0.0F;
    draw_layer(panel, corners, corner_normals, force > 0.0 ? force_color(force / scale) : kVessel,
               painted);
  }
}

/// Title, legend, scale bar and the notice, below and above the panels.
void draw_legend(Picture& picture, const std::vector<PictureWire>& wires, const PictureMarks& marks,
                 double pixels_per_mm, int line) {
  const int left = line, text_size = line * 6 / 10;
  draw_text(picture, marks.title, picture.width / 2, picture.height - line, line * 8 / 10,
            Align::kCenter);

  // What the vessel's colors tell.
  if (const double force = largest_wall_force(marks); force > 0.0) {
    const int width = 6 * line, x = picture.width / 2 - width / 2,
              y = picture.height - line * 37 / 20;
    draw_text(picture, "force on the wall: 0", x - line / 2, y, text_size, Align::kRight);
    draw_force_bar(picture, x, y - line / 4, width, line / 2);
    draw_text(picture, format("%.3g N", force), x + width + line / 2, y, text_size, Align::kLeft);
  }

  // The scale bar and the notice share the lowest line.
  const double length = round_length(0.2 * picture.width / pixels_per_mm);
  const int bar = static_cast<int>(std::lround(length * pixels_per_mm));
  fill_box(picture, left, line - 2, bar, 4, kInk);
  draw_text(picture, format("%g mm", length), left + bar + line / 2, line, text_size, Align::kLeft);
  draw_text(picture, "wireplan: research use only, no medical device", picture.width - line, line,
            text_size, Align::kRight, kGrey);

  // One entry per wire, then contact and marks, in two columns.
  std::vector<std::pair<std::string, Color>> entries;
  for (const PictureWire& wire : wires) entries.emplace_back(wire.name, wire.color);
  if (const double force = largest_force(wires); force > 0.0) {
    entries.emplace_back(format("wall contact, largest %.3g N", force), kContact);
  }
  if (marks.access) entries.emplace_back("access", kAccess);
  if (marks.target) entries.emplace_back("target", kTarget);
  const int rows = static_cast<int>(entries.size() + 1) / 2;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const int x = left + static_cast<int>(k % 2) * picture.width / 2;
    const int y = line * (1 + rows - static_cast<int>(k / 2));
    fill_box(picture, x, y - line / 5, line * 2 / 5, line * 2 / 5, entries[k].second);
    draw_text(picture, entries[k].first, x + line * 3 / 4, y, text_size, Align::kLeft);
  }
}

/// Names of the view and of its four sides, round the panel.
void draw_sides(Picture& picture, const Mat3& view, bool patient_axes, int left, int bottom,
                int width, int height, int line) {
  const int size = line * 6 / 10, x = left + width / 2, y = bottom + height / 2;
  const Vec3 right = view.row(0), up = view.row(1), toward = view.row(2);
  draw_text(picture, "seen from " + side_name(toward, patient_axes), x, bottom + height + line / 2,
            size, Align::kCenter);
  const auto letter = [&](const Vec3& side) { return side_letter(side, patient_axes); };
  draw_text(picture, letter(-right), left + line / 2, y, size, Align::kCenter, kGrey);
  draw_text(picture, letter(right), left + width - line / 2, y, size, Align::kCenter, kGrey);
  draw_text(picture, letter(up), x, bottom + height - line / 2, size, Align::kCenter, kGrey);
  draw_text(picture, letter(-up), x, bottom + line / 2, size, Align::kCenter, kGrey);
}

}  // namespace

Color wire_color(int k) {
  static const std::array<Color, 6> kColors{Color(0.05F, 0.10F, 0.55F), Color(0.00F, 0.45F, 0.45F),
                                            Color(0.50F, 0.00F, 0.60F), Color(0.55F, 0.40F, 0.00F),
                                            Color(0.00F, 0.50F, 0.75F), Color(0.25F, 0.25F, 0.25F)};
  return kColors[static_cast<std::size_t>(k) % kColors.size()];
}

Picture draw_picture(const Surface& vessel, const std::vector<PictureWire>& wires,
                     const PictureMarks& marks, const PictureSize& size) {
  expects(size.width >= 200 && size.height >= 200);
  const Box box = scene_box(vessel, wires, marks);
  expects(box.low.allFinite() && box.high.allFinite());
  expects(marks.wall_force.empty() ||
          static_cast<Eigen::Index>(marks.wall_force.size()) == vessel.triangles.cols());
  for (const PictureWire& wire : wires) {
    expects(wire.nodes.cols() >= 2 && wire.nodes.allFinite());
    expects(wire.contact_force.size() == 0 || wire.contact_force.size() == wire.nodes.cols());
  }

  // Two panels between the title above and the legend below; one scale fits both.
  Picture picture = blank_picture(size.width, size.height);
  const int line = std::max(10, size.width / 40);
  const int legend_rows = (static_cast<int>(wires.size()) + 4) / 2;
  const int bottom = line * (2 + legend_rows), width = size.width / 2;
  const int height = size.height - bottom - 3 * line;
  expects(height > 4 * line);
  const std::array<Mat3, 2> views = choose_views(box, marks);
  double pixels_per_mm = std::numeric_limits<double>::max();
  for (const Mat3& view : views) {
    const Vec3 extent = (view * (box.high - box.low)).cwiseAbs().cwiseMax(1e-3);
    pixels_per_mm = std::min(
        {pixels_per_mm, (width - 2 * line) / extent.x(), (height - 2 * line) / extent.y()});
  }

  // Solid things first: the vessel's layers need to know what they cover.
  Panel panel(width * kSamples, height * kSamples);
  for (int k = 0; k < 2; ++k) {
    panel.clear();
    const Projection project{views[k], 0.5 * (box.low + box.high), pixels_per_mm * kSamples,
                             0.5 * Vec3(panel.width, panel.height, 0.0)};
    for (const PictureWire& wire : wires) draw_wire(panel, project, wire, largest_force(wires));
    draw_marks(panel, project, marks);
    draw_vessel(panel, project, vessel, marks);
    resolve(panel, picture, k * width, bottom);
    draw_sides(picture, views[k], marks.patient_axes, k * width, bottom, width, height, line);
  }
  draw_legend(picture, wires, marks, pixels_per_mm, line);
  return picture;
}

void write_picture(const Surface& vessel, const std::vector<PictureWire>& wires,
                   const PictureMarks& marks, const std::filesystem::path& png) {
  write_png(draw_picture(vessel, wires, marks), png);
}

}  // namespace wireplan::pipeline
