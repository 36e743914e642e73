// The abdomen of cases/abdomen with sizes, course and company drawn anew. Radii [mm] and where they
// come from (references, B4): aorta below the renals 8.5 to 11 (diameter 17 to 22), common iliac 4
// to 5.9 and external iliac 3.3 to 5.1 (95th percentile 11.8 and 10.3 in diameter), renal 2.4 to 3
// (5 to 6); mesenteric, coeliac, internal iliac and all veins are assumed. Renal arteries leave the
// aorta 50 to 90 degrees from its axis, the mesenteric 25 to 60 (both assumed).
#include <algorithm>
#include <cmath>

#include "preprocess/volume/random_anatomy.h"

namespace wireplan::preprocess {
namespace {

using enum PhantomTubeKind;

struct AbdomenSizes {
  double aorta, common, external, internal, renal, mesenteric, coeliac;
};

AbdomenSizes draw_sizes(Draws& draws) {
  AbdomenSizes sizes{};
  sizes.aorta = draws.between(8.5, 11.0);
  sizes.common = draws.between(4.0, 5.9);
  sizes.external = std::min(draws.between(3.3, 5.1), sizes.common);
  sizes.internal = draws.between(2.2, 3.3);
  sizes.renal = draws.between(2.4, 3.0);
  sizes.mesenteric = draws.between(2.9, 3.9);
  sizes.coeliac = draws.between(2.9, 3.9);
  return sizes;
}

/// Points of the right side, mirrored to the left where `side` is +1.
std::vector<Vec3> on_side(std::vector<Vec3> right, double side) {
  for (Vec3& p : right) p.x() *= -side;
  return right;
}

void add_aorta(const AbdomenSizes& r, Draws& draws, DrawnAnatomy& body) {
  std::vector<Vec3> points = {{3, 9, 190},  {3, 9, 170}, {3, 8.5, 142}, {4, 7, 118},
                              {5, 5.5, 94}, {7, 4, 74},  {8, 1.5, 56},  {8, -1, 39},
                              {7, -2, 22},  {5, -2, 7},  {4, -1, -2}};
  std::vector<double> radius;
  for (const Vec3& p : points)
    radius.push_back(r.aorta * (p.z() > 100.0 ? 1.1 : p.z() < 0.0 ? 0.9 : 1.0));
  PhantomTube aorta = with_points_every(
      tube_through("aorta", kArtery, draws.between(0.8, 1.4), points, radius), 5.0);
  if (draws.chance(0.34)) {
    body.features.emplace_back("aneurysm");
    const double at = draws.between(28.0, 48.0), half = draws.between(22.0, 34.0);
    const double lumen = draws.between(1.2, 1.9), lining = draws.between(2.0, 12.0);
    const Vec3 aside(draws.between(-0.5, 0.5), draws.between(-0.6, 0.1), 0.0);  // of the lining
    std::vector<Vec3> sac_points;
    std::vector<double> sac_radius;
    for (Eigen::Index i = 0; i < aorta.points.cols(); ++i) {
      const double u = (aorta.points(2, i) - at) / half;
      if (std::abs(u) >= 1.0) continue;
      const double bulge = std::pow(std::cos(0.5 * kPi * u), 2);
      const double wide = aorta.radius(i) * (1.0 + (lumen - 1.0) * bulge);
      aorta.points(1, i) -= 0.6 * (wide - aorta.radius(i)) + 0.5 * lining * bulge;  // off the spine
      aorta.radius(i) = wide;
      sac_points.emplace_back(aorta.points.col(i) + bulge * lining * aside);
      sac_radius.push_back(wide + bulge * lining);
    }
    PhantomTube sac = tube_through("sac", kThrombus, 1.0, sac_points, sac_radius);
    sac.hu = draws.between(40.0, 60.0);
    body.tubes.push_back(std::move(sac));
  }
  body.tubes.push_back(std::move(aorta));
}

/// Both limbs of the bifurcation; `kissing` is the gap of limbs that run side by side, or 0.
void add_iliacs(const AbdomenSizes& r, double kissing, Draws& draws, DrawnAnatomy& body) {
  const double wall = kissing > 0.0 ? 0.85 : draws.between(0.6, 1.1);
  const double half = r.common + 0.5 * kissing;
  const std::vector<Vec3> apart = {
      {-2, 0, 2}, {-9, -1, -13}, {-21, 4, -29}, {-32, 14, -44}, {-39, 22, -56}};
  const std::vector<Vec3> beside = {{-half, 0, 3},   {-half, -1, -8},         {-half, -1, -17},
                                    {-half, 0, -24}, {-half - 0.7, 1.5, -28}, {-half - 5, 4.5, -34},
                                    {-29, 13, -43},  {-39, 22, -56}};
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "right" : "left";
    std::vector<Vec3> common = on_side(kissing > 0.0 ? beside : apart, side);
    for (Vec3& p : common)
      p.x() += std::max(0.0, 4.0 * (1.0 + p.z() / 56.0));  // from the aorta's end
    body.tubes.push_back(tube_through(name + "-common-iliac", kArtery, wall, common,
                                      std::vector<double>(common.size(), r.common)));
    const std::vector<Vec3> external = on_side({{-32, 14, -44},
                                                {-39, 22, -56},
                                                {-48, 22, -69},
                                                {-55, 11, -84},
                                                {-58, -6, -98},
                                                {-61, -21, -112},
                                                {-69, -30, -127},
                                                {-73, -37, -142},
                                                {-74, -41, -162},
                                                {-74, -43, -180}},
                                               side);
    const double taper = std::min(r.common, 1.08 * r.external);
    body.tubes.push_back(tube_through(name + "-external-iliac", kArtery, wall, external,
                                      {taper, taper, r.external, r.external, r.external, r.external,
                                       r.external, r.external, r.external, r.external}));
    const std::vector<Vec3> internal =
        on_side({{-36, 18, -50}, {-41, 28, -62}, {-45, 40, -77}, {-48, 51, -92}}, side);
    body.tubes.push_back(
        tube_through(name + "-internal-iliac", kArtery, 0.7, internal,
                     {r.internal, r.internal, 0.9 * r.internal, 0.8 * r.internal}));
  }
}

void add_visceral(const AbdomenSizes& r, Draws& draws, DrawnAnatomy& body) {
  const double drop = draws.between(-12.0, 6.0), fall = draws.between(0.0, 16.0);
  const double wall = draws.between(0.5, 0.9);
  const auto constant = [](std::size_t count, double radius) {
    return std::vector<double>(count, radius);
  };
  body.tubes.push_back(tube_through("right-renal", kArtery, wall,
                                    {{5.5, 6, 90},
                                     {-7, 11, 89 + 0.1 * drop},
                                     {-19, 15, 87 + 0.4 * drop},
                                     {-36, 22, 83 + 0.8 * drop},
                                     {-56, 26, 76 + drop}},
                                    constant(5, r.renal)));
  body.tubes.push_back(tube_through("left-renal", kArtery, wall,
                                    {{6, 5.5, 86.5},
                                     {19, 8, 86 + 0.1 * drop},
                                     {31, 16, 84 + 0.4 * drop},
                                     {44, 22, 82 + 0.8 * drop},
                                     {60, 25, 78 + drop}},
                                    constant(5, r.renal)));
  body.tubes.push_back(
      tube_through("mesenteric", kArtery, wall,
                   {{4.5, 5, 110},
                    {5, -8, 108.5},
                    {6, -18 - 0.3 * fall, 102},
                    {6.5, -23 - 0.5 * fall, 88},
                    {5, -26 - 0.5 * fall, 66},
                    {2, -28 - 0.5 * fall, 44},
                    {-4, -30 - 0.5 * fall, 22},
                    {-10, -33 - 0.5 * fall, 4}},
                   {r.mesenteric, r.mesenteric, r.mesenteric, r.mesenteric, 0.97 * r.mesenteric,
                    0.9 * r.mesenteric, 0.8 * r.mesenteric, 0.7 * r.mesenteric}));
  body.tubes.push_back(tube_through("coeliac", kArtery, wall,
                                    {{4, 6, 124}, {4, -8, 124.5}, {5, -16, 122}, {6, -24, 122}},
                                    constant(4, r.coeliac)));
  body.tubes.push_back(tube_through("splenic", kArtery, wall,
                                    {{5.5, -20, 122},
                                     {16, -28, 126},
                                     {30, -18, 122},
                                     {42, -10, 129},
                                     {56, 2, 125},
                                     {70, 14, 132}},
                                    constant(6, 0.8 * r.coeliac)));
  body.tubes.push_back(tube_through(
      "hepatic", kArtery, wall, {{5.5, -20, 122}, {-6, -31, 121}, {-20, -35, 122}, {-36, -36, 130}},
      constant(4, 0.75 * r.coeliac)));
}

void add_veins(const DrawnScan& scan, Draws& draws, DrawnAnatomy& body) {
  const auto gap = [&] { return draws.between(0.0, 1.0); };
  const double base = draws.between(0.5, 0.95);
  const auto add = [&](PhantomTube vein) { add_vein(std::move(vein), base, scan, draws, body); };
  const PhantomTube aorta = body.tube("aorta");
  PhantomTube beside = aorta;
  if (std::any_of(body.tubes.begin(), body.tubes.end(),
                  [](const PhantomTube& one) { return one.name == "sac"; })) {
    // Round the sac: as wide as it, where there is one.
    const PhantomTube& sac = body.tube("sac");
    for (Eigen::Index i = 0; i < beside.points.cols(); ++i) {
      for (Eigen::Index k = 0; k < sac.points.cols(); ++k) {
        if (std::abs(sac.points(2, k) - beside.points(2, i)) > 2.5) continue;
        beside.radius(i) = std::max(beside.radius(i), sac.radius(k));
      }
    }
  }
  const double cava = draws.between(8.0, 11.0), iliac = draws.between(4.5, 6.5);
  add(vein_beside("cava", beside, 0.05, 0.99, {-1.0, 0.2, 0.0}, cava, gap()));
  const Vec3 confluence = body.tubes.back().points.col(body.tubes.back().points.cols() - 1);
  const Vec3 trunk = body.tubes.back().points.col(5);  // half way down
  for (const char* side : {"right", "left"}) {
    const std::string artery = std::string(side) + "-external-iliac";
    const Vec3 inward(side[0] == 'r' ? 1.0 : -1.0, 0.5, 0.0);
    PhantomTube vein = vein_beside(std::string(side) + "-iliac-vein", body.tube(artery), 0.1, 0.98,
                                   inward, iliac, gap());
    std::vector<Vec3> points = {confluence,
                                0.5 * (confluence + vein.points.col(0)) + Vec3(0, 3, 0)};
    for (Eigen::Index i = 0; i < vein.points.cols(); ++i) points.emplace_back(vein.points.col(i));
    add(tube_through(vein.name, kVein, vein.wall_mm, points,
                     std::vector<double>(points.size(), iliac)));
  }
  // The left renal vein crosses in front of the aorta, between it and the mesenteric artery.
  const double renal = draws.between(3.2, 4.5);
  Eigen::Index level = 0;
  (aorta.points.row(2).array() - 96.0).abs().minCoeff(&level);
  const Vec3 front =
      aorta.points.col(level) - Vec3(0.0, aorta.radius(level) + aorta.wall_mm + renal + gap(), 0.0);
  add(tube_through("left-renal-vein", kVein, 0.4,
                   {{56, 17, 84},
                    {38, 3, 89},
                    front + Vec3(14, 3, -2),
                    front,
                    front + Vec3(-12, 3, 0),
                    {trunk.x(), trunk.y(), front.z() - 2.0}},
                   std::vector<double>(6, renal)));
  add(vein_beside("right-renal-vein", body.tube("right-renal"), 0.3, 0.95, {0.0, -1.0, 0.3}, renal,
                  gap()));
  const double portal = draws.between(4.5, 6.0);
  PhantomTube vein = vein_beside("portal-vein", body.tube("mesenteric"), 0.97, 0.35,
                                 {-1.0, 0.0, 0.0}, portal, gap());
  std::vector<Vec3> points;
  for (Eigen::Index i = 0; i < vein.points.cols(); ++i) points.emplace_back(vein.points.col(i));
  points.insert(points.end(), {{-16, -28, 110}, {-34, -26, 122}, {-52, -26, 134}});
  add(tube_through("portal-vein", kVein, 0.4, points, std::vector<double>(points.size(), portal)));
}

PhantomEllipsoid ellipsoid(const char* name, double hu, const Vec3& center, const Vec3& semi_axes,
                           double shell_mm = 0.0) {
  return {.name = name, .hu = hu, .center = center, .semi_axes = semi_axes, .shell_mm = shell_mm};
}

void add_organs(const DrawnScan& scan, Draws& draws, DrawnAnatomy& body) {
  const double arterial = scan.arterial_hu();
  const auto hu = [&](double plain) {
    return scan.organs ? draws.between(0.5, 1.0) * arterial : plain;
  };
  const double kidney = hu(120.0), spleen = hu(90.0);
  const double liver = scan.organs ? std::min(draws.between(0.5, 0.9) * arterial, 150.0) : 75.0;
  body.organs = {ellipsoid("abdominal fat", -100.0, {0, -10, 30}, {106, 66, 190}),
                 ellipsoid("liver", liver, {-62, -22, 158}, {58, 56, 72}),
                 ellipsoid("spleen", spleen, {88, 26, 146}, {24, 42, 36}),
                 ellipsoid("stomach", 40.0, {44, -44, 132}, {38, 22, 34}),
                 ellipsoid("gas in the stomach", -900.0, {44, -56, 136}, {24, 8, 20}),
                 ellipsoid("right kidney", kidney, {-64, 34, 70}, {25, 21, 50}),
                 ellipsoid("right renal sinus", -90.0, {-47, 26, 73}, {17, 8, 15}),
                 ellipsoid("left kidney", kidney, {68, 32, 78}, {25, 21, 51}),
                 ellipsoid("left renal sinus", -90.0, {51, 24, 80}, {17, 8, 15}),
                 ellipsoid("bladder", 10.0, {0, -32, -148}, {36, 28, 28}),
                 ellipsoid("sacrum", 230.0, {0, 58, -82}, {43, 16, 42}, 1.5)};
  for (const double side : {-1.0, 1.0}) {
    body.organs.push_back(ellipsoid("iliac wing", 240.0, {side * 92, 22, -64}, {8, 56, 52}, 1.8));
    body.organs.push_back(ellipsoid("acetabulum", 240.0, {side * 96, 18, -138}, {28, 33, 34}, 1.8));
    body.organs.push_back(ellipsoid("pubic ramus", 220.0, {side * 44, -20, -166}, {40, 9, 9}, 1.5));
  }
  for (int k = 0; k < 7; ++k) {
    body.vertebrae.push_back(
        {.center = {0.0, 33.0 + 0.0006 * std::pow(36.0 * k - 90.0, 2), 182.0 - 36.0 * k},
         .semi_axes = {22.0, 15.5, 13.5},
         .core_hu = draws.between(150.0, 300.0)});
  }
  PhantomTube discs =
      tube_through("discs", kTissue, 0.0, {{0, 38, 200}, {0, 34, 110}, {0, 33, 38}, {0, 38, -52}},
                   {14.5, 14.5, 14.5, 14.0});
  discs.hu = 85.0;
  body.tubes.push_back(std::move(discs));
  for (const double side : {-1.0, 1.0}) {
    PhantomTube psoas = tube_through(side < 0.0 ? "right-psoas" : "left-psoas", kTissue, 0.0,
                                     on_side({{-27, 40, 120},
                                              {-34, 38, 70},
                                              {-42, 36, 20},
                                              {-54, 32, -30},
                                              {-70, 20, -75},
                                              {-86, 0, -115},
                                              {-92, -18, -165}},
                                             side),
                                     {6, 13, 15, 15, 14, 14, 12});
    psoas.hu = 60.0;
    body.tubes.push_back(std::move(psoas));
  }
  PhantomTube bowel = tube_through("small-bowel", kTissue, 0.0,
                                   {{60, -46, 76},
                                    {20, -60, 66},
                                    {-25, -60, 72},
                                    {-58, -46, 56},
                                    {-30, -60, 40},
                                    {15, -60, 44},
                                    {56, -48, 34},
                                    {60, -42, 4},
                                    {20, -58, 10},
                                    {-20, -60, 12},
                                    {-56, -44, 4},
                                    {-48, -42, -28},
                                    {-10, -54, -24},
                                    {36, -52, -26}},
                                   std::vector<double>(14, 11.0));
  bowel.hu = draws.between(25.0, 60.0);
  body.tubes.push_back(std::move(bowel));
}

void choose_way(const DrawnScan& scan, const AbdomenSizes& r, Draws& draws, DrawnAnatomy& body) {
  const std::string side = draws.chance(0.5) ? "left" : "right";
  // A volume of thin slices reaches less far down.
  const bool low = scan.slice_mm > 0.8 && draws.chance(0.75);
  if (low) body.way.push_back(side + "-external-iliac");
  body.way.push_back(side + "-common-iliac");
  body.way.emplace_back("aorta");
  body.access_name = low ? side + " external iliac" : side + " common iliac";
  body.access_at = low ? draws.between(0.45, 0.85) : draws.between(0.7, 0.9);
  // A branch across the slices is sought in slices thinner than its radius alone.
  const bool renal = scan.slice_mm < 0.8 * r.renal, mesenteric = scan.slice_mm < r.mesenteric;
  const int choice = draws.index(10);
  if (choice < 5 && renal) {
    const std::string kidney = draws.chance(0.5) ? "left" : "right";
    body.way.push_back(kidney + "-renal");
    body.target_name = kidney + " renal";
    body.target_at = draws.between(0.45, 0.75);
  } else if (choice < 8 && mesenteric) {
    body.way.emplace_back("mesenteric");
    body.target_name = "mesenteric";
    body.target_at = draws.between(0.2, 0.6);
  } else {
    body.target_name = "upper aorta";
    body.target_at = draws.between(0.24, 0.4);
  }
  body.stentable = {body.way.begin(), body.way.end() - (body.way.back() == "aorta" ? 0 : 1)};
}

}  // namespace

