#include "preprocess/surface/surface_describe.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"

namespace wireplan::preprocess {
namespace {

/// Whether each edge belongs to two triangles, or more.
bool has_no_border(const Surface& surface) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(3 * static_cast<std::size_t>(surface.triangles.cols()));
  for (const auto& triangle : surface.triangles.colwise()) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      edges.push_back(std::minmax({triangle[k], triangle[(k + 1) % 3]}));
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t k = 0, next = 0; k < edges.size(); k = next) {
    while (next < edges.size() && edges[next] == edges[k]) ++next;
    if (next - k < 2) return false;
  }
  return true;
}

double area_of(const Surface& surface) {
  double area = 0.0;
  for (const auto& triangle : surface.triangles.colwise()) {
    const Vec3 a = surface.vertices.col(triangle[0]), b = surface.vertices.col(triangle[1]),
               c = surface.vertices.col(triangle[2]);
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

/// Extents and radii of vessels [mm], from a coronary to aorta and legs.
bool fits_vessel(const SurfaceDescription& told, double mm) {
  const double extent = mm * (told.high - told.low).maxCoeff(), radius = mm * told.usual_radius;
  return extent >= 10.0 && extent <= 2000.0 &&
         (told.usual_radius == 0.0 || (radius >= 0.3 && radius <= 30.0));
}

}  // namespace

SurfaceDescription describe_surface(const std::filesystem::path& path) {
  const Surface surface = read_triangles(path, "mm", "LPS");
  SurfaceDescription told;
  told.triangles = static_cast<int>(surface.triangles.cols());
  told.low = surface.vertices.rowwise().minCoeff();
  told.high = surface.vertices.rowwise().maxCoeff();
  told.frame = told_frame(path);
  const std::vector<Piece> pieces = pieces_of(surface);
  told.pieces = static_cast<int>(pieces.size());
  for (const Piece& piece : pieces) told.closed_pieces += has_no_border(piece.surface) ? 1 : 0;
  if (!pieces.empty() && has_no_border(pieces.front().surface)) {
    const Surface& largest = pieces.front().surface;
    // A long tube has the volume pi r^2 l and the area 2 pi r l.
    const double radius = 2.0 * std::abs(signed_volume(largest)) / area_of(largest);
    if (std::isfinite(radius)) told.usual_radius = radius;  // else it is flat
  }
  for (const char* unit : kLengthUnits) {
    const double mm = unit == std::string("mm") ? 1.0 : unit == std::string("cm") ? 10.0 : kMmPerM;
    if (fits_vessel(told, mm)) told.fitting_units.emplace_back(unit);
  }
  try {
    const RepairedSurface repaired =
        read_sound_surface(path, told.fitting_units.empty() ? "mm" : told.fitting_units.front(),
                           told.frame.empty() ? "LPS" : told.frame);
    told.mends = tell_mends(repaired.mends);
    told.openings = find_openings(repaired.surface);
  } catch (const Error& error) {
    const std::string message = error.what(), start = path.string() + ": ";
    told.refused = message.starts_with(start) ? message.substr(start.size()) : message;
  }
  return told;
}

}  // namespace wireplan::preprocess
