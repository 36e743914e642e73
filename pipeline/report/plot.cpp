#include "pipeline/report/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pipeline/files/text.h"
#include "preprocess/base.h"

namespace wireplan::pipeline {
namespace {

const Color kGrid(0.88F, 0.88F, 0.88F), kFineGrid(0.95F, 0.95F, 0.95F);
constexpr int kTitleHeight = 60, kLegendHeight = 60;

/// Part of the picture that one plot fills.
struct Frame {
  int left, bottom, width, height;  // [px]
};

/// Paper with a title and a legend, and the frame of each panel.
Picture blank_sheet(const std::string& title, const std::vector<LegendEntry>& legend,
                    std::size_t panels, int columns, int width, int height,
                    std::vector<Frame>& frames) {
  const int rows = (static_cast<int>(panels) + columns - 1) / columns;
  Picture picture = blank_picture(columns * width, rows * height + kTitleHeight + kLegendHeight);
  draw_text(picture, title, picture.width / 2, picture.height - kTitleHeight / 2, 24,
            Align::kCenter);
  const int spacing = (picture.width - 80) / static_cast<int>(legend.size());
  for (std::size_t k = 0; k < legend.size(); ++k) {
    const int x = 40 + static_cast<int>(k) * spacing;
    fill_box(picture, x, kLegendHeight / 2 - 8, 16, 16, legend[k].color);
    draw_text(picture, legend[k].name, x + 26, kLegendHeight / 2, 18, Align::kLeft);
  }
  for (int k = 0; k < static_cast<int>(panels); ++k) {
    frames.push_back(
        {(k % columns) * width, kLegendHeight + (rows - 1 - k / columns) * height, width, height});
  }
  return picture;
}

/// A logarithmic axis from one power of ten to another.
struct LogAxis {
  int first = 0, last = 1;           // exponents
  double start = 0.0, length = 1.0;  // [px]

