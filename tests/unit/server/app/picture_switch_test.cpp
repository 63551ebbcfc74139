// The wearer's large pause: which frames nobody is shown, and what is kept of it.
#include "server/app/picture_switch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <future>

namespace saccade::picture_switch_test {
namespace {

using ::testing::HasSubstr;

constexpr Timestamp kSecond = 1'000'000'000;

absl::StatusOr<PicturePause> SetAndWait(PictureSwitch& pictures, bool paused,
                                        const std::string& by = "Ann") {
  std::promise<absl::StatusOr<PicturePause>> answer;
  pictures.Set(paused, by,
               [&](absl::StatusOr<PicturePause> result) { answer.set_value(std::move(result)); });
  return answer.get_future().get();
}

class PictureSwitchTest : public ::testing::Test {
 protected:
  PictureSwitchTest() {
    folder_ = std::filesystem::temp_directory_path() /
              ("picture_switch_test." + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
  }
  ~PictureSwitchTest() override {
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_all);
    std::filesystem::remove_all(folder_);
  }
  std::filesystem::path file() const { return folder_ / "picture_pause.json"; }
  std::filesystem::path folder_;
};

TEST_F(PictureSwitchTest, FramesOfAPauseAreNeverShown) {
  const auto pictures = *PictureSwitch::Open("");
  pictures->Note(10, MonotonicNow());
  EXPECT_TRUE(pictures->MayShow(10).ok());
  ASSERT_TRUE(SetAndWait(*pictures, true).ok());
  const absl::Status paused = pictures->MayShow();
  EXPECT_TRUE(absl::IsFailedPrecondition(paused));
  EXPECT_THAT(paused.message(), HasSubstr("Ann has paused it"));
  EXPECT_FALSE(pictures->MayShow(10).ok()) << "nothing at all while it is paused";
  EXPECT_TRUE(pictures->MayClick(10).ok()) << "it was shown before";
  pictures->Note(11, MonotonicNow());
  pictures->Note(14, MonotonicNow());
  ASSERT_TRUE(SetAndWait(*pictures, false).ok());
  pictures->Note(15, MonotonicNow() - kSecond / 100);  // exposed before it was lifted
  pictures->Note(16, MonotonicNow() + kSecond);
  EXPECT_TRUE(pictures->MayShow().ok());
  EXPECT_TRUE(pictures->MayShow(10).ok());
  for (const FrameId id : {11, 12, 14, 15}) {
    EXPECT_TRUE(absl::IsFailedPrecondition(pictures->MayShow(id))) << id;
    EXPECT_THAT(pictures->MayClick(id).message(), HasSubstr("while the picture was paused"));
  }
  EXPECT_TRUE(pictures->MayShow(16).ok());
  EXPECT_TRUE(pictures->MayShow(17).ok()) << "not tracked yet";
}

TEST_F(PictureSwitchTest, ASourceThatStartsAgainHasOtherFrames) {
  const auto pictures = *PictureSwitch::Open("");
  ASSERT_TRUE(SetAndWait(*pictures, true).ok());
  pictures->Note(5, MonotonicNow());
  ASSERT_TRUE(SetAndWait(*pictures, false).ok());
  EXPECT_FALSE(pictures->MayShow(5).ok());
  pictures->Note(2, MonotonicNow() + kSecond);
  pictures->Note(5, MonotonicNow() + kSecond);
  EXPECT_TRUE(pictures->MayShow(5).ok());
}

TEST_F(PictureSwitchTest, IsKeptOverARestart) {
  {
    const auto pictures = *PictureSwitch::Open(folder_);
    EXPECT_FALSE(pictures->state()->paused);
    const auto set = SetAndWait(*pictures, true, "Bea");
    ASSERT_TRUE(set.ok()) << set.status();
    EXPECT_GT(set->since_unix_ns, 0);
  }
  {
    const auto again = *PictureSwitch::Open(folder_);
    EXPECT_TRUE(again->state()->paused);
    EXPECT_EQ(again->state()->by, "Bea");
    EXPECT_THAT(again->MayShow().message(), HasSubstr("Bea"));
    // Who pauses what is paused changes nothing.
    EXPECT_EQ(SetAndWait(*again, true, "Cy")->by, "Bea");
    ASSERT_TRUE(SetAndWait(*again, false, "Cy").ok());
  }
  EXPECT_FALSE((*PictureSwitch::Open(folder_))->state()->paused);
}

TEST_F(PictureSwitchTest, AFileThatSaysNeitherIsSaid) {
  std::ofstream(file()) << "{\"paused\": \"perhaps\"}";
  const auto opened = PictureSwitch::Open(folder_);
  EXPECT_TRUE(absl::IsDataLoss(opened.status())) << opened.status();
  EXPECT_THAT(opened.status().message(), HasSubstr("picture_pause.json"));
  EXPECT_THAT(opened.status().message(), HasSubstr("delete it"));
}

// What cannot be kept leaves pictures stopped: never the other way round.
TEST_F(PictureSwitchTest, WithoutADiskPicturesAreStopped) {
  const auto pictures = *PictureSwitch::Open(folder_);
  std::filesystem::remove_all(folder_);
  std::ofstream(folder_.string()) << "not a folder";
  const auto set = SetAndWait(*pictures, true);
  EXPECT_TRUE(absl::IsInternal(set.status())) << set.status();
  EXPECT_FALSE(pictures->MayShow().ok());
  EXPECT_FALSE(SetAndWait(*pictures, false).ok());
  EXPECT_FALSE(pictures->MayShow().ok());
  std::filesystem::remove(folder_);
  std::filesystem::create_directory(folder_);
  EXPECT_TRUE(SetAndWait(*pictures, true).ok()) << "said again, it is kept";
  EXPECT_TRUE(std::filesystem::exists(file()));
  EXPECT_TRUE(SetAndWait(*pictures, false).ok());
  EXPECT_TRUE(pictures->MayShow().ok());
}

TEST_F(PictureSwitchTest, TellsOfAChangeBeforeItIsAnswered) {
  const auto pictures = *PictureSwitch::Open(folder_);
  std::vector<bool> told;
  pictures->SetOnChange([&](const auto& state) { told.push_back(state->paused); });
  ASSERT_TRUE(SetAndWait(*pictures, true).ok());
  ASSERT_TRUE(SetAndWait(*pictures, true).ok());
  ASSERT_TRUE(SetAndWait(*pictures, false).ok());
  EXPECT_THAT(told, ::testing::ElementsAre(true, false));
  pictures->Stop();
  EXPECT_TRUE(absl::IsUnavailable(SetAndWait(*pictures, true).status()));
}

}  // namespace
}  // namespace saccade::picture_switch_test
