#include "preprocess/volume/phantom_lumen.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "preprocess/volume/phantom_shapes.h"

namespace wireplan::preprocess {

struct PhantomLumen::Shapes {
  std::vector<TubeShape> tubes;
  std::vector<PlaqueShape> plaques;
  std::optional<PhantomBreath> breath;
};

PhantomLumen::PhantomLumen(const PhantomSpec& spec) {
  auto shapes = std::make_unique<Shapes>();
  for (const PhantomTube& tube : spec.tubes) {
    if (tube.kind == PhantomTubeKind::kArtery) shapes->tubes.push_back(make_tube(tube, 0.0));
  }
  for (const PhantomCalcium& calcium : spec.calcium) {
    shapes->plaques.push_back(make_plaque(calcium, tube_named(spec, calcium.tube)));
  }
  shapes->breath = spec.breath;
  shapes_ = std::move(shapes);
}

PhantomLumen::~PhantomLumen() = default;

double PhantomLumen::distance(const Vec3& point) const {
  const auto& breath = shapes_->breath;
  const bool moved = breath && point.z() > breath->above_z_mm;
  const Vec3 p = moved ? Vec3(point - breath->shift_mm) : point;
  double distance = std::numeric_limits<double>::infinity();
  for (const TubeShape& tube : shapes_->tubes) {
    distance = std::min(distance, -find_foot(tube, p).depth);
  }
  for (const PlaqueShape& plaque : shapes_->plaques) {
    const TubeFoot foot = find_foot(plaque.tube, p);
    if (foot.depth > 0.0) {
      distance = std::max(distance, -clearance(plaque, p) / plaque.inverse_slope);
    }
  }
  return distance;
}

}  // namespace wireplan::preprocess
