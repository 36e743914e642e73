#pragma once
/// What anatomies drawn at random share; for use in this folder.
#include <random>
#include <string>
#include <vector>

#include "preprocess/volume/phantom.h"

namespace wireplan::preprocess {

/// Numbers from a seed, the same with every standard library.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : generator_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  bool chance(double share) { return between(0.0, 1.0) < share; }
  /// From 0 to before `count`.
  int index(int count) { return static_cast<int>(between(0.0, count)); }
  double sign() { return chance(0.5) ? 1.0 : -1.0; }

 private:
  std::mt19937_64 generator_;
};

/// How the patient was scanned.
struct DrawnScan {
  double spacing_mm = 0.7, slice_mm = 1.0;
  double noise_hu = 20.0, blur_mm = 0.5, texture_mm = 0.6;
  double contrast_hu = 300.0;  // over blood, at the access
  double fall = 0.2;           // of the contrast, from access to target
  bool veins = false;          // have contrast
  bool organs = false;         // are nearly as bright as arteries
  double arterial_hu() const;  // half way
};

inline constexpr double kBloodHu = 40.0;  // without contrast: 30 to 60 (references, B5)

/// A loop to be put into an artery, see add_kissing_loop.
struct DrawnLoop {
  std::string tube;
  Vec3 side = Vec3::UnitX();
  double gap = 0.5;
};

/// An anatomy before it is scanned.
struct DrawnAnatomy {
  std::vector<PhantomTube> tubes;
  std::vector<double> level;  // of each tube: its HU over the arteries' there; 0: the tube's own
  std::vector<PhantomEllipsoid> organs;
  std::vector<PhantomVertebra> vertebrae;
  Vec3 body_center = Vec3::Zero(), body_semi_axes = Vec3::Ones();
  std::vector<std::string> way;  // arteries from access to target
  std::string access_name, target_name;
  double access_at = 0.5, target_at = 0.5;  // fractions of the way's first and last artery
  std::vector<std::string> stentable;       // arteries on the way that a stent may lie in
  std::vector<std::string> features;
  std::vector<DrawnLoop> loops;

  PhantomTube& tube(const std::string& name);
};

DrawnAnatomy draw_abdomen(Draws& draws, const DrawnScan& scan);
DrawnAnatomy draw_arch(Draws& draws, const DrawnScan& scan);

/// A tube through the points.
PhantomTube tube_through(const std::string& name, PhantomTubeKind kind, double wall_mm,
                         const std::vector<Vec3>& points, const std::vector<double>& radius);

/// The same tube with a control point about every `spacing`.
PhantomTube with_points_every(const PhantomTube& tube, double spacing);

/// A vein beside an artery: toward `side` made normal to it, `gap` outside of its wall.
PhantomTube vein_beside(const std::string& name, const PhantomTube& artery, double from, double to,
                        const Vec3& side, double radius, double gap);

/// Adds a vein; where veins have contrast, of about `level` of the arteries', 0.5 to 0.95.
void add_vein(PhantomTube vein, double level, const DrawnScan& scan, Draws& draws,
              DrawnAnatomy& body);

inline constexpr const char* kThyroid = "thyroid";  // either lobe

/// Moves veins and the lobes of the thyroid off arteries and their thrombus, so that lumens overlap
/// by no more than half the radius of the thinner, and lobes by half the artery's: an artery dents
/// what it presses on, and never runs inside of it.
void press_aside(DrawnAnatomy& body);

/// Bends part of a tube to either side of its course: by a sine of this amplitude across it that is
/// zero at both ends.
void add_bends(PhantomTube& tube, double amplitude, double waves, const Vec3& across);

/// A loop with limbs that come back to within `gap` of each other, lumen to lumen, in the middle of
/// a tube and out to the side.
void add_kissing_loop(PhantomTube& tube, const Vec3& side, double gap);

/// Narrows a tube to a share of its radius at a fraction of its length.
void add_stenosis(PhantomTube& tube, double at, double half_length, double share);

/// Moves everything by the same smooth bends of the whole body, which keep what touches touching.
void bend_all(DrawnAnatomy& anatomy, Draws& draws);

}  // namespace wireplan::preprocess
