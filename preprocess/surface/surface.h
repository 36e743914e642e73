#pragma once
/// Mask or surface file -> closed, oriented, checked triangles.
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/surface/surface_fit.h"
#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct SurfaceOptions {
  double edge_length_mm = 1.0;  // of the remesh; shorter where a vessel is thin         [mm]
};

/// What was measured of a surface. It is sound if it is one piece, closed and manifold, with
/// normals outward, without degenerate triangles and self-intersections. Handles (g of them make
/// the Euler number 2 - 2g) are reported, not refused.
struct SurfaceCheck {
  int vertices = 0, triangles = 0, pieces = 0;  // vertices that a triangle uses
  int open_edges = 0;                           // of one triangle
  int non_manifold_edges = 0;                   // of three or more
  int misoriented_edges = 0;                    // of two whose normals disagree
  int non_manifold_vertices = 0;                // where sheets touch in a point
  int degenerate_triangles = 0;                 // without area
  int euler_number = 0;
  int self_intersections =
      0;  // pairs of triangles; not looked for where the surface is not manifold
  // The first of each that is not sound.                                                 [mm]
  Vec3 open_at = Vec3::Zero(), non_manifold_at = Vec3::Zero(), misoriented_at = Vec3::Zero(),
       touching_at = Vec3::Zero(), degenerate_at = Vec3::Zero(), cut_at = Vec3::Zero();
  bool outward = false;
  double volume_mm3 = 0.0, area_mm2 = 0.0;
  double min_angle_deg = 0.0, mean_edge_mm = 0.0, max_edge_mm = 0.0;
};

/// Isosurface of the mask at 1/2, smoothed by a windowed sinc that keeps the volume, and remeshed
/// to the edge length. The largest piece is kept, cavities inside it are filled, and it is capped
/// where the mask meets the border of its grid. The surface is sound. Throws `Error` for an empty
/// mask or where no sound surface is found.
Surface surface_from_mask(const Mask& mask, const SurfaceOptions& options);

/// The same, then fitted to the image before the remesh: its edge lies where the grey value passes
/// half way between lumen and surroundings (or as far from there as the mask's edge is in the
/// median, see `FitWidth`), not where the mask's stairs are. Image and mask share one grid. Fills
/// `statistics` where it is not null.
Surface surface_from_image(const Image& image, const Mask& mask, const SurfaceOptions& options,
                           FitStatistics* statistics = nullptr,
                           FitWidth width = FitWidth::kOfImage);

/// "LPS" or "RAS" where the file says in which frame it is, as 3D Slicer writes it: in the header
/// of an STL, a comment of a PLY or OBJ, the field SPACE of a VTP, in letters or words of any case.
/// Another frame as it is told, in capitals ("LPI"). Empty where it tells none, or is not there.
std::string told_frame(const std::filesystem::path& path);

/// Reads the triangles of an STL, PLY, OBJ or VTP file as they stand there, with two changes:
/// points that are equal to 1e-7 of the size are merged, and polygons are cut into triangles.
/// `unit` is "mm", "cm" or "m"; `frame` is "LPS" or "RAS" (x, y flipped). Throws `Error` where the
/// file is missing or no surface.
Surface read_triangles(const std::filesystem::path& path, const std::string& unit,
                       const std::string& frame);

/// Remeshes isotropically to the edge length, or to half of the local inscribed radius where that
/// is less, so that thin branches and their caps keep their shape. Where the remesh makes triangles
/// cut each other, it is tried again with shorter edges, first there and then everywhere
/// (prototypes B). A surface that already has such edges (mean within 10 %, none over twice as
/// long) is left as it is. Expects a sound surface; throws `Error` where none of the tries gives
/// one.
Surface remesh(const Surface& surface, double edge_length_mm);

/// The same of a surface that was checked.
Surface remesh(const Surface& surface, const SurfaceCheck& check, double edge_length_mm);

SurfaceCheck check_surface(const Surface& surface);

/// The same; `cutting` becomes the triangles of the self-intersections, ascending.
SurfaceCheck check_surface(const Surface& surface, std::vector<int>& cutting);

/// Triangles that cut another one, ascending. Expects a manifold, oriented surface.
std::vector<int> find_self_intersections(const Surface& surface);

bool is_sound(const SurfaceCheck& check);

/// Throws `Error`, naming `origin` (a file or stage), every failed check and a remedy, unless
/// sound.
void require_sound(const SurfaceCheck& check, const std::string& origin);

/// Volume enclosed [mm^3], negative where the normals point inward.
double signed_volume(const Surface& surface);

/// A piece of a surface (connected through edges), outward, without unused vertices.
struct Piece {
  Surface surface;
  bool turned = false;  // it faced inward, and was turned as a whole
};

/// The piece of the largest volume comes first. An open piece counts with the volume that it
/// encloses together with its first vertex.
std::vector<Piece> pieces_of(const Surface& surface);

/// The first of these.
Surface largest_piece(const Surface& surface);

/// True where the point [mm] lies inside the closed surface, and its distance to it [mm].
struct InsideAnswer {
  bool inside = false;
  double distance = 0.0;
};
InsideAnswer locate_point(const Surface& surface, const Vec3& point);

}  // namespace wireplan::preprocess
