#include "rcs/base/grid.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

namespace rcs {
namespace {

TEST(Grid, ScrollingKeepsCellsThatStayAndClearsCellsThatEnter) {
  // GIVEN a grid and, for comparison, a map of every write that is still inside the window
  std::mt19937 rng(7);
  Grid<int> grid(16, 0.5, -1);
  std::map<std::pair<int, int>, int> expected;
  int next = 0;
  for (int step = 0; step < 500; ++step) {
    // WHEN it writes somewhere inside and then moves, sometimes far
    const int far = step % 50 == 49 ? 40 : 3;
    std::uniform_int_distribution<int> in(0, 15);
    std::uniform_int_distribution<int> move(-far, far);
    const Cell c{grid.origin().i + in(rng), grid.origin().j + in(rng)};
    grid.at(c) = ++next;
    expected[{c.i, c.j}] = next;
    grid.move_to({grid.origin().i + move(rng), grid.origin().j + move(rng)});
    for (auto it = expected.begin(); it != expected.end();) {
      it = grid.contains({it->first.first, it->first.second}) ? std::next(it) : expected.erase(it);
    }
    // THEN each cell holds the last write, or is empty
    for (int i = 0; i < 16; ++i) {
      for (int j = 0; j < 16; ++j) {
        const Cell at{grid.origin().i + i, grid.origin().j + j};
        const auto it = expected.find({at.i, at.j});
        ASSERT_EQ(grid.at(at), it == expected.end() ? -1 : it->second);
      }
    }
  }
}

TEST(Grid, CellsOfNegativeCoordinatesRoundDown) {
  const Grid<int> grid(4, 0.5);
  EXPECT_EQ(grid.cell_at(-0.01, 0.49), (Cell{-1, 0}));
}

}  // namespace
}  // namespace rcs
