#include "pipeline/report/canvas.h"

#include <vtkFreeTypeTools.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/files/disk.h"
#include "preprocess/base.h"

namespace wireplan::pipeline {

Color force_color(double part) {
  // Viridis (S. van der Walt, N. Smith, 2015, CC0) at 0.25, 0.375, ... 1.
  static const std::array<Color, 7> kViridis{{{0.231F, 0.322F, 0.545F},
                                              {0.173F, 0.447F, 0.557F},
                                              {0.129F, 0.569F, 0.549F},
                                              {0.157F, 0.682F, 0.502F},
                                              {0.369F, 0.788F, 0.384F},
                                              {0.678F, 0.863F, 0.188F},
                                              {0.992F, 0.906F, 0.145F}}};
  const double place = std::clamp(part, 0.0, 1.0) * (kViridis.size() - 1);
  const auto first = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const auto between = static_cast<float>(place - static_cast<double>(first));
  return (1.0F - between) * kViridis[first] + between * kViridis[first + 1];
}

Picture blank_picture(int width, int height) {
  Picture picture{width, height, {}};
  picture.rgb.resize(3UL * width * height);
  fill_box(picture, 0, 0, width, height, kPaper);
  return picture;
}

void fill_box(Picture& picture, int x_0, int y_0, int width, int height, const Color& color) {
  for (int y = std::max(0, y_0); y < std::min(picture.height, y_0 + height); ++y) {
    for (int x = std::max(0, x_0); x < std::min(picture.width, x_0 + width); ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * picture.width + x;
      for (int k = 0; k < 3; ++k) {
        picture.rgb[3 * pixel + k] = static_cast<std::uint8_t>(std::lround(255.0F * color[k]));
      }
    }
  }
}

void draw_force_bar(Picture& picture, int x, int y, int width, int height) {
  for (int k = 0; k < width; ++k) {
    fill_box(picture, x + k, y, 1, height, force_color((k + 0.5) / width));
  }
}

void draw_text(Picture& picture, const std::string& text, int x, int y, int size, Align align,
               const Color& color) {
  vtkNew<vtkTextProperty> property;
  property->SetFontFamilyToArial();
  property->SetFontSize(size);
  property->SetColor(color.x(), color.y(), color.z());
  vtkNew<vtkImageData> image;
  std::array<int, 2> dims{};
  constexpr int kDotsPerInch = 72;  // so that one point is one pixel
  if (text.empty() || !vtkFreeTypeTools::GetInstance()->RenderString(property, text, kDotsPerInch,
                                                                     image, dims.data())) {
    return;
  }
  // Blend the rendered RGBA over the picture.
  vtkUnsignedCharArray* bytes =
      vtkUnsignedCharArray::SafeDownCast(image->GetPointData()->GetScalars());
  if (bytes == nullptr || bytes->GetNumberOfComponents() != 4) return;
  const int image_width = image->GetDimensions()[0];
  const int shift = align == Align::kLeft ? 0 : align == Align::kCenter ? dims[0] / 2 : dims[0];
  for (int row = 0; row < dims[1]; ++row) {
    for (int column = 0; column < dims[0]; ++column) {
      const int px = x - shift + column, py = y - dims[1] / 2 + row;
      if (px < 0 || px >= picture.width || py < 0 || py >= picture.height) continue;
      const vtkIdType source = 4 * (static_cast<vtkIdType>(row) * image_width + column);
      const int opacity = bytes->GetValue(source + 3);
      const std::size_t pixel = static_cast<std::size_t>(py) * picture.width + px;
      for (int k = 0; k < 3; ++k) {
        std::uint8_t& target = picture.rgb[3 * pixel + k];
        target = static_cast<std::uint8_t>(
            (opacity * bytes->GetValue(source + k) + (255 - opacity) * target + 127) / 255);
      }
    }
  }
}

void draw_line(Picture& picture, const Eigen::Vector2d& a, const Eigen::Vector2d& b, double width,
               const Color& color) {
  const Eigen::Vector2d axis = b - a;
  const double squared_length = axis.squaredNorm(), reach = 0.5 * width + 1.0;
  const auto clamped = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
  };
  const int x_1 = clamped(std::max(a.x(), b.x()) + reach, picture.width);
  const int y_1 = clamped(std::max(a.y(), b.y()) + reach, picture.height);
  for (int y = clamped(std::min(a.y(), b.y()) - reach, picture.height); y < y_1; ++y) {
    for (int x = clamped(std::min(a.x(), b.x()) - reach, picture.width); x < x_1; ++x) {
      // A pixel is covered as far as its middle is within the line's edge.
      const Eigen::Vector2d from_a = Eigen::Vector2d(x + 0.5, y + 0.5) - a;
      const double along =
          squared_length > 0.0 ? std::clamp(from_a.dot(axis) / squared_length, 0.0, 1.0) : 0.0;
      const double distance = (from_a - along * axis).norm();
      const double covered = std::clamp(0.5 * width + 0.5 - distance, 0.0, 1.0);
      const std::size_t pixel = static_cast<std::size_t>(y) * picture.width + x;
      for (int k = 0; k < 3; ++k) {
        std::uint8_t& target = picture.rgb[3 * pixel + k];
        target = static_cast<std::uint8_t>(
            std::lround(covered * 255.0 * color[k] + (1.0 - covered) * target));
      }
    }
  }
}

std::string encode_png(const Picture& picture) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(picture.width, picture.height, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  std::copy(picture.rgb.begin(), picture.rgb.end(),
            static_cast<std::uint8_t*>(image->GetScalarPointer()));
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(image);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  expects(bytes != nullptr);
  return {reinterpret_cast<const char*>(bytes->GetPointer(0)),
          static_cast<std::size_t>(bytes->GetNumberOfValues())};
}

void write_png(const Picture& picture, const std::filesystem::path& png) {
  // VTK only warns about a file it cannot open, so the picture is made in memory first.
  write_whole(encode_png(picture), png);
}

}  // namespace wireplan::pipeline
