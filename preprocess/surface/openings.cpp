#include "preprocess/surface/openings.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "preprocess/surface/triangle_sides.h"

namespace wireplan::preprocess {

namespace {

// What a cap looks like. On the surfaces at hand caps keep well clear of these bounds.
const double kFlat = std::cos(8.0 * kRadPerDeg);  // a cap's core: normals within this of the seed's
const double kLip = std::cos(30.0 * kRadPerDeg);  // steeper is rim
const double kEdge = std::cos(60.0 * kRadPerDeg);  // a notch in the rim less steep is filled
constexpr std::size_t kFewestTriangles = 4;
constexpr double kLargestDepth = 0.2;       // of the cap's vertices off its plane, per radius
constexpr double kLargestDeviation = 0.06;  // rms of the same
constexpr double kLargestAspect = 2.2;      // of the ellipse with the patch's second moments
constexpr double kLeastFill =
    0.85;  // area over that ellipse's; 1 for an ellipse, 0.83 for a triangle
constexpr double kLeastSection = 0.7,
                 kLargestSection = 1.7;  // area within a radius behind, per cap's
constexpr double kLeastFarSection = 0.5, kLargestFarSection = 3.0;  // a diameter behind
constexpr double kLargestTaper = 0.35;  // mean of side normal . cap normal: a cone of 20 degrees
constexpr double kLargestSlant = 0.65;  // rms of it: a cut oblique by 45 degrees has 0.5
constexpr double kLargestReach = 40.0;  // area of the side that is looked at, per cap's

/// The surface with what the search asks of it again and again.
struct Facets {
  Eigen::Matrix3Xd normal, centroid;
  Eigen::VectorXd area;
  Eigen::Matrix3Xi neighbour;  // across edges 01, 12, 20
};

Facets describe_facets(const Surface& surface) {
  const Eigen::Index m = surface.triangles.cols();
  Facets facets{Eigen::Matrix3Xd(3, m), Eigen::Matrix3Xd(3, m), Eigen::VectorXd(m),
                triangle_neighbours(surface)};
  expects((facets.neighbour.array() >= 0).all());
  for (int f = 0; f < m; ++f) {
    const Eigen::Vector3i t = surface.triangles.col(f);
    const Vec3 a = surface.vertices.col(t[0]), b = surface.vertices.col(t[1]),
               c = surface.vertices.col(t[2]);
    const Vec3 twice_area = (b - a).cross(c - a);
    facets.area[f] = 0.5 * twice_area.norm();
    facets.normal.col(f) = twice_area.normalized();
    facets.centroid.col(f) = (a + b + c) / 3.0;
  }
  return facets;
}

class CapFinder {
 public:
  explicit CapFinder(const Surface& surface)
      : surface_(surface),
        facets_(describe_facets(surface)),
        all_(facets_.area.sum()),
        seen_(static_cast<std::size_t>(facets_.area.size()), 0),
        tried_(seen_.size(), false),
        taken_(seen_.size(), false) {}

  std::vector<Opening> find() {
    std::vector<Opening> openings;
    for (const int seed : flattest_first()) {
      if (tried_[static_cast<std::size_t>(seed)]) continue;
      Opening cap;
      if (!grow_cap(seed, cap) || !is_disc(cap) || !has_tube_behind(cap)) continue;
      for (const int f : cap.triangles) {
        tried_[static_cast<std::size_t>(f)] = true;
        taken_[static_cast<std::size_t>(f)] = true;
      }
      openings.push_back(std::move(cap));
    }
    std::sort(openings.begin(), openings.end(), [](const Opening& a, const Opening& b) {
      return a.triangles.front() < b.triangles.front();
    });
    return openings;
  }

 private:
  std::vector<int> flattest_first() const {
    std::vector<double> cosine(seen_.size());
    for (std::size_t f = 0; f < cosine.size(); ++f) {
      cosine[f] = 1.0;
      for (const int g : facets_.neighbour.col(static_cast<Eigen::Index>(f))) {
        const double between =
            facets_.normal.col(static_cast<Eigen::Index>(f)).dot(facets_.normal.col(g));
        cosine[f] = std::min(cosine[f], between);
      }
    }
    std::vector<int> order(cosine.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return cosine[static_cast<std::size_t>(a)] > cosine[static_cast<std::size_t>(b)];
    });
    return order;
  }