DrawnAnatomy draw_abdomen(Draws& draws, const DrawnScan& scan) {
  DrawnAnatomy body;
  body.body_semi_axes = {152.0, 104.0, 1000.0};
  const AbdomenSizes sizes = draw_sizes(draws);
  add_organs(scan, draws, body);
  add_aorta(sizes, draws, body);
  const bool kissing = draws.chance(0.3), side_by_side = kissing && draws.chance(0.5);
  const double gap = draws.between(0.3, 1.0);
  add_iliacs(sizes, side_by_side ? gap : 0.0, draws, body);
  add_visceral(sizes, draws, body);
  choose_way(scan, sizes, draws, body);
  const bool bends = draws.chance(0.5);
  const double amplitude = draws.between(5.0, 12.0), waves = draws.between(1.0, 1.9);
  if (bends && !kissing) {
    for (const char* side : {"right", "left"}) {
      add_bends(body.tube(std::string(side) + "-external-iliac"), amplitude, waves,
                {1.0, 0.3, 0.0});
    }
    body.features.emplace_back("bends");
  }
  body.level.assign(body.tubes.size(), 0.0);
  add_veins(scan, draws, body);
  if (kissing) {
    PhantomTube& first = body.tube(body.way.front());
    // Slices would not show a thin artery that lies in them.
    const bool external = first.name.find("external") != std::string::npos && scan.slice_mm <= 3.0;
    if (!side_by_side && external) {
      body.loops.push_back({first.name, {first.points(0, 0) < 0.0 ? 1.0 : -1.0, -1.0, 0.3}, gap});
      body.access_at = draws.between(0.82, 0.92);
    }
    if (side_by_side || external) body.features.emplace_back("kissing limbs");
  }
  return body;
}

}  // namespace wireplan::preprocess
