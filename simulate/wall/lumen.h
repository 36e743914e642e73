#pragma once
/// The lumen as a smooth signed distance field of the vessel's surface, shared by all trials.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "preprocess/surface/openings.h"
#include "preprocess/vessel.h"

namespace wireplan::simulate {

struct SampleGrid;

struct LumenOptions {
  double grid_spacing = 0.5;  // of the distance samples                                  [mm]
  double band = 2.0;          // the field follows the wall within this distance of it    [mm]
  std::vector<preprocess::Opening> openings = {};  // of the surface: no wall there (find_openings)
};

/// Distance to the wall at a point with its derivatives; positive inside the lumen.
struct WallSample {
  double distance = 0.0;         //                                                       [mm]
  Vec3 gradient = Vec3::Zero();  // points into the lumen                                 [-]
  Mat3 hessian = Mat3::Zero();   //                                                       [1/mm]
};

/// The lumen as a wire feels it: a field of signed distances to the wall. The distances to the
/// triangles are exact on the nodes of a sparse grid round the wall, and interpolated by cubic
/// B-splines. These are twice differentiable, so a wire slides over facets without chatter. Beyond
/// the band the distance is +-band, without derivatives.
///
/// Caps of openings are not wall: the lumen goes on through them into free space, as if the vessel
/// ended in a flange. The flange is a ring of the cap's plane round the rim, as wide as band and
/// two cells (3 mm by default; less where another vessel is near). The free space reaches 8 mm
/// beyond the plane and is as wide as the flange; the distance there is that to the rim or the
/// flange.
class Lumen {
 public:
  static constexpr double kFreeLength = 8.0;  // how far the lumen goes on beyond a cap      [mm]

  /// Expects a closed surface with outward triangles.
  explicit Lumen(const Surface& surface, const LumenOptions& options = {});

  double distance(const Vec3& point) const;
  WallSample sample(const Vec3& point) const;

  const std::vector<preprocess::Opening>& openings() const { return openings_; }
  double grid_spacing() const { return spacing_; }
  double band() const { return band_; }
  /// Largest and mean |distance| of the field at vertices and centroids of the wall's triangles,
  /// where the exact answer is 0: how far the smooth wall departs from the surface [mm].
  double max_deviation() const { return max_deviation_; }
  double mean_deviation() const { return mean_deviation_; }
  std::size_t memory_bytes() const;

  /// The field as bytes, and back bit for bit, so that not every process has to compute it
  /// (lumen_bytes.cpp). The bytes are in this machine's number formats. Bytes in other formats, or
  /// cut ones, give nothing.
  std::string to_bytes() const;
  static std::optional<Lumen> from_bytes(std::string_view bytes);

 private:
  Lumen() = default;
  static constexpr int kCells = 8;           // cells of a brick along each axis
  static constexpr int kNodes = kCells + 3;  // spline coefficients that they need

  struct Place {                // a point in the grid
    const float* coefficients;  // of the brick's first node; null beyond the band
    double sign;                // of the distance there
    std::array<int, 3> cell;    // within the brick
    Vec3 fraction;              // within the cell

    /// Coefficients of the cell along x, in its support's row j, k along y, z.
    Eigen::Array4d row(int j, int k) const;
  };
  Place find_place(const Vec3& point) const;

  /// Keeps with each brick all coefficients that its cells need, so that a look-up stays in one.
  void keep_bricks(const SampleGrid& grid, const std::vector<double>& coefficients);
  /// How well the smooth wall follows the triangles, caps left out.
  void measure_deviation(const Surface& surface);

  double spacing_ = 0.0, band_ = 0.0, max_deviation_ = 0.0, mean_deviation_ = 0.0;
  Vec3 origin_ = Vec3::Zero();             // of brick (0, 0, 0)                          [mm]
  std::array<int, 3> bricks_ = {0, 0, 0};  // along each axis
  std::vector<preprocess::Opening> openings_;
  std::vector<std::int32_t> brick_;  // slot of each brick, or -1 outside, -2 inside
  std::vector<float> coefficients_;  // kNodes^3 per slot, x fastest                [mm]
};

}  // namespace wireplan::simulate