  /// Adds to `patch` the triangles that are connected with it through triangles that `belongs`
  /// accepts, until it says stop by holding more area than `limit`.
  template <class Belongs>
  double flood(std::vector<int>& patch, double limit, const Belongs& belongs) {
    ++stamp_;
    double area = 0.0;
    for (const int f : patch) {
      seen_[static_cast<std::size_t>(f)] = stamp_;
      area += facets_.area[f];
    }
    for (std::size_t k = 0; k < patch.size() && area <= limit; ++k) {
      for (const int g : facets_.neighbour.col(patch[k])) {
        if (seen_[static_cast<std::size_t>(g)] == stamp_ || !belongs(g)) continue;
        seen_[static_cast<std::size_t>(g)] = stamp_;
        patch.push_back(g);
        area += facets_.area[g];
      }
    }
    return area;
  }

  /// Plane and size of the cap's triangles.
  void fit(Opening& cap) const {
    Vec3 normal = Vec3::Zero(), moment = Vec3::Zero();
    double area = 0.0;
    for (const int f : cap.triangles) {
      normal += facets_.area[f] * facets_.normal.col(f);
      moment += facets_.area[f] * facets_.centroid.col(f);
      area += facets_.area[f];
    }
    cap.center = moment / area;
    cap.normal = normal.normalized();
    cap.radius = std::sqrt(area / kPi);
  }

  /// From a seed its flat surroundings, then on to the rim.
  bool grow_cap(int seed, Opening& cap) {
    // The core, flat to a few degrees; none of it need be a seed again.
    const Vec3 seed_normal = facets_.normal.col(seed);
    cap.triangles = {seed};
    flood(cap.triangles, all_, [&](int f) {
      return !taken_[static_cast<std::size_t>(f)] && facets_.normal.col(f).dot(seed_normal) > kFlat;
    });
    for (const int f : cap.triangles) tried_[static_cast<std::size_t>(f)] = true;
    if (cap.triangles.size() < kFewestTriangles) return false;
    fit(cap);

    // On to the rim, near the core's plane, and the notches that this leaves.
    const Opening core = cap;
    flood(cap.triangles, all_, [&](int f) {
      const double depth = core.normal.dot(facets_.centroid.col(f) - core.center);
      return !taken_[static_cast<std::size_t>(f)] &&
             facets_.normal.col(f).dot(core.normal) > kLip &&
             std::abs(depth) < kLargestDepth * core.radius;
    });
    for (std::size_t before = 0; before != cap.triangles.size();) {
      before = cap.triangles.size();
      flood(cap.triangles, all_, [&](int f) {
        int inside = 0;
        for (const int g : facets_.neighbour.col(f)) {
          if (seen_[static_cast<std::size_t>(g)] == stamp_) ++inside;
        }
        return inside >= 2 && !taken_[static_cast<std::size_t>(f)] &&
               facets_.normal.col(f).dot(core.normal) > kEdge;
      });
    }
    fit(cap);
    std::sort(cap.triangles.begin(), cap.triangles.end());
    return true;
  }

