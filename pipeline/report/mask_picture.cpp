#include "pipeline/report/mask_picture.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "pipeline/files/text.h"
#include "pipeline/report/slices.h"
#include "preprocess/segment/segment.h"

namespace wireplan::pipeline {
namespace {

constexpr int kSlice = 240, kGap = 8, kTitle = 26, kMargin = 16;  // px
constexpr double kField = 96.0, kBeside = 24.0;                   // mm
constexpr int kColumns = 6;                                       // slices of two places
constexpr int kSheetWidth = 2 * kMargin + kColumns * kSlice + (kColumns - 1) * kGap;
const Color kOutline(1.0F, 0.75F, 0.1F), kMark(0.2F, 0.9F, 1.0F);

void set_pixel(Picture& picture, int x, int y, const Color& color) {
  fill_box(picture, x, y, 1, 1, color);
}

/// Fills a box, whose upper left corner is at `left` and `top` counted down from the picture's top,
/// with what lies at `point_of(column, row)`: gray values, and the mask's outermost pixels.
void draw_cut(Picture& picture, const MaskView& view, int left, int top, int width, int height,
              const std::function<Vec3(double, double)>& point_of) {
  std::vector<std::uint8_t> inside(static_cast<std::size_t>(width) * height);
  const auto at = [&](int column, int row) -> std::uint8_t& {
    return inside[static_cast<std::size_t>(row) * width + column];
  };
  const double scale = 1.0 / (view.window_high - view.window_low);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const Vec3 p = point_of(column, row);
      const double value = sample(view.image, p);
      const auto level = static_cast<float>(
          std::isnan(value) ? 0.0 : std::clamp(scale * (value - view.window_low), 0.0, 1.0));
      set_pixel(picture, left + column, picture.height - 1 - top - row, Color::Constant(level));
      at(column, row) = preprocess::contains(view.mask, p) ? 1 : 0;
    }
  }
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      if (at(column, row) == 0) continue;
      const bool edge = (column > 0 && at(column - 1, row) == 0) ||
                        (column + 1 < width && at(column + 1, row) == 0) ||
                        (row > 0 && at(column, row - 1) == 0) ||
                        (row + 1 < height && at(column, row + 1) == 0);
      if (edge) set_pixel(picture, left + column, picture.height - 1 - top - row, kOutline);
    }
  }
}

/// A small cross, open in its middle.
void draw_mark(Picture& picture, int x, int top) {
  for (const int d : {-7, -6, -5, -4, 4, 5, 6, 7}) {
    set_pixel(picture, x + d, picture.height - 1 - top, kMark);
    set_pixel(picture, x, picture.height - 1 - top - d, kMark);
  }
}

void draw_place(Picture& picture, const MaskView& view, const MarkedPlace& place, int left,
                int top) {
  draw_text(picture, place.name + " " + place_text(place.point) + " mm", left,
            picture.height - 1 - top - kTitle / 2, 14, Align::kLeft);
  for (const Plane plane : kPlanes) {
    constexpr double kSpacing = kField / kSlice, kMiddle = 0.5 * (kSlice - 1);
    draw_cut(picture, view, left, top + kTitle, kSlice, kSlice, [&](double column, double row) {
      return Vec3(place.point + kSpacing * ((column - kMiddle) * right_of(plane) +
                                            (row - kMiddle) * down_of(plane)));
    });
    draw_mark(picture, left + kSlice / 2, top + kTitle + kSlice / 2);
    left += kSlice + kGap;
  }
}

/// The way with points evenly apart, and its direction there.
struct EvenWay {
  std::vector<Vec3> points, tangents;
  double length = 0.0;
};

