#pragma once
/// A study small enough to run many times.
#include "plan/candidates.h"
#include "simulate/wall/vessel_model.h"
#include "tests/shapes.h"

namespace wireplan::plan {

/// A wire askew into a straight tube with a wall that yields, and lies along it.
struct TubeStudy {
  Study study;
  Candidate candidate{.wire = 0, .inclination = 15.0 * kRadPerDeg};
  Surface surface = shapes::straight_tube(4.0, 50.0, 2.0);

  TubeStudy() {
    study.wires = {
        {.name = "soft", .radius = 0.4, .sections = {{.length = 60.0, .bending_stiffness = 50.0}}}};
    study.inclinations = study.azimuths = study.rolls = {0.0};
    study.access = Vec3(0.0, 0.0, 5.0);
    study.goal = {.point = Vec3(0.0, 0.0, 35.0), .radius = 4.5};
    study.insertion.length = 32.0;
    study.insertion.step = 2.0;
    study.insertion.friction = 0.1;
  }

  simulate::VesselModel vessel(double young_modulus) const {
    return simulate::VesselModel(surface, shapes::extruded_wall(surface, 1.0, young_modulus));
  }
};

}  // namespace wireplan::plan
