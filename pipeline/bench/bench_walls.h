#pragma once
/// Vessels made in code for the benches. For use in this folder.
#include <string>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::pipeline {

/// Of `bench stability`: each has something that contact is known to break on.
struct BenchWall {
  std::string name, text;
  Surface surface;            // closed, outward; runs along +z from z = 0
  double entry_radius = 4.0;  // of the lumen near its start                              [mm]
};

std::vector<BenchWall> make_bench_walls();

/// Of `bench throughput`: aorta, iliac and renal arteries in isotropic triangles of this edge
/// length [mm]. The path leads from the right external iliac artery up the aorta.
Vessel make_arterial_tree(double edge_length);

/// Of `bench scripts`: an aorta of 9 mm radius, 130 mm up along +z from the origin, with a branch
/// of 3 mm toward +x at 60 mm. The path leads from its foot 35 mm into that.
Vessel make_branched_aorta();

/// A tube of radius 5 mm with two bends of 90 degrees, radius 60 mm, the second square to the plane
/// of the first. Starts at the origin along +z.
Vessel make_s_tube();

/// The same, of radius 6 mm and straight for 200, 20 and 260 mm: 668 mm long.
Vessel make_long_s_tube();

/// A tube of 1160 triangles, as many as that of the paper's Fig. 5, whose measures the paper does
/// not tell: radius 3 mm, 65 mm long, a bend of 90 degrees of radius 30 mm. Its wall has 1 MPa: one
/// of 25 kPa/mm would give way to so stiff a wire altogether. Starts at the origin along +z.
Vessel make_paper_tube();

/// The surface with this many triangles, or as few above it as can be had without a hole or a fold.
/// Throws Error where what comes out is not sound.
Surface decimate(const Surface& surface, int triangles);

/// Is the point inside the closed surface? By the solid angle of its triangles: slow, and shares
/// nothing with the distance field that it checks.
bool is_inside(const Surface& surface, const Vec3& point);

}  // namespace wireplan::pipeline