  /// One piece without holes, flat, and about as wide as long.
  bool is_disc(const Opening& cap) const {
    Mat3 moments = Mat3::Zero();  // of area about the center
    double area = 0.0;
    for (const int f : cap.triangles) {
      const Eigen::Vector3i t = surface_.triangles.col(f);
      const Vec3 offset = facets_.centroid.col(f) - cap.center;
      Mat3 second = offset * offset.transpose();
      for (int c = 0; c < 3; ++c) {
        const Vec3 arm = surface_.vertices.col(t[c]) - facets_.centroid.col(f);
        second += arm * arm.transpose() / 12.0;
      }
      moments += facets_.area[f] * second;
      area += facets_.area[f];
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(moments / area);
    const Vec3 spread = solver.eigenvalues().cwiseMax(0.0);
    const double ellipse = 4.0 * kPi * std::sqrt(spread[1] * spread[2]);
    if (std::sqrt(spread[0]) >= kLargestDeviation * cap.radius ||
        spread[2] >= kLargestAspect * kLargestAspect * spread[1] || area <= kLeastFill * ellipse) {
      return false;
    }
    std::set<int> vertices;
    std::set<std::pair<int, int>> edges;
    for (const int f : cap.triangles) {
      const Eigen::Vector3i t = surface_.triangles.col(f);
      for (int c = 0; c < 3; ++c) {
        vertices.insert(t[c]);
        edges.emplace(std::min(t[c], t[(c + 1) % 3]), std::max(t[c], t[(c + 1) % 3]));
      }
    }
    return vertices.size() + cap.triangles.size() == edges.size() + 1;
  }

  /// The section at a depth, by the divergence theorem: what lies between it and the cap has no
  /// area along the normal in sum.
  bool has_tube_behind(const Opening& cap) {
    const double area = kPi * cap.radius * cap.radius;
    for (const double radii : {0.5, 1.0, 2.0}) {
      std::vector<int> part = cap.triangles;
      const auto depth = [&](int f) {
        return cap.normal.dot(cap.center - facets_.centroid.col(f)) / cap.radius;
      };
      if (flood(part, kLargestReach * area, [&](int f) { return depth(f) < radii; }) >
          kLargestReach * area) {
        return false;
      }
      double section = 0.0, side = 0.0, along = 0.0, squared_along = 0.0;
      for (std::size_t k = 0; k < part.size(); ++k) {
        const int f = part[k];
        const double cosine = cap.normal.dot(facets_.normal.col(f)), share = facets_.area[f];
        section += share * cosine;
        if (k < cap.triangles.size() || depth(f) < 0.3) continue;  // the rim may be round
        side += share;
        along += share * cosine;
        squared_along += share * cosine * cosine;
      }
      if (radii > 1.0) {
        return section > kLeastFarSection * area && section < kLargestFarSection * area;
      }
      if (section < kLeastSection * area || section > kLargestSection * area) return false;
      if (radii == 1.0 && (std::abs(along) > kLargestTaper * side ||
                           squared_along > kLargestSlant * kLargestSlant * side)) {
        return false;
      }
    }
    return true;
  }

  const Surface& surface_;
  const Facets facets_;
  const double all_;       // area of all triangles                                      [mm^2]
  std::vector<int> seen_;  // equals stamp_ where the last flood went
  int stamp_ = 0;
  std::vector<bool> tried_, taken_;
};

}  // namespace

std::vector<Opening> find_openings(const Surface& surface) {
  expects(surface.triangles.cols() > 0);
  return CapFinder(surface).find();
}

namespace {

constexpr double kOval = 1.5;  // reach of a cap in its radii

bool is_near(const Opening& opening, const Vec3& tip) {
  return (tip - opening.center).norm() <= kLookedAt + kOval * opening.radius;
}

}  // namespace

bool may_have_left(const std::vector<Opening>& openings, const Vec3& tip) {
  return std::any_of(openings.begin(), openings.end(),
                     [&](const Opening& opening) { return is_near(opening, tip); });
}

std::optional<int> left_through(const std::vector<Opening>& openings,
                                const Eigen::Ref<const Eigen::Matrix3Xd>& wire) {
  constexpr double kBeyond = 1.0;  // a cap                                                [mm]
  const int tip = static_cast<int>(wire.cols()) - 1;
  for (std::size_t k = 0; k < openings.size(); ++k) {
    const Opening& opening = openings[k];
    if (!is_near(opening, wire.col(tip))) continue;
    double beyond = 0.0;
    for (int i = tip; i > 0 && beyond < kLookedAt; --i) {
      const double from = opening.normal.dot(wire.col(i - 1) - opening.center);
      const double to = opening.normal.dot(wire.col(i) - opening.center);
      const Vec3 edge = wire.col(i) - wire.col(i - 1);
      if (from <= 0.0 && to > 0.0) {
        const Vec3 pierced = wire.col(i) - to / (to - from) * edge;
        const double out = beyond + (wire.col(i) - pierced).norm();
        const double off = (pierced - opening.center).norm();
        if (out >= kBeyond && off < kOval * opening.radius) return static_cast<int>(k);
      }
      beyond += edge.norm();
    }
  }
  return std::nullopt;
}

}  // namespace wireplan::preprocess