EvenWay make_even(const std::vector<Vec3>& way, int count) {
  std::vector<double> arc = {0.0};
  for (std::size_t i = 1; i < way.size(); ++i) {
    arc.push_back(arc.back() + (way[i] - way[i - 1]).norm());
  }
  EvenWay even;
  even.length = arc.back();
  const auto place = [&](double s) -> Vec3 {
    const auto next = std::upper_bound(arc.begin() + 1, arc.end() - 1, s);
    const auto i = static_cast<std::size_t>(next - arc.begin());
    const double step = arc[i] - arc[i - 1];
    const double t = step > 0.0 ? std::clamp((s - arc[i - 1]) / step, 0.0, 1.0) : 0.0;
    return (1.0 - t) * way[i - 1] + t * way[i];
  };
  constexpr double kReach = 4.0;  // mm, so that a voxel's step does not turn the view
  for (int k = 0; k < count; ++k) {
    const double s = even.length * (k + 0.5) / count;
    even.points.push_back(place(s));
    const Vec3 along = place(std::min(s + kReach, even.length)) - place(std::max(s - kReach, 0.0));
    even.tangents.push_back(along.norm() > 0.0 ? Vec3(along.normalized()) : Vec3(Vec3::UnitZ()));
  }
  return even;
}

int strip_height(const MaskView& view) {
  const double length = make_even(view.way, 1).length;
  const int width = kSheetWidth - 2 * kMargin;
  return std::clamp(static_cast<int>(2.0 * kBeside * width / std::max(length, 1.0)), 60, 240);
}

/// One strip: what lies on either side of the way toward `side`, made normal to it. The side at one
/// place is that of the place before, made normal anew, so that the view turns no more than the
/// way.
void draw_strip(Picture& picture, const MaskView& view, const Vec3& side, int top, int height) {
  const int width = kSheetWidth - 2 * kMargin;
  const EvenWay even = make_even(view.way, width);
  std::vector<Vec3> across;
  Vec3 before = side;
  for (const Vec3& tangent : even.tangents) {
    const Vec3 normal = before - before.dot(tangent) * tangent;
    if (normal.norm() > 0.05) before = normal.normalized();
    across.push_back(before);
  }
  const double spacing = even.length / width;
  draw_cut(picture, view, kMargin, top, width, height, [&](double column, double row) {
    const auto k = static_cast<std::size_t>(column);
    return Vec3(even.points[k] + spacing * (row - 0.5 * (height - 1)) * across[k]);
  });
}

}  // namespace

Picture draw_mask_picture(const MaskView& view) {
  expects(view.window_low < view.window_high);
  const bool has_way = view.way.size() > 1;
  const int rows = static_cast<int>(view.places.size() + 1) / 2;
  const int strip = has_way ? strip_height(view) : 0;
  const int row_height = kTitle + kSlice + kGap;
  Picture picture = blank_picture(kSheetWidth, 2 * kMargin + kTitle + rows * row_height +
                                                   (has_way ? kTitle + 2 * strip + kGap : 0));
  draw_text(picture,
            "Outline of the mask. Axial, coronal and sagittal slices of 96 mm, the patient's right "
            "at the left" +
                format("; %.0f to %.0f HU", view.window_low, view.window_high),
            kMargin, picture.height - 1 - kMargin - kTitle / 2, 14, Align::kLeft);
  int top = kMargin + kTitle;
  for (std::size_t k = 0; k < view.places.size(); ++k) {
    const int left = kMargin + (k % 2 == 0 ? 0 : kColumns / 2 * (kSlice + kGap));
    draw_place(picture, view, view.places[k], left, top);
    if (k % 2 == 1 || k + 1 == view.places.size()) top += row_height;
  }
  if (has_way) {
    draw_text(picture,
              format("The way from access (left) to target, %.0f mm, straightened; across it from "
                     "the patient's right (top) to left, and below from front (top) to back",
                     make_even(view.way, 1).length),
              kMargin, picture.height - 1 - top - kTitle / 2, 14, Align::kLeft);
    draw_strip(picture, view, Vec3::UnitX(), top + kTitle, strip);
    draw_strip(picture, view, Vec3::UnitY(), top + kTitle + strip + kGap, strip);
  }
  return picture;
}

}  // namespace wireplan::pipeline
