#include "base/disjoint_sets.hpp"

#include <gtest/gtest.h>

namespace pliant::disjoint_sets_test {
namespace {

TEST(DisjointSets, AreAloneUntilTheyAreJoined) {
  DisjointSets sets(4);
  EXPECT_EQ(sets.count(), 4);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(sets.root(i), i);
}

TEST(DisjointSets, AJoinKeepsTheRootOfTheFirst) {
  DisjointSets sets(7);
  sets.join(3, 1);
  EXPECT_EQ(sets.root(1), 3);
  sets.join(5, 1);
  EXPECT_EQ(sets.root(3), 5);
  EXPECT_EQ(sets.root(1), 5);
  EXPECT_EQ(sets.count(), 5);
  sets.join(1, 3);
  EXPECT_EQ(sets.count(), 5) << "they are one set already";
  EXPECT_EQ(sets.root(0), 0);
}

TEST(DisjointSets, OfALongChainAreOne) {
  constexpr int size = 1000;
  DisjointSets sets(size);
  for (int i = 1; i < size; ++i) sets.join(i, i - 1);
  EXPECT_EQ(sets.count(), 1);
  for (int i = 0; i < size; ++i) EXPECT_EQ(sets.root(i), size - 1);
}

}  // namespace
}  // namespace pliant::disjoint_sets_test
