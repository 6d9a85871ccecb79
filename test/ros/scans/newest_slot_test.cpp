#include "ros/scans/newest_slot.h"

#include <gtest/gtest.h>

#include <functional>
#include <thread>

namespace ttsdf {
namespace {

TEST(NewestSlot, GivesWhatWasPutLast) {
  NewestSlot<int> slot;
  EXPECT_FALSE(slot.put(3));
  EXPECT_TRUE(slot.put(2));  // 3 is gone
  EXPECT_EQ(slot.take(), 2);
}

TEST(NewestSlot, KeepsTheNewerOfTwoThatComeInTheWrongOrder) {
  NewestSlot<int> slot;
  EXPECT_FALSE(slot.put(3, std::greater<int>()));
  EXPECT_TRUE(slot.put(2, std::greater<int>()));
  EXPECT_EQ(slot.take(), 3);
}

TEST(NewestSlot, TakeWaitsForAValueAndForTheEnd) {
  NewestSlot<int> slot;
  std::thread producer([&slot] { slot.put(1); });
  EXPECT_EQ(slot.take(), 1);
  producer.join();
  std::thread closer([&slot] { slot.close(); });
  EXPECT_FALSE(slot.take().has_value());
  closer.join();
}

TEST(NewestSlot, ForgetsOnClear) {
  NewestSlot<int> slot;
  slot.put(1);
  slot.clear();
  EXPECT_FALSE(slot.put(2));
}

}  // namespace
}  // namespace ttsdf
