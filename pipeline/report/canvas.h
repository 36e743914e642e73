#pragma once
/// What pictures and plots share: a raster with boxes, lines and text, and the PNG file. For use in
/// this folder. VTK sets the text and writes the file; no display is needed (see picture.h).
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace wireplan::pipeline {

using Color = Eigen::Vector3f;  // red, green, blue in [0, 1]

inline const Color kPaper(1.0F, 1.0F, 1.0F), kInk(0.15F, 0.15F, 0.15F), kGrey(0.5F, 0.5F, 0.5F);

/// Viridis without its darkest quarter, as on the page: 0 blue, 1 yellow; told apart by people of
/// any color vision and in gray.
Color force_color(double part);

/// Rows from the bottom up, pixels from left to right, three bytes (red, green, blue) each.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// All paper.
Picture blank_picture(int width, int height);

void fill_box(Picture& picture, int x_0, int y_0, int width, int height, const Color& color);

/// A smooth line `width` pixels wide with round ends; a dot where `a` and `b` are equal.
void draw_line(Picture& picture, const Eigen::Vector2d& a, const Eigen::Vector2d& b, double width,
               const Color& color);

/// force_color from 0 at the left to 1 at the right.
void draw_force_bar(Picture& picture, int x, int y, int width, int height);

enum class Align { kLeft, kCenter, kRight };

/// Text in VTK's built-in font with its middle at row `y`. Text that cannot be set is left out.
void draw_text(Picture& picture, const std::string& text, int x, int y, int size, Align align,
               const Color& color = kInk);

/// The bytes of a PNG file.
std::string encode_png(const Picture& picture);

/// Throws `Error` where the file cannot be written.
void write_png(const Picture& picture, const std::filesystem::path& png);

}  // namespace wireplan::pipeline
