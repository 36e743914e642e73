#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "preprocess/centerline/centerline.h"
#include "preprocess/centerline/grid_search.h"
#include "preprocess/centerline/nearest_wall.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

// A body in place of a vessel has a wider grid, and so no more nodes than the largest real lumen.
TEST(GridSearch, HasNoMoreNodesInABodyThanInALargeLumen) {
  EXPECT_EQ(grid_spacing(0.1e3, 80e3), 0.25);
  EXPECT_EQ(grid_spacing(300e3, 80e3), 1.0);  // arteries from groin to head
  for (const double volume : {500e3, 2.4e6, 40e6}) {
    EXPECT_NEAR(volume / std::pow(grid_spacing(volume, 80e3), 3), 400e3, 1.0) << volume;
  }
}

TEST(GridSearch, VisitsTheNodesRoundALineWithoutThoseOfTheBallBefore) {
  const Surface body = shapes::box({0, 0, 0}, {70, 50, 50});
  const NearestWall wall(body);
  GridSearch search(wall, body, 1.0, {25.0, 25.0, 25.0}, {25.0, 25.0, 25.0});
  search.run_everywhere(Cost::kRoute);
  ASSERT_GT(search.count(), 70u * 50u * 50u / 2u);
  std::vector<GridBall> line;
  for (int k = 0; k < 30; ++k) {  // up to 27 mm wide, oblique to the grid, over its border too
    line.push_back({.center = {20.0 + k, 22.0 + 0.3 * k, 25.0 + std::sin(k)},
                    .radius = 24.0 + 3.0 * std::sin(0.4 * k)});
  }
  std::vector<char> visited(search.count(), 0);
  std::size_t visits = 0, inside = 0, of_balls = 0;
  GridBall before;
  for (const GridBall& ball : line) {
    search.visit_ball(ball, before, [&](int n) {
      visited[static_cast<std::size_t>(n)] = 1;
      ++visits;
    });
    before = ball;
  }
  for (std::size_t n = 2; n < search.count(); ++n) {
    const auto balls = std::count_if(line.begin(), line.end(), [&](const GridBall& ball) {
      return (search.at(n).point - ball.center).norm() <= ball.radius;
    });
    ASSERT_EQ(visited[n] != 0, balls > 0) << search.at(n).point.transpose();
    inside += balls > 0 ? 1 : 0;
    of_balls += static_cast<std::size_t>(balls);
  }
  EXPECT_GT(of_balls, 10 * inside);  // what ball by ball would cost
  EXPECT_LT(visits, 3 * inside);
}

/// A slab with `posts` squared upright posts, as wide as the gaps between them [mm].
Surface bush(int posts, double width, double height) {
  const int n = 4 * posts + 1;  // vertices along a side of the top: two of each post, two between
  std::vector<Vec3> vertices;
  std::vector<Eigen::Vector3i> triangles;
  for (const bool top : {true, false}) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const auto at = [&](int k) { return width * (k / 2 + (k % 2 == 0 ? 0.05 : 0.95)); };
        const bool up = i % 4 / 2 == 1 && j % 4 / 2 == 1;
        vertices.emplace_back(at(i), at(j), !top ? 0.0 : up ? height : 2.0);
      }
    }
  }
  const auto add = [&](int a, int b, int c, int d) {
    triangles.emplace_back(a, b, c);
    triangles.emplace_back(a, c, d);
  };
  const int bottom = n * n;
  for (int j = 0; j + 1 < n; ++j) {
    for (int i = 0; i + 1 < n; ++i) {
      const int a = i + n * j, b = a + 1, c = b + n, d = a + n;
      add(a, b, c, d);
      add(bottom + a, bottom + d, bottom + c, bottom + b);
    }
    const int right = n - 1 + n * j, left = n * j, back = j + n * (n - 1);
    add(j + 1, j, bottom + j, bottom + j + 1);
    add(back, back + 1, bottom + back + 1, bottom + back);
    add(right + n, right, bottom + right, bottom + right + n);
    add(left, left + n, bottom + left + n, bottom + left);
  }
  return shapes::as_surface(vertices, triangles);
}

TEST(CenterlineTree, OfABodyWithHundredsOfDeadEndsIsRefused) {
  const Surface few = bush(3, 2.0, 9.0);
  EXPECT_GE(find_tree(few, {0.6, 0.6, 1.0}, {.grid_mm = 0.5}).size(), 9u);
  const Surface body = bush(24, 2.0, 9.0);  // 576 posts
  try {
    find_tree(body, {0.6, 0.6, 1.0}, {.grid_mm = 0.5});
    FAIL() << "expected an error";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("the lumen has over 500 dead ends, from ("), std::string::npos)
        << message;
    EXPECT_NE(message.find("an organ, the skin of a body or noise, expected a tree of vessels; "
                           "take a narrower band"),
              std::string::npos)
        << message;
  }
}

}  // namespace
}  // namespace wireplan::preprocess
