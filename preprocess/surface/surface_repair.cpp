#include "preprocess/surface/surface_repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "preprocess/surface/cgal_calls.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_mend.h"
#include "preprocess/surface/triangle_sides.h"

namespace wireplan::preprocess {
namespace {

// Of two closed pieces, one in the other, the inner one is the lumen if it holds this part of the
// outer's volume: the two are the skins of a wall. A smaller one is a cavity or a crumb.
constexpr double kInnerSkin = 0.2;
constexpr double kSkinLength = 0.8;  // of the other skin's
// Pieces of less than this part of the largest's area are crumbs.
constexpr double kCrumb = 0.05;
// A vessel's area is more than this part of its length squared: 600 times that at 1 m and 0.1 mm.
constexpr double kLeastArea = 1e-6;
constexpr int kShortest = 1, kLongest = 5000;  // of what may be a vessel               [mm]

Vec3 middle_of(const Surface& s) {
  return 0.5 * (s.vertices.rowwise().minCoeff() + s.vertices.rowwise().maxCoeff());
}

double length_of(const Surface& s) {
  return (s.vertices.rowwise().maxCoeff() - s.vertices.rowwise().minCoeff()).maxCoeff();
}

double area_of(const Surface& s) {
  double area = 0.0;
  for (const auto& t : s.triangles.colwise()) {
    const Vec3 a = s.vertices.col(t(0)), b = s.vertices.col(t(1)), c = s.vertices.col(t(2));
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

Mend dropped_piece(const Surface& piece) {
  return {.kind = MendKind::kPiece,
          .count = static_cast<int>(piece.triangles.cols()),
          .place = middle_of(piece),
          .size = length_of(piece)};
}

Mend turned_piece(const Surface& piece) {
  return {.kind = MendKind::kInward,
          .count = static_cast<int>(piece.triangles.cols()),
          .place = middle_of(piece)};
}

/// Points spread evenly over a surface's area, at most so many [mm]. The golden section steps
/// through the triangles, so that no order in which a program writes them falls into step with it.
std::vector<Vec3> spread_points(const Surface& surface, int count) {
  constexpr double kGolden = 0.6180339887498949;
  std::vector<double> area_up_to;
  double area = 0.0;
  for (const auto& t : surface.triangles.colwise()) {
    const Vec3 a = surface.vertices.col(t(0)), b = surface.vertices.col(t(1)),
               c = surface.vertices.col(t(2));
    area_up_to.push_back(area += 0.5 * (b - a).cross(c - a).norm());
  }
  std::vector<Vec3> points;
  for (int k = 0; k < std::min(count, static_cast<int>(surface.triangles.cols())); ++k) {
    const double at = area * std::fmod(kGolden * (k + 0.5), 1.0);
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end() - 1, at);
    const Eigen::Vector3i t = surface.triangles.col(found - area_up_to.begin());
    points.emplace_back(surface.vertices(Eigen::all, t).rowwise().mean());
  }
  return points;
}

/// Whether a piece lies inside a closed surface, and how far from its wall in the median.
InsideAnswer locate_piece(const Surface& piece, const Surface& closed) {
  constexpr int kSamples = 60;
  int inside = 0;
  std::vector<double> distances;
  for (const Vec3& point : spread_points(piece, kSamples)) {
    const InsideAnswer answer = locate_point(closed, point);
    inside += answer.inside ? 1 : 0;
    distances.push_back(answer.distance);
  }
  return {.inside = 10 * inside >= 9 * static_cast<int>(distances.size()),
          .distance = median(distances)};
}

void require_length(const Surface& s, const std::string& origin) {
  const double length = length_of(s);
  if (length >= kShortest && length <= kLongest) return;
  throw Error(origin + ": the surface is " + number_text(length) +
              " mm long in the unit stated, expected " + std::to_string(kShortest) + " to " +
              std::to_string(kLongest) + " mm; correct the unit (mm, cm or m)");
}

void require_area(const Surface& s, const std::string& origin) {
  if (area_of(s) > kLeastArea * std::pow(length_of(s), 2.0)) return;
  throw Error(origin + ": the triangles near " + place_text(middle_of(s)) +
              " mm enclose nothing, expected the wall of a vessel; export the surface again");
}

/// The triangles whose boxes come near the box of another surface.
Surface part_near(const Surface& surface, const Surface& other) {
  const Vec3 low = other.vertices.rowwise().minCoeff(), high = other.vertices.rowwise().maxCoeff();
  Surface part{.vertices = surface.vertices, .triangles = {}};
  std::vector<Eigen::Index> near;
  for (Eigen::Index m = 0; m < surface.triangles.cols(); ++m) {
    const Eigen::Matrix3d corners = surface.vertices(Eigen::all, surface.triangles.col(m));
    if ((corners.rowwise().maxCoeff().array() >= low.array()).all() &&
        (corners.rowwise().minCoeff().array() <= high.array()).all()) {
      near.push_back(m);
    }
  }
  part.triangles = surface.triangles(Eigen::all, near);
  return part;
}

/// Whether a triangle of one cuts a triangle of the other.
bool cut_each_other(const Surface& a, const Surface& b) {
  const Surface near = part_near(a, b);
  const Eigen::Index first = near.triangles.cols(), shift = near.vertices.cols();
  if (first == 0) return false;
  Surface both;
  both.vertices.resize(3, shift + b.vertices.cols());
  both.vertices << near.vertices, b.vertices;
  both.triangles.resize(3, first + b.triangles.cols());
  both.triangles << near.triangles, (b.triangles.array() + static_cast<int>(shift)).matrix();
  for (const auto& [one, other] : cutting_pairs(both)) {
    if ((one < first) != (other < first)) return true;
  }
  return false;
}

/// The vessel with a closed piece that overlaps it.
Surface unite(const Surface& vessel, const Surface& closed, const std::string& origin,
              std::vector<Mend>& mends) {
  std::optional<Surface> united = union_of(largest_piece(vessel), closed);
  if (!united) {
    throw Error(origin + ": a closed piece of the surface, " + number_text(length_of(closed)) +
                " mm long round " + place_text(middle_of(closed)) +
                " mm, overlaps the vessel, and the two cannot be united here; unite them in the "
                "program that made them, and export one surface");
  }
  mends.push_back({.kind = MendKind::kUnited,
                   .count = static_cast<int>(closed.triangles.cols()),
                   .place = middle_of(closed),
                   .size = length_of(closed)});
  return std::move(*united);
}

/// The vessel, put together from closed or open pieces.
class Assembly {
 public:
  Assembly(const std::vector<Piece>& pieces, const std::string& origin, std::vector<Mend>& mends)
      : origin_(origin), mends_(mends), largest_(area_of(pieces.front().surface)) {
    if (pieces.front().turned) mends_.push_back(turned_piece(pieces.front().surface));
    require_area(pieces.front().surface, origin_);
    vessel_ = close_openings(pieces.front().surface, origin_, mends_);
    for (std::size_t k = 1; k < pieces.size(); ++k) left_.push_back(&pieces[k].surface);
  }

  /// Takes what belongs to the vessel, the largest first. A piece may overlap a smaller one alone,
  /// so those that are left are looked at again.
  void take_pieces() {
    for (std::size_t before = left_.size() + 1; left_.size() < before;) {
      before = left_.size();
      left_.erase(std::remove_if(left_.begin(), left_.end(),
                                 [&](const Surface* piece) { return take(*piece); }),
                  left_.end());
    }
  }

  Surface vessel() const { return largest_piece(vessel_); }
  const std::vector<const Surface*>& left() const { return left_; }

 private:
  /// Whether the piece is united with the vessel, or takes its place: an inner skin of a wall.
  bool take(const Surface& piece) {
    const bool cuts = cut_each_other(vessel_, piece);
    const InsideAnswer there =
        area_of(piece) < kCrumb * largest_ ? InsideAnswer{} : locate_piece(piece, vessel_);
    // A skin that touches the other is as long as that; a branch whose root is deep is not.
    if (there.inside && (!cuts || length_of(piece) > kSkinLength * length_of(vessel_))) {
      std::vector<Mend> of_piece;
      Surface inner = largest_piece(close_openings(piece, origin_, of_piece));
      if (signed_volume(inner) >= kInnerSkin * std::abs(signed_volume(vessel_))) {
        mends_ = std::move(of_piece);  // what was mended on the outer skin does not matter
        mends_.push_back({.kind = MendKind::kOuterSkin,
                          .count = static_cast<int>(vessel_.triangles.cols()),
                          .place = middle_of(vessel_),
                          .size = there.distance});
        vessel_ = std::move(inner);
        return true;
      }
    }
    if (!cuts || check_surface(piece).open_edges > 0) return false;
    vessel_ = unite(vessel_, piece, origin_, mends_);
    return true;
  }

  const std::string& origin_;
  std::vector<Mend>& mends_;
  double largest_;  // area of the largest piece                                       [mm^2]
  Surface vessel_;
  std::vector<const Surface*> left_;
};

/// The vessel among closed or open pieces: the largest, closed, with what overlaps it; or a piece
/// within it that is the inner skin of its wall.
Surface choose_piece(const std::vector<Piece>& pieces, const std::string& origin,
                     std::vector<Mend>& mends, std::vector<Surface>& dropped) {
  Assembly assembly(pieces, origin, mends);
  assembly.take_pieces();
  for (const Surface* piece : assembly.left()) {
    mends.push_back(dropped_piece(*piece));
    dropped.push_back(*piece);
  }
  return assembly.vessel();
}

struct Wording {
  const char *name, *one, *many, *size;
};

/// In the order of MendKind.
constexpr std::array<Wording, 13> kWordings = {{
    {"duplicate triangles", "triangle that was there twice dropped",
     "triangles that were there twice dropped", "wide"},
    {"degenerate triangles", "triangle without area dropped", "triangles without area dropped",
     "wide"},
    {"turned triangles", "triangle turned whose normal disagreed with its neighbours'",
     "triangles turned whose normals disagreed with their neighbours'", ""},
    {"inward normals", "triangle turned outward, since its normal pointed into the vessel",
     "triangles, all of them, turned outward, since their normals pointed into the vessel", ""},
    {"hanging sheet", "sheet of triangles dropped that hung on the wall or divided the lumen",
     "sheets of triangles dropped that hung on the wall or divided the lumen", "wide"},
    {"contact", "vertex parted where the wall touched itself",
     "vertices parted where the wall touched itself", "apart"},
    {"tangle", "tangle of more than two sheets at an edge cut out",
     "tangles of more than two sheets at an edge cut out", "wide"},
    {"hole", "hole closed", "holes closed", "wide"},
    {"open end", "open end capped", "open ends capped", "wide"},
    {"other piece", "other piece dropped", "other pieces dropped", "long"},
    {"overlapping piece", "closed piece that overlaps the vessel united with it",
     "closed pieces that overlap the vessel united with it", "long"},
    {"outer skin",
     "wall with two skins found: its inner skin is taken as the lumen, the outer one dropped",
     "walls with two skins found: the inner skin is taken as the lumen, the outer ones dropped",
     "thick"},
    {"cutting triangles", "triangle made anew that cut another one",
     "triangles made anew that cut each other", ""},
}};

/// Whether a mend's own count is how many there are of its kind; else it is one, of so many
/// triangles or edges.
bool counts_triangles(MendKind kind) {
  return kind == MendKind::kDuplicate || kind == MendKind::kDegenerate ||
         kind == MendKind::kTurned || kind == MendKind::kInward || kind == MendKind::kContact ||
         kind == MendKind::kIntersection;
}

}  // namespace

std::string name_of(MendKind kind) { return kWordings.at(static_cast<std::size_t>(kind)).name; }

std::vector<std::string> tell_mends(const std::vector<Mend>& mends) {
  constexpr int kPlacesTold = 6;
  std::vector<std::string> lines;
  for (std::size_t k = 0; k < kWordings.size(); ++k) {
    const Wording& wording = kWordings[k];
    int count = 0, told = 0;
    std::string places;
    for (const Mend& mend : mends) {
      if (mend.kind != static_cast<MendKind>(k)) continue;
      count += counts_triangles(mend.kind) ? mend.count : 1;
      if (++told > kPlacesTold) continue;
      places += (told == 1 ? ": " : "; ");
      if (mend.size > 0.0 && *wording.size != '\0') {
        places += number_text(mend.size) + " mm " + wording.size + " ";
      }
      places += "at " + place_text(mend.place);
    }
    if (count == 0) continue;
    lines.push_back(std::to_string(count) + " " + (count == 1 ? wording.one : wording.many) +
                    places + " mm" + (told > kPlacesTold ? " and elsewhere" : ""));
  }
  return lines;
}

std::string tell_dropped(const std::vector<Surface>& dropped, const Surface& vessel,
                         const Vec3& point) {
  constexpr int kSamples = 500;  // to see where it comes near
  for (const Surface& piece : dropped) {
    if (!locate_point(piece, point).inside) continue;
    double apart = std::numeric_limits<double>::infinity();
    Vec3 nearest = point;
    for (const Vec3& place : spread_points(piece, kSamples)) {
      const InsideAnswer answer = locate_point(vessel, place);
      if (answer.distance >= apart) continue;
      apart = answer.distance;
      nearest = place;
    }
    return "lies in a piece of the surface, " + number_text(length_of(piece)) +
           " mm long, that is not joined with the vessel and was dropped: it comes within " +
           number_text(apart) + " mm at " + place_text(nearest) +
           " mm; join the two there in the program that made them, or delete the piece that is "
           "not meant";
  }
  return "";
}

RepairedSurface read_surface(const std::filesystem::path& path, const std::string& unit,
                             const std::string& frame) {
  return repair_surface(read_triangles(path, unit, frame), path.string());
}

RepairedSurface read_sound_surface(const std::filesystem::path& path, const std::string& unit,
                                   const std::string& frame) {
  RepairedSurface repaired = read_surface(path, unit, frame);
  require_sound(check_surface(repaired.surface), path.string());
  return repaired;
}

RepairedSurface repair_surface(const Surface& triangles, const std::string& origin) {
  expects(triangles.triangles.cols() > 0);
  require_length(triangles, origin);
  RepairedSurface repaired;
  std::vector<Mend>& mends = repaired.mends;
  const Surface manifold = make_manifold(triangles, origin, mends);
  Surface vessel = choose_piece(pieces_of(manifold), origin, mends, repaired.dropped);

  // A wall with two skins that hang together: the inner one, closed again.
  Surface skin = inner_skin(vessel, mends);
  if (skin.triangles.cols() < vessel.triangles.cols()) {
    vessel = choose_piece(pieces_of(skin), origin, mends, repaired.dropped);
  }
  repaired.surface = without_intersections(vessel, mends);
  return repaired;
}

}  // namespace wireplan::preprocess
