#pragma once
/// How far a point lies from the true wall of a phantom's arteries: what a surface or a radius that
/// was found is held against.
#include <memory>

#include "preprocess/volume/phantom.h"

namespace wireplan::preprocess {

class PhantomLumen {
 public:
  explicit PhantomLumen(const PhantomSpec& spec);
  ~PhantomLumen();

  /// To the wall, or to plaque; negative inside the lumen. Exact where the lumen is a single round
  /// tube, else the least of what its tubes say; by plaque, along the tube's radius. What lies
  /// above a breath has moved.                                                            [mm]
  double distance(const Vec3& point) const;

 private:
  struct Shapes;
  std::unique_ptr<const Shapes> shapes_;
};

}  // namespace wireplan::preprocess
