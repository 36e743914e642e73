// The lumen's field as bytes: what comes back answers with the same bits.
#include <gtest/gtest.h>

#include <random>

#include "simulate/wall/lumen.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

using preprocess::find_openings;

Lumen tube_with_open_ends() {
  const Surface tube = shapes::straight_tube(4.0, 36.0, 1.5);
  return Lumen(tube, {.openings = find_openings(tube)});
}

TEST(LumenBytes, GiveTheSameFieldBack) {
  const Lumen field = tube_with_open_ends();
  ASSERT_EQ(field.openings().size(), 2u);
  const std::optional<Lumen> back = Lumen::from_bytes(field.to_bytes());
  ASSERT_TRUE(back);
  EXPECT_EQ(back->to_bytes(), field.to_bytes());
  EXPECT_EQ(back->max_deviation(), field.max_deviation());
  EXPECT_EQ(back->mean_deviation(), field.mean_deviation());
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(back->openings()[k].center, field.openings()[k].center);
    EXPECT_EQ(back->openings()[k].normal, field.openings()[k].normal);
    EXPECT_EQ(back->openings()[k].radius, field.openings()[k].radius);
    EXPECT_EQ(back->openings()[k].triangles, field.openings()[k].triangles);
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> across(-8.0, 8.0), along(-6.0, 42.0);
  int near = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 p(across(random), across(random), along(random));
    EXPECT_EQ(back->distance(p), field.distance(p));
    near += std::abs(field.distance(p)) < 1.5 ? 1 : 0;
  }
  EXPECT_GT(near, 200);
}

TEST(LumenBytes, ThatAreCutLongerOrOthersGiveNothing) {
  const std::string bytes = tube_with_open_ends().to_bytes();
  EXPECT_FALSE(Lumen::from_bytes(""));
  EXPECT_FALSE(Lumen::from_bytes("wireplan.lumen/0" + bytes.substr(16)));
  EXPECT_FALSE(Lumen::from_bytes(bytes + "x"));
  for (std::size_t size = 0; size < 400; ++size) {  // the head and the openings
    EXPECT_FALSE(Lumen::from_bytes(bytes.substr(0, size))) << size;
  }
  EXPECT_FALSE(Lumen::from_bytes(bytes.substr(0, bytes.size() - 1)));
}

}  // namespace
}  // namespace wireplan::simulate
