#pragma once
/// Exact distance to a surface. It is fast in the middle of a vessel, where a whole ring of the
/// wall is almost equally near; CGAL's tree is slow there (MEASUREMENTS.md).
#include <array>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// The place of the wall nearest to some point.
struct Nearest {
  Vec3 foot = Vec3::Zero();  //                                                          [mm]
  double distance = 0.0;     //                                                          [mm]
  int triangle = 0;          // number within the tree, for a later search that starts here
};

/// A tree of boxes over the triangles.
class NearestWall {
 public:
  explicit NearestWall(const Surface& surface);  // at least one triangle with an area

  Nearest find(const Vec3& p) const { return find(p, {}); }

  /// The same answer, found sooner if `near` is the answer for a point close by.
  Nearest find(const Vec3& p, const Nearest& near) const;

 private:
  struct Triangle {
    Vec3 a, b, c, normal;
  };
  struct Box {
    Vec3 low, high;
    int first = 0;  // triangle, or the first of two children, which are neighbours
    int count = 0;  // of triangles; 0: it has children
  };

  void split(int box, int first, int last);

  std::vector<Triangle> triangles_;  // those of a box lie together
  std::vector<Box> boxes_;
};

}  // namespace wireplan::preprocess
