#pragma once
/// Vessels made in code for `bench stability`: each has something that contact is known to break
/// on. For use in this folder.
#include <string>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::pipeline {

struct BenchWall {
  std::string name, text;
  Surface surface;            // closed, outward; runs along +z from z = 0
  double entry_radius = 4.0;  // of the lumen near its start                              [mm]
};

std::vector<BenchWall> make_bench_walls();

/// Is the point inside the closed surface? By the solid angle of its triangles: slow, and shares
/// nothing with the distance field that it checks.
bool is_inside(const Surface& surface, const Vec3& point);

}  // namespace wireplan::pipeline
