#pragma once
/// Plots of the benches as pictures: lines over logarithmic axes, and matrices of colored cells.
/// Drawn by ourselves, since VTK's charts need an OpenGL window, which Debian's VTK does not make
/// without a display.
#include <string>
#include <vector>

#include "pipeline/report/canvas.h"

namespace wireplan::pipeline {

struct LegendEntry {
  std::string name;
  Color color = kInk;
};

/// Measured points as dots, and a line through those that no other point beats in both
/// coordinates: the least y that is had for each x.
struct FrontLine {
  std::size_t entry = 0;                // of the legend
  std::vector<Eigen::Vector2d> points;  // both above 0
};

struct FrontPlot {
  std::string title, x_label, y_label;
  std::vector<FrontLine> lines;  // at least one point in all
};

/// Panels in rows of `columns`, each 800 x 600 pixels, a title above and the legend below.
Picture draw_fronts(const std::string& title, const std::vector<FrontPlot>& plots, int columns,
                    const std::vector<LegendEntry>& legend);

struct MatrixPlot {
  std::string title, x_label, y_label;
  std::vector<std::string> x_ticks, y_ticks;  // one per column and row of cells
  std::vector<int> cells;                     // row by row from below: entry of the legend, or -1
};

/// The same for matrices, in panels of 400 x 420 pixels.
Picture draw_matrices(const std::string& title, const std::vector<MatrixPlot>& plots, int columns,
                      const std::vector<LegendEntry>& legend);

}  // namespace wireplan::pipeline
