// The arch of the aorta with what leaves it upward. Radii [mm] and where they come from
// (references, B4): descending aorta 11.5 to 14 (diameter 23 to 28), common carotid 3 to 3.5 (6 to
// 7), internal carotid 2.5 to 3 with a bulb of 3.3 to 4.3 (5 to 6; 7.59 +- 1.0), external 2 to 2.5
// (4 to 5), vertebral 1.75 to 2.1 (3.5 to 4.2), subclavian 3.1 to 4.5 (6.2 at its end; its
// beginning assumed); ascending aorta, brachiocephalic trunk and all veins are assumed. The arch
// rises up to 18 mm above where its branches leave (types I to III; assumed).
#include <algorithm>
#include <cmath>

#include "preprocess/volume/random_anatomy.h"

namespace wireplan::preprocess {
namespace {

std::vector<double> same(std::size_t count, double radius) {
  return std::vector<double>(count, radius);
}

void add_arteries(Draws& draws, DrawnAnatomy& body) {
  const auto artery = [&](const char* name, double wall, const std::vector<Vec3>& points,
                          const std::vector<double>& radius) {
    body.tubes.push_back(tube_through(name, PhantomTubeKind::kArtery, wall, points, radius));
  };
  const double d = draws.between(11.5, 14.0), wall = draws.between(0.5, 0.8);
  const double rise = draws.between(0.0, 18.0), trunk = draws.between(5.0, 6.5);
  artery("aorta", draws.between(1.0, 1.6),
         {{-22, -28, -95},
          {-23, -29, -70},
          {-24, -30, -40},
          {-22, -26, -10},
          {-14, -18, 12},
          {-2, -6, 22 + 0.6 * rise},
          {10, 8, 20 + rise},
          {19, 20, 6 + 0.5 * rise},
          {23, 28, -20},
          {23, 32, -60},
          {21, 34, -100},
          {19, 35, -150},
          {18, 35, -175}},
         {1.25 * d, 1.25 * d, 1.25 * d, 1.2 * d, 1.15 * d, 1.08 * d, 1.04 * d, d, d, d, d, 0.97 * d,
          0.96 * d});
  const Vec3 up(0.0, 0.0, rise);
  artery("brachiocephalic", 1.0, {{-12, -16, 10}, {-14, -20, 30}, {-20, -24, 49}}, same(3, trunk));
  const double common = draws.between(3.0, 3.5), internal = draws.between(2.5, 3.0);
  const double bulb = std::max(draws.between(3.3, 4.3), common), external = draws.between(2.0, 2.5);
  const std::vector<double> widening = {common, common, common, common, 0.5 * (common + bulb)};
  artery("right-carotid", wall,
         {{-19, -23, 45}, {-24, -22, 65}, {-28, -14, 95}, {-30, -8, 125}, {-30, -6, 147}},
         widening);
  artery("left-carotid", wall,
         {Vec3(-2, -7, 18) + 0.6 * up,
          Vec3(1, -10, 42) + 0.4 * up,
          {8, -14, 68},
          {20, -12, 95},
          {26, -8, 125},
          {27, -6, 147}},
         {common, common, common, common, common, 0.5 * (common + bulb)});
  for (const double side : {-1.0, 1.0}) {
    const double x = side < 0.0 ? 30.0 : 27.0;
    artery(side < 0.0 ? "right-internal" : "left-internal", wall,
           {{side * x, -6, 145},
            {side * (x + 2), -3, 156},
            {side * (x + 3), 0, 172},
            {side * (x + 1), 2, 192},
            {side * x, 3, 220}},
           {0.5 * (common + bulb), bulb, internal, internal, internal});
    artery(side < 0.0 ? "right-external" : "left-external", wall,
           {{side * (x - 0.5), -6.5, 146},
            {side * (x - 3), -12, 157},
            {side * (x - 4), -18, 172},
            {side * (x - 3), -20, 195}},
           {external, external, 0.95 * external, 0.9 * external});
  }
  const double subclavian = draws.between(3.6, 4.5), vertebral = draws.between(1.75, 2.1);
  artery("right-subclavian", wall,
         {{-20, -24, 46}, {-32, -20, 60}, {-48, -14, 66}, {-70, -6, 62}, {-95, -2, 50}},
         {subclavian, subclavian, 0.9 * subclavian, 0.85 * subclavian, 0.8 * subclavian});
  artery(
      "left-subclavian", wall,
      {Vec3(10, 7, 17) + up,
       Vec3(13, 8, 42) + 0.6 * up,
       {20, 8, 64},
       {36, 4, 74},
       {60, 0, 70},
       {95, -2, 50}},
      {subclavian, subclavian, subclavian, 0.9 * subclavian, 0.85 * subclavian, 0.8 * subclavian});
  for (const double side : {-1.0, 1.0}) {
    artery(side < 0.0 ? "right-vertebral" : "left-vertebral", 0.5,
           side < 0.0
               ? std::vector<Vec3>{{-33, -19, 60}, {-26, 2, 82}, {-21, 10, 110}, {-20, 12, 220}}
               : std::vector<Vec3>{{24, 7, 67}, {22, 8, 84}, {20, 10, 110}, {20, 12, 220}},
           same(4, vertebral));
  }
}

void add_neck_veins(const DrawnScan& scan, Draws& draws, DrawnAnatomy& body) {
  const double base = draws.between(0.5, 0.95);
  const auto gap = [&] { return draws.between(0.0, 1.0); };
  const auto add = [&](PhantomTube vein) { add_vein(std::move(vein), base, scan, draws, body); };
  const auto through = [&](const char* name, const std::vector<Vec3>& points, double radius) {
    add(tube_through(name, PhantomTubeKind::kVein, 0.4, points, same(points.size(), radius)));
  };
  const double brachiocephalic = draws.between(5.5, 7.5), pulmonary = draws.between(10.0, 13.0);
  through("pulmonary-trunk",
          {{-2, -34, -70}, {3, -26, -34}, {12, -8, -16}, {30, 2, -18}, {55, 4, -26}}, pulmonary);
  through("right-pulmonary", {{8, -12, -18}, {-8, 0, -20}, {-28, 4, -22}, {-55, 2, -28}},
          0.8 * pulmonary);
  through("superior-cava", {{-37, -34, 22}, {-46, -30, -20}, {-48, -28, -80}},
          draws.between(8.0, 10.0));
  through("left-brachiocephalic-vein",
          {{60, -18, 70}, {36, -30, 56}, {10, -36, 44}, {-14, -40, 34}, {-34, -36, 22}},
          brachiocephalic);
  through("right-brachiocephalic-vein", {{-58, -20, 66}, {-44, -32, 44}, {-38, -34, 20}},
          brachiocephalic);
  const double jugular = draws.between(4.5, 7.0);
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "right" : "left";
    add(vein_beside(name + "-jugular", body.tube(name + "-carotid"), side < 0.0 ? 0.15 : 0.45, 0.95,
                    {side, -0.2, 0.0}, jugular, gap()));
    add(vein_beside(name + "-upper-jugular", body.tube(name + "-internal"), 0.0, 0.98,
                    {side, 0.4, 0.0}, jugular, gap()));
  }
}

void add_chest(const DrawnScan& scan, Draws& draws, DrawnAnatomy& body) {
  const auto organ = [&](const char* name, double hu, const Vec3& center, const Vec3& semi_axes,
                         double shell = 0.0) {
    body.organs.push_back(
        {.name = name, .hu = hu, .center = center, .semi_axes = semi_axes, .shell_mm = shell});
  };
  const double thyroid = scan.organs ? draws.between(0.5, 1.0) * scan.arterial_hu() : 110.0;
  organ("fat of the mediastinum", -90.0, {0, -8, -20}, {52, 58, 130});
  organ("fat of the neck", -90.0, {0, -6, 140}, {46, 34, 90});
  for (const double side : {-1.0, 1.0}) {
    organ("lung", -850.0, {side * 92, 2, -50}, {44, 76, 116});
    organ(kThyroid, thyroid, {side * 15, -22, 104}, {8, 9, 22});
    organ("clavicle", 300.0, {side * 70, -48, 64}, {58, 6, 6}, 1.5);
    organ("first rib", 280.0, {side * 52, 6, 46}, {5, 34, 5}, 1.3);
  }
  organ("sternum", 200.0, {0, -66, -30}, {19, 6, 80}, 1.3);
  for (int k = 0; k < 10; ++k) {
    body.vertebrae.push_back({.center = {-2.0, 56.0 - 1.2 * k, -190.0 + 25.0 * k},
                              .semi_axes = {15.0, 13.0, 10.0},
                              .shell_mm = 1.2,
                              .core_hu = draws.between(180.0, 320.0)});
  }
  for (int k = 0; k < 9; ++k) {
    body.vertebrae.push_back({.center = {0.0, 38.0 - 2.0 * k, 58.0 + 18.5 * k},
                              .semi_axes = {11.0, 8.5, 7.0},
                              .shell_mm = 1.0,
                              .core_hu = draws.between(220.0, 380.0)});
  }
  PhantomTube discs =
      tube_through("discs", PhantomTubeKind::kTissue, 0.0,
                   {{-2, 56, -200}, {-2, 45, 36}, {0, 38, 58}, {0, 22, 210}}, {11, 10, 7.5, 7});
  discs.hu = 85.0;
  body.tubes.push_back(std::move(discs));
  PhantomTube air = tube_through(
      "trachea", PhantomTubeKind::kTissue, 1.5,
      {{0, -10, 220}, {0, -10, 120}, {-1, -4, 70}, {-4, 14, 0}, {-4, 18, -14}}, same(5, 8.0));
  air.hu = -950.0;
  body.tubes.push_back(std::move(air));
  for (const double side : {-1.0, 1.0}) {
    PhantomTube muscle = tube_through(
        side < 0.0 ? "right-muscle" : "left-muscle", PhantomTubeKind::kTissue, 0.0,
        {{side * 18, -44, 50}, {side * 40, -30, 120}, {side * 54, 0, 210}}, {7, 10, 11});
    muscle.hu = 60.0;
    body.tubes.push_back(std::move(muscle));
  }
}

}  // namespace

