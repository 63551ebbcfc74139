#include "client/view/key_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace saccade::view::key_queue_test {
namespace {

constexpr int kTab = 1, kA = 2;

/// Writes down what ImGui is told.
class Keys : public ::testing::Test {
 protected:
  void Key(int key, bool pressed) {
    queue_.Key(key, pressed, key == kTab, [this, key, pressed] {
      told_ += (pressed ? "+" : "-") + std::to_string(key) + " ";
    });
  }
  void Character(char c) {
    queue_.Character([this, c] { told_ += std::string(1, c) + " "; });
  }
  std::string Told() { return std::exchange(told_, ""); }

  KeyQueue queue_;
  std::string told_;
};

TEST_F(Keys, AKeyPressedAndLetGoBetweenTwoPicturesIsDownInOne) {
  Key(kA, true);
  Key(kA, false);
  EXPECT_EQ(Told(), "+2 ");
  EXPECT_TRUE(queue_.Next());
  EXPECT_EQ(Told(), "-2 ");
  EXPECT_FALSE(queue_.Next());
  Key(kA, true);
  EXPECT_FALSE(queue_.Next());
  Key(kA, false);
  EXPECT_EQ(Told(), "+2 -2 ") << "over two pictures nothing waits";
}

TEST_F(Keys, PressedTwiceItIsPressedTwice) {
  for (int i = 0; i < 2; ++i) {
    Key(kA, true);
    Key(kA, false);
  }
  EXPECT_EQ(Told(), "+2 ");
  queue_.Next();
  EXPECT_EQ(Told(), "-2 +2 ");
  queue_.Next();
  EXPECT_EQ(Told(), "-2 ");
}

TEST_F(Keys, WhatIsTypedAfterTabComesOnceTheKeyboardHasGone) {
  Character('x');
  Key(kTab, true);
  Key(kTab, false);
  Character('2');
  EXPECT_EQ(Told(), "x +1 ");
  queue_.Next();
  EXPECT_EQ(Told(), "-1 2 ");
}

TEST_F(Keys, TextAloneNeverWaits) {
  Key(kA, true);
  Character('a');
  Character('b');
  EXPECT_EQ(Told(), "+2 a b ");
}

}  // namespace
}  // namespace saccade::view::key_queue_test
