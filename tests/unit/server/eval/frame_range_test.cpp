#include "server/eval/frame_range.hpp"

#include <gtest/gtest.h>

namespace saccade::frame_range_test {
namespace {

TEST(FrameRange, EitherEndMayBeLeftOut) {
  EXPECT_EQ(ParseFrameRange("3:7")->first, 3);
  EXPECT_EQ(ParseFrameRange("3:7")->end, 7);
  EXPECT_EQ(ParseFrameRange(":7")->first, 0);
  EXPECT_FALSE(ParseFrameRange("3:")->end);
  EXPECT_FALSE(ParseFrameRange("")->end);
}

TEST(FrameRange, AnythingElseIsRefused) {
  for (const char* text :
       {"3", "a:b", "-1:4", "4:4", "5:4", "1:2:3", "1.5:3", "99999999999999999999:"}) {
    EXPECT_FALSE(ParseFrameRange(text).ok()) << text;
  }
}

}  // namespace
}  // namespace saccade::frame_range_test
