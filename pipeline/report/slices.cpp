#include "pipeline/report/slices.h"

#include <vtkImageData.h>
#include <vtkJPEGWriter.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pipeline/report/page.h"

namespace wireplan::pipeline {
namespace {

constexpr int kJpegQuality = 85;

Slice cut_slice(const preprocess::Image& image, const Surface& surface, Plane plane,
                const Vec3& middle, const SliceOptions& options) {
  Slice slice;
  slice.plane = plane;
  slice.gray.reserve(static_cast<std::size_t>(options.size) * options.size);
  const double spacing = options.field / options.size, half = 0.5 * (options.size - 1);
  const double scale = 255.0 / (options.window_high - options.window_low);
  for (int row = 0; row < options.size; ++row) {
    for (int column = 0; column < options.size; ++column) {
      const Vec3 point =
          middle + spacing * ((column - half) * right_of(plane) + (row - half) * down_of(plane));
      const double value = sample(image, point);
      const double level =
          std::isnan(value) ? 0.0 : std::clamp(scale * (value - options.window_low), 0.0, 255.0);
      slice.gray.push_back(static_cast<std::uint8_t>(std::lround(level)));
    }
  }
  slice.outline = cut_outline(surface, plane, middle, options.field);
  return slice;
}

}  // namespace

const char* plane_name(Plane plane) {
  switch (plane) {
    case Plane::kAxial:
      return "axial";
    case Plane::kCoronal:
      return "coronal";
    case Plane::kSagittal:
      return "sagittal";
  }
  return "";
}

Vec3 right_of(Plane plane) { return plane == Plane::kSagittal ? Vec3::UnitY() : Vec3::UnitX(); }
Vec3 down_of(Plane plane) { return plane == Plane::kAxial ? Vec3::UnitY() : Vec3(-Vec3::UnitZ()); }

double sample(const preprocess::Image& image, const Vec3& point) {
  const preprocess::Grid& grid = image.grid;
  const Vec3 place = grid.ijk_from_lps(point);
  std::array<std::size_t, 2> at[3];  // of the voxels below and above: parts of their index
  std::array<double, 2> weight[3];
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = grid.size[axis] - 1;
    // A point on the last voxels' centres, up to rounding, is still in the volume.
    if (place[axis] < -1e-9 || place[axis] > last + 1e-9) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const int first =
        std::clamp(static_cast<int>(std::floor(place[axis])), 0, std::max(0, last - 1));
    const double part = last == 0 ? 0.0 : place[axis] - first;
    weight[axis] = {1.0 - part, part};
    at[axis] = {stride * static_cast<std::size_t>(first),
                stride * static_cast<std::size_t>(std::min(first + 1, last))};
    stride *= static_cast<std::size_t>(grid.size[axis]);
  }
  double sum = 0.0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
    const double share = weight[0][i] * weight[1][j] * weight[2][k];
    if (share == 0.0) continue;  // no voxel there, or one without a value
    sum += share * static_cast<double>(image.values[at[0][i] + at[1][j] + at[2][k]]);
  }
  return sum;
}

Eigen::Matrix4Xf cut_outline(const Surface& surface, Plane plane, const Vec3& middle,
                             double field) {
  const Vec3 right = right_of(plane), down = down_of(plane), normal = right.cross(down);
  const auto reach = static_cast<float>(0.5 * field);
  const Eigen::RowVectorXd heights =
      normal.transpose() * (surface.vertices.colwise() - middle);  // (1, N)
  std::vector<Eigen::Vector4f> segments;
  for (const Eigen::Vector3i& triangle : surface.triangles.colwise()) {
    // The two of its edges that cross the plane; a corner in the plane counts as above it.
    const int below = (heights[triangle[0]] < 0.0 ? 1 : 0) + (heights[triangle[1]] < 0.0 ? 1 : 0) +
                      (heights[triangle[2]] < 0.0 ? 1 : 0);
    if (below == 0 || below == 3) continue;
    Eigen::Vector4f segment;
    int ends = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = surface.vertices.col(triangle[k]) - middle;
      const Vec3 b = surface.vertices.col(triangle[(k + 1) % 3]) - middle;
      const double height_a = heights[triangle[k]], height_b = heights[triangle[(k + 1) % 3]];
      if ((height_a < 0.0) == (height_b < 0.0)) continue;
      const Vec3 cross = a + height_a / (height_a - height_b) * (b - a);
      segment.segment<2>(2 * ends++) =
          Eigen::Vector2d(right.dot(cross), down.dot(cross)).cast<float>();
    }
    if (ends == 2 && segment.cwiseAbs().minCoeff() <= reach &&
        (segment.head<2>().cwiseAbs().maxCoeff() <= reach ||
         segment.tail<2>().cwiseAbs().maxCoeff() <= reach)) {
      segments.push_back(segment);
    }
  }
  Eigen::Matrix4Xf outline(4, static_cast<Eigen::Index>(segments.size()));
  for (std::size_t k = 0; k < segments.size(); ++k) {
    outline.col(static_cast<Eigen::Index>(k)) = segments[k];
  }
  return outline;
}

Slices cut_slices(const preprocess::Image& image, const Surface& surface, std::vector<Place> places,
                  const SliceOptions& options) {
  expects(options.size > 0 && options.window_low < options.window_high);
  Slices slices{.size = options.size,
                .spacing = options.field / options.size,
                .window_low = options.window_low,
                .window_high = options.window_high,
                .places = std::move(places)};
  for (Place& place : slices.places) {
    for (std::size_t k = 0; k < kPlanes.size(); ++k) {
      place.slices[k] = cut_slice(image, surface, kPlanes[k], place.point, options);
    }
  }
  return slices;
}

Json slices_json(const Slices& slices) {
  Json places = Json::array();
  for (const Place& place : slices.places) {
    Json cuts = Json::array();
    for (const Slice& slice : place.slices) {
      const std::string jpeg = encode_jpeg(slice.gray, slices.size);
      const auto bytes = static_cast<std::size_t>(slice.outline.size()) * sizeof(float);
      cuts.push_back({{"plane", plane_name(slice.plane)},
                      {"jpeg", base64(jpeg.data(), jpeg.size())},
                      {"outline_mm", base64(slice.outline.data(), bytes)}});
    }
    places.push_back({{"name", place.name}, {"point_mm", to_json(place.point)}, {"cuts", cuts}});
  }
  return {{"size_px", slices.size},
          {"spacing_mm", slices.spacing},
          {"window_hu", {slices.window_low, slices.window_high}},
          {"places", std::move(places)}};
}

std::string encode_jpeg(const std::vector<std::uint8_t>& gray, int size) {
  expects(gray.size() == static_cast<std::size_t>(size) * size);
  vtkNew<vtkImageData> image;
  image->SetDimensions(size, size, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* pixels = static_cast<std::uint8_t*>(image->GetScalarPointer());
  for (int row = 0; row < size; ++row) {  // VTK's rows run from the bottom
    std::copy_n(gray.begin() + static_cast<std::ptrdiff_t>(row) * size, size,
                pixels + static_cast<std::ptrdiff_t>(size - 1 - row) * size);
  }
  vtkNew<vtkJPEGWriter> writer;
  writer->SetInputData(image);
  writer->SetQuality(kJpegQuality);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  expects(bytes != nullptr);
  return {reinterpret_cast<const char*>(bytes->GetPointer(0)),
          static_cast<std::size_t>(bytes->GetNumberOfValues())};
}

}  // namespace wireplan::pipeline
