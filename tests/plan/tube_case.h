#pragma once
/// A straight tube of 4 mm radius along z, and a study in it that lacks wires and angles.
#include "plan/make_plan.h"
#include "tests/shapes.h"

namespace wireplan::plan {

struct TubeCase {
  Study study;
  Centerline path;

  TubeCase() {
    study.access = Vec3(0.0, 0.0, 5.0);
    study.goal = {.point = Vec3(0.0, 0.0, 30.0), .radius = 4.5};
    study.insertion.length = 35.0;
    path.points.resize(3, 2);
    path.points << 0.0, 0.0, 0.0, 0.0, 5.0, 30.0;
    path.radius = Eigen::Vector2d(4.0, 4.0);
    path.arc_length = Eigen::Vector2d(0.0, 25.0);
  }
  /// Made once; its wall is rigid.
  static const simulate::VesselModel& model() {
    static const simulate::VesselModel tube(shapes::straight_tube(4.0, 50.0, 2.0));
    return tube;
  }
  Plan plan(TrialLog& log, const PlanOptions& options) const {
    return make_plan(study, {.path = path, .model = model, .rigid_model = model}, options, log);
  }
};

}  // namespace wireplan::plan