DrawnAnatomy draw_arch(Draws& draws, const DrawnScan& scan) {
  DrawnAnatomy body;
  body.body_center = {0.0, 5.0, 0.0};
  body.body_semi_axes = {165.0, 100.0, 1000.0};
  add_chest(scan, draws, body);
  add_arteries(draws, body);
  body.level.assign(body.tubes.size(), 0.0);
  add_neck_veins(scan, draws, body);

  // From the descending aorta into one of the branches; thin slices reach less far.
  const std::string side = draws.chance(0.5) ? "left" : "right";
  body.way = {"aorta"};
  if (side == "right") body.way.emplace_back("brachiocephalic");
  const bool thin = scan.slice_mm <= 0.8;
  body.access_name = "descending aorta";
  body.access_at = thin ? draws.between(0.72, 0.76) : draws.between(0.78, 0.9);
  const int choice = draws.index(10);
  body.way.push_back(side + (choice < 2 ? "-subclavian" : "-carotid"));
  if (choice >= 7 && !thin && scan.slice_mm <= 3.0) {
    body.way.push_back(side + "-internal");
    body.target_name = side + " internal carotid";
    body.target_at = draws.between(0.35, 0.6);
  } else {
    body.target_name = side + (choice < 2 ? " subclavian" : " common carotid");
    body.target_at = choice < 2 ? draws.between(0.45, 0.55) : draws.between(0.5, thin ? 0.6 : 0.9);
  }
  body.stentable = {body.way.begin() + 1, body.way.end()};

  const std::string bent = side + "-carotid";
  const bool bends = draws.chance(0.5), kissing = draws.chance(0.35);
  const double amplitude = draws.between(5.0, 12.0), waves = draws.between(1.0, 1.9);
  const double gap = draws.between(0.3, 1.0);
  if (kissing && choice >= 2 && !thin && scan.slice_mm <= 3.0) {
    body.loops.push_back({bent, {side == "left" ? 1.0 : -1.0, -0.6, 0.0}, gap});
    body.target_at = std::max(body.target_at, body.way.back() == bent ? 0.86 : 0.3);
    body.features.emplace_back("kissing limbs");
  } else if (bends) {
    add_bends(body.tube(bent), amplitude, waves, {1.0, 0.4, 0.0});
    body.features.emplace_back("bends");
  }
  return body;
}

}  // namespace wireplan::preprocess
