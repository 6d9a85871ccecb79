#include "../../src/field/block_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>

namespace ttsdf {
namespace {

using Id = BlockCache::Id;

void put(BlockCache& cache, Id id, std::size_t floats) {
  float* const block = cache.insert(id);
  for (std::size_t n = 0; n < floats; ++n) block[n] = static_cast<float>(id);
}

TEST(BlockCache, FindsWhatWasInserted) {
  BlockCache cache(16, 100, 10);
  EXPECT_EQ(cache.find(5), nullptr);
  put(cache, 5, 16);
  ASSERT_NE(cache.find(5), nullptr);
  EXPECT_EQ(cache.find(5)[15], 5.0f);
  EXPECT_EQ(cache.find(6), nullptr);
  EXPECT_EQ(cache.size(), 1u);
}

TEST(BlockCache, AlignsBlocksToCacheLines) {
  BlockCache cache(64, 10, 10);
  for (Id id = 0; id < 10; ++id) EXPECT_EQ(reinterpret_cast<std::uintptr_t>(cache.insert(id)) % 64, 0u);
}

TEST(BlockCache, DropsTheOldestWhenFull) {
  BlockCache cache(4, 3, 20);
  for (const Id id : {10u, 11u, 12u, 13u}) put(cache, id, 4);
  EXPECT_EQ(cache.find(10), nullptr);
  for (const Id id : {11u, 12u, 13u}) {
    ASSERT_NE(cache.find(id), nullptr) << id;
    EXPECT_EQ(cache.find(id)[0], static_cast<float>(id));
  }
  EXPECT_EQ(cache.size(), 3u);
}

TEST(BlockCache, NeverMixesBlocksUp) {
  // Against a queue of what must be newest.
  for (const std::size_t capacity : {1u, 2u, 7u, 64u, 500u}) {
    BlockCache cache(4, capacity, 1500);
    std::deque<Id> newest;
    std::mt19937 random(1);
    for (int step = 0; step < 20000; ++step) {
      const auto id = static_cast<Id>(random() % 1500);
      const float* const block = cache.find(id);
      ASSERT_EQ(block != nullptr, std::find(newest.begin(), newest.end(), id) != newest.end());
      if (block) {
        ASSERT_EQ(block[0], static_cast<float>(id));
        ASSERT_EQ(block[3], static_cast<float>(id));
        ASSERT_EQ(block, cache.data() + (cache.places()[id] - 1) * cache.blockFloats());
      } else {
        ASSERT_EQ(cache.places()[id], 0u);
        put(cache, id, 4);
        newest.push_back(id);
        if (newest.size() > capacity) newest.pop_front();
      }
    }
    EXPECT_EQ(cache.size(), std::min<std::size_t>(capacity, 1500));
  }
}

TEST(BlockCache, ForgetsEverythingWhenCleared) {
  BlockCache cache(4, 3, 20);
  for (const Id id : {10u, 11u, 12u, 13u}) put(cache, id, 4);
  cache.clear();
  EXPECT_EQ(cache.size(), 0u);
  for (const Id id : {11u, 12u, 13u}) EXPECT_EQ(cache.find(id), nullptr) << id;
  put(cache, 12, 4);
  ASSERT_NE(cache.find(12), nullptr);
  EXPECT_EQ(cache.find(12)[0], 12.0f);
}

TEST(BlockCache, CountsItsBytes) {
  const std::size_t blocks = BlockCache::blocksWithin(1000000, 64, 10000);
  BlockCache cache(64, blocks, 10000);
  EXPECT_GT(blocks, 3000u);
  for (Id id = 0; id < 10000; ++id) put(cache, id, 64);
  EXPECT_EQ(cache.size(), blocks);
  EXPECT_GE(cache.memoryBytes(), blocks * 256);
  EXPECT_LE(cache.memoryBytes(), 1000000u);
  EXPECT_EQ(BlockCache::blocksWithin(0, 64, 10), 1u);
}

}  // namespace
}  // namespace ttsdf