  double at(double value) const {
    return start + length * (std::log10(value) - first) / (last - first);
  }
};

LogAxis fit_axis(const FrontPlot& plot, int coordinate, double start, double length) {
  double low = std::numeric_limits<double>::max(), high = 0.0;
  for (const FrontLine& line : plot.lines) {
    for (const Eigen::Vector2d& point : line.points) {
      low = std::min(low, point[coordinate]);
      high = std::max(high, point[coordinate]);
    }
  }
  expects(low > 0.0 && low <= high && std::isfinite(high));
  LogAxis axis;
  axis.first = static_cast<int>(std::floor(std::log10(low)));
  axis.last = std::max(axis.first + 1, static_cast<int>(std::ceil(std::log10(high))));
  axis.start = start;
  axis.length = length;
  return axis;
}

/// Grid lines at the powers of ten and, fainter, at their multiples, with the powers' values.
void draw_grid(Picture& picture, const LogAxis& x, const LogAxis& y) {
  for (const bool fine : {true, false}) {
    for (const bool vertical : {true, false}) {
      const LogAxis& axis = vertical ? x : y;
      for (int decade = axis.first; decade <= axis.last; ++decade) {
        for (int multiple = fine ? 2 : 1; multiple <= (fine ? 9 : 1); ++multiple) {
          if (fine && decade == axis.last) continue;
          const double p = axis.at(multiple * std::pow(10.0, decade));
          const Eigen::Vector2d a =
              vertical ? Eigen::Vector2d(p, y.start) : Eigen::Vector2d(x.start, p);
          const Eigen::Vector2d b = vertical ? Eigen::Vector2d(p, y.start + y.length)
                                             : Eigen::Vector2d(x.start + x.length, p);
          draw_line(picture, a, b, 1.0, fine ? kFineGrid : kGrid);
          if (fine) continue;
          const std::string text = format("%g", std::pow(10.0, decade));
          const int at = static_cast<int>(p);
          if (vertical) {
            draw_text(picture, text, at, static_cast<int>(y.start) - 16, 15, Align::kCenter);
          } else {
            draw_text(picture, text, static_cast<int>(x.start) - 8, at, 15, Align::kRight);
          }
        }
      }
    }
  }
  const std::array<Eigen::Vector2d, 3> corners{
      {{x.start, y.start + y.length}, {x.start, y.start}, {x.start + x.length, y.start}}};
  draw_line(picture, corners[0], corners[1], 1.5, kInk);
  draw_line(picture, corners[1], corners[2], 1.5, kInk);
}

/// The points that no other beats in both coordinates, by x.
std::vector<Eigen::Vector2d> front_of(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2d> front;
  for (const Eigen::Vector2d& point : points) {
    if (front.empty() || point.y() < front.back().y()) front.push_back(point);
  }
  return front;
}

void draw_front(Picture& picture, const Frame& frame, const FrontPlot& plot,
                const std::vector<LegendEntry>& legend) {
  const LogAxis x = fit_axis(plot, 0, frame.left + 100.0, frame.width - 140.0);
  const LogAxis y = fit_axis(plot, 1, frame.bottom + 80.0, frame.height - 160.0);
  const int top = frame.bottom + frame.height;
  draw_text(picture, plot.title, frame.left + frame.width / 2, top - 20, 20, Align::kCenter);
  draw_text(picture, plot.y_label, frame.left + 30, top - 56, 16, Align::kLeft);
  draw_text(picture, plot.x_label, frame.left + frame.width / 2, frame.bottom + 34, 16,
            Align::kCenter);
  draw_grid(picture, x, y);
  for (const FrontLine& line : plot.lines) {
    const Color& color = legend[line.entry].color;
    const auto place = [&](const Eigen::Vector2d& p) {
      return Eigen::Vector2d(x.at(p.x()), y.at(p.y()));
    };
    const std::vector<Eigen::Vector2d> front = front_of(line.points);
    for (std::size_t k = 0; k + 1 < front.size(); ++k) {
      draw_line(picture, place(front[k]), place(front[k + 1]), 2.5, color);
    }
    for (const Eigen::Vector2d& p : line.points) draw_line(picture, place(p), place(p), 6.0, color);
  }
}

void draw_matrix(Picture& picture, const Frame& frame, const MatrixPlot& plot,
                 const std::vector<LegendEntry>& legend) {
  const int columns = static_cast<int>(plot.x_ticks.size());
  const int rows = static_cast<int>(plot.y_ticks.size());
  expects(columns > 0 && rows > 0 && plot.cells.size() == std::size_t(columns) * rows);
  const int left = frame.left + 70, bottom = frame.bottom + 70, top = frame.bottom + frame.height;
  const int width = (frame.width - 90) / columns, height = (frame.height - 140) / rows;
  draw_text(picture, plot.title, frame.left + frame.width / 2, top - 18, 18, Align::kCenter);
  draw_text(picture, plot.y_label, frame.left + 20, top - 46, 15, Align::kLeft);
  draw_text(picture, plot.x_label, frame.left + frame.width / 2, frame.bottom + 26, 15,
            Align::kCenter);
  for (int c = 0; c < columns; ++c) {
    draw_text(picture, plot.x_ticks[c], left + c * width + width / 2, bottom - 14, 14,
              Align::kCenter);
  }
  for (int r = 0; r < rows; ++r) {
    draw_text(picture, plot.y_ticks[r], left - 6, bottom + r * height + height / 2, 14,
              Align::kRight);
    for (int c = 0; c < columns; ++c) {
      const int entry = plot.cells[std::size_t(r) * columns + c];
      if (entry < 0) continue;
      fill_box(picture, left + c * width, bottom + r * height, width - 1, height - 1,
               legend[static_cast<std::size_t>(entry)].color);
    }
  }
}

}  // namespace

Picture draw_fronts(const std::string& title, const std::vector<FrontPlot>& plots, int columns,
                    const std::vector<LegendEntry>& legend) {
  std::vector<Frame> frames;
  Picture picture = blank_sheet(title, legend, plots.size(), columns, 800, 600, frames);
  for (std::size_t k = 0; k < plots.size(); ++k) draw_front(picture, frames[k], plots[k], legend);
  return picture;
}

Picture draw_matrices(const std::string& title, const std::vector<MatrixPlot>& plots, int columns,
                      const std::vector<LegendEntry>& legend) {
  std::vector<Frame> frames;
  Picture picture = blank_sheet(title, legend, plots.size(), columns, 400, 420, frames);
  for (std::size_t k = 0; k < plots.size(); ++k) draw_matrix(picture, frames[k], plots[k], legend);
  return picture;
}

}  // namespace wireplan::pipeline
