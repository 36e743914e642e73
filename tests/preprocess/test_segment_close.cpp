// Tunnels of noise and films on bone, in masks of which both are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment_close.h"

namespace wireplan::preprocess {
namespace {

/// A block of 12 x 12 x 12 voxels of 1 mm in one of 16, without what `hole` says.
template <typename Hole>
Labels block_without(const Grid& grid, Hole hole) {
  Labels labels(grid.voxels(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n) {
    const Voxel v = voxel_at(grid, n);
    const bool inside = std::min({v[0], v[1], v[2]}) >= 2 && std::max({v[0], v[1], v[2]}) < 14;
    labels[n] = inside && !hole(v) ? 1 : 0;
  }
  return labels;
}

TEST(CloseTunnels, ATunnelIsFilledAndAGapBetweenLimbsIsNot) {
  const Grid grid{.size = {16, 16, 16}};
  const Labels nothing(grid.voxels(), 0);
  const auto tunnel = [](const Voxel& v) { return v[0] == 7 && v[1] == 7; };
  Labels labels = block_without(grid, tunnel);
  EXPECT_EQ(measure_shape(grid, labels).handles, 1U);
  close_tunnels(grid, 1.8, nothing, labels);
  EXPECT_EQ(measure_shape(grid, labels).handles, 0U);
  EXPECT_EQ(count(labels), 1728U);

  // A slit that comes from one side, as between limbs, stays; and a tunnel that is another vessel.
  const Labels limbs = block_without(grid, [](const Voxel& v) { return v[0] == 7 && v[1] > 4; });
  labels = limbs;
  close_tunnels(grid, 1.8, nothing, labels);
  EXPECT_EQ(labels, limbs);
  labels = block_without(grid, tunnel);
  Labels other(grid.voxels(), 0);
  for (std::size_t n = 0; n < other.size(); ++n) other[n] = tunnel(voxel_at(grid, n)) ? 1 : 0;
  const Labels before = labels;
  close_tunnels(grid, 1.8, other, labels);
  EXPECT_EQ(labels, before);
}

/// Labels the voxels of which `inside` holds.
template <typename Inside>
Labels labels_where(const Grid& grid, Inside inside) {
  Labels labels(grid.voxels(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n) {
    labels[n] = inside(voxel_at(grid, n)) ? 1 : 0;
  }
  return labels;
}

constexpr double kUpper = 500.0;

/// Bone above the band where `inside` holds, 40 HU elsewhere.
template <typename Inside>
std::vector<float> bone_where(const Grid& grid, Inside inside) {
  std::vector<float> values(grid.voxels(), 40.0F);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (inside(voxel_at(grid, n))) values[n] = 700.0F;
  }
  return values;
}

bool is_in_artery(const Voxel& v) { return std::hypot(v[0] - 8, v[1] - 15) < 5.5; }

bool is_in_bone(const Voxel& v) { return v[0] >= 15 && v[1] >= 5 && v[1] < 25; }

/// What lies on the side of the bone that faces the artery, so many voxels thick, and joins it.
bool is_in_film(const Voxel& v, int thickness) {
  return v[0] >= 15 - thickness && v[0] < 15 && v[1] >= 5 && v[1] < 25;
}

TEST(CutFilms, WhatLiesThinOnBoneGoesAndTheArteryStays) {
  const Grid grid{.size = {40, 30, 30}, .spacing = Vec3(0.8, 0.8, 1.25)};
  const std::vector<float> bone = bone_where(grid, is_in_bone), no_bone(grid.voxels(), 40.0F);
  const Labels none(grid.voxels(), 0);
  const Labels artery = labels_where(grid, is_in_artery);
  for (const int thickness : {1, 2}) {
    const Labels with_film = labels_where(
        grid, [&](const Voxel& v) { return is_in_artery(v) || is_in_film(v, thickness); });
    Labels labels = with_film;
    cut_films(grid, bone, kUpper, none, labels);
    // Of the film stays what lies within two voxels of the artery.
    EXPECT_LT(2 * (count(labels) - count(artery)), count(with_film) - count(artery)) << thickness;
    for (std::size_t n = 0; n < labels.size(); ++n) {
      const Voxel v = voxel_at(grid, n);
      EXPECT_GE(labels[n], artery[n]) << n;
      const double away = labels[n] != 0 ? std::hypot(v[0] - 8, v[1] - 15) : 0.0;
      EXPECT_LE(away, 5.5 + 3.5) << n;
    }

    // It stays where no bone lies, and where it is kept.
    labels = with_film;
    cut_films(grid, no_bone, kUpper, none, labels);
    EXPECT_EQ(labels, with_film);
    cut_films(grid, bone, kUpper, with_film, labels);
    EXPECT_EQ(labels, with_film);
  }
}

TEST(CutFilms, AnArteryInOneThickSliceStaysAndAFilmInOneFineSliceGoes) {
  // Along x in one slice, six voxels wide; bone below all of it.
  const auto in_slice = [](const Voxel& v) { return v[2] == 10 && v[1] >= 12 && v[1] < 18; };
  const auto below = [](const Voxel& v) { return v[2] < 9; };
  for (const double slice : {1.25, 3.0}) {
    const Grid grid{.size = {40, 30, 20}, .spacing = Vec3(0.8, 0.8, slice)};
    const std::vector<float> bone = bone_where(grid, below);
    const Labels none(grid.voxels(), 0);
    const Labels before = labels_where(grid, in_slice);
    Labels labels = before;
    cut_films(grid, bone, kUpper, none, labels);
    EXPECT_EQ(count(labels), slice < 2.0 ? 0U : count(before));
  }
}

}  // namespace
}  // namespace wireplan::preprocess
