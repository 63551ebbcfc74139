// phone: what comes of the pictures that a phone sends, good and hostile, through the real decoder.
#include <gmock/gmock.h>
#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "server/capture/phone/phone_source.hpp"
#include "tests/unit/server/capture/phone_fixture.hpp"

namespace saccade::phone_test {
namespace {

using ::testing::HasSubstr;

constexpr Timestamp kMs = 1'000'000;

std::unique_ptr<PhoneSource> OpenPhone(const std::string& rest = "?size=320x240") {
  SourceOptions options;
  options.realtime = true;
  auto source = PhoneSource::Open(rest, options);
  EXPECT_TRUE(source.ok()) << source.status();
  return source.ok() ? *std::move(source) : nullptr;
}

Frame NextOf(PhoneSource& source) {
  auto frame = source.Next();
  EXPECT_TRUE(frame.ok() && frame->has_value());
  return frame.ok() && frame->has_value() ? **std::move(frame) : Frame{};
}

std::string Refusal(const std::string& rest, const SourceOptions& options) {
  return std::string(PhoneSource::Open(rest, options).status().message());
}

TEST(PhoneClock, TakesTheQuickestPing) {
  PhoneClock clock;
  // The phone is 5 s ahead; one exchange took 2 ms each way, the other 2 there and 200 back.
  const Timestamp ahead = 5'000 * kMs;
  clock.Add(1000 * kMs, 1002 * kMs + ahead, 1010 * kMs + ahead, 1210 * kMs);
  clock.Add(2000 * kMs, 2002 * kMs + ahead, 2010 * kMs + ahead, 2012 * kMs);
  EXPECT_EQ(clock.ToMonotonic(3000 * kMs + ahead, 3050 * kMs), 3000 * kMs);
}

TEST(PhoneClock, ABetterMeasurementIsNoJump) {
  PhoneClock clock;
  const Timestamp ahead = 5'000 * kMs;
  // An exchange of which one way took 60 ms more than the other, and so 30 ms off.
  clock.Add(900 * kMs, 901 * kMs + ahead, 901 * kMs + ahead, 962 * kMs);
  EXPECT_EQ(clock.ToMonotonic(1000 * kMs + ahead, 1040 * kMs), 1030 * kMs);
  clock.Add(1041 * kMs, 1042 * kMs + ahead, 1042 * kMs + ahead, 1043 * kMs);
  Timestamp before = 1030 * kMs;
  for (int i = 1; i < 300; ++i) {
    const Timestamp taken = (1000 + 33 * i) * kMs;
    const std::optional<Timestamp> time = clock.ToMonotonic(taken + ahead, taken + 40 * kMs);
    ASSERT_TRUE(time.has_value());
    EXPECT_NEAR(static_cast<double>(*time - before), 33.0 * kMs, 0.25 * kMs);
    before = *time;
  }
  EXPECT_EQ(before, (1000 + 33 * 299) * kMs);
}

TEST(PhoneClock, ASlowFirstPictureIsForgottenAtOnce) {
  PhoneClock clock;
  const Timestamp ahead = 5'000 * kMs;
  // The first took 90 ms, as its coder had to be made; those that follow take 10.
  EXPECT_EQ(clock.ToMonotonic(1000 * kMs + ahead, 1090 * kMs), 1090 * kMs);
  EXPECT_EQ(clock.ToMonotonic(1100 * kMs + ahead, 1110 * kMs), 1110 * kMs);
  const auto third = clock.ToMonotonic(1200 * kMs + ahead, 1250 * kMs);  // 40 ms late
  ASSERT_TRUE(third.has_value());
  EXPECT_NEAR(static_cast<double>(*third), 1210.0 * kMs, 0.1 * kMs);
}

TEST(PhoneClock, NoPictureIsFromTheFutureNorFromLongAgo) {
  PhoneClock clock;
  EXPECT_EQ(clock.ToMonotonic(10'000 * kMs, 500 * kMs), 500 * kMs);
  EXPECT_EQ(clock.ToMonotonic(20'000 * kMs, 600 * kMs), 600 * kMs);
  EXPECT_EQ(clock.ToMonotonic(1, 700 * kMs), std::nullopt);  // nine seconds ago: before the last
  EXPECT_EQ(clock.ToMonotonic(-1, 800 * kMs), std::nullopt);
  EXPECT_EQ(clock.ToMonotonic(std::numeric_limits<Timestamp>::max(), 900 * kMs), std::nullopt);
  clock.Add(1, std::numeric_limits<Timestamp>::max(), 1, 2);  // no overflow, no effect
  EXPECT_EQ(clock.ToMonotonic(40'000 * kMs, 1000 * kMs), 1000 * kMs);
}

TEST(PhoneSource, OnePictureComesOutForEachThatGoesIn) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  for (int i = 1; i <= 30; ++i) {
    const CodedPicture coded = phone->Code(i, i == 1);
    source->Offer(phone.get(), coded);
    const Frame frame = NextOf(*source);
    ASSERT_EQ(NumberIn(frame.grey), i) << "a decoder that delays gives an older one";
    EXPECT_EQ(frame.id, static_cast<FrameId>(i - 1));
    const auto picture = source->Find(frame.id);
    ASSERT_TRUE(picture.has_value());
    EXPECT_EQ(picture->picture_id, static_cast<std::uint64_t>(i));
    EXPECT_LE(frame.capture_time_ns, coded.received_ns);
    EXPECT_GT(frame.capture_time_ns, coded.received_ns - 50 * kMs);
  }
  EXPECT_EQ(source->bad_frames(), 0u);
  EXPECT_EQ(source->info().remark.substr(0, 12), "lens assumed");
}

TEST(PhoneSource, TheNewestPictureWinsAndNothingQueues) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  for (int i = 1; i <= 100; ++i) {
    source->Offer(phone.get(), phone->Code(i, i == 1));
    // Decoded, and nobody asks for it.
    ASSERT_TRUE(Soon([&] { return source->Find(static_cast<FrameId>(i - 1)).has_value(); }));
  }
  EXPECT_EQ(NumberIn(NextOf(*source).grey), 100);
  EXPECT_EQ(source->dropped_frames(), 99u);
}

TEST(PhoneSource, AFloodIsLeftOutUntilTheNextKeyFrame) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  std::vector<CodedPicture> coded;
  for (int i = 1; i <= 200; ++i) coded.push_back(phone->Code(i, i == 1));
  for (const CodedPicture& picture : coded) source->Offer(phone.get(), picture);  // at once
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  source->Offer(phone.get(), phone->Code(201, false));
  ASSERT_TRUE(Soon([&] { return phone->asked() > 0; })) << "nobody asked for a key frame";
  source->Offer(phone.get(), phone->Code(202, true));
  ASSERT_TRUE(Soon([&] { return NumberIn(NextOf(*source).grey) == 202; }));
  EXPECT_GT(source->counts().dropped, 100u);
}

TEST(PhoneSource, DamagedPicturesAreCountedAndAKeyFrameIsAskedFor) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  source->Offer(phone.get(), phone->Code(1, true));
  EXPECT_EQ(NumberIn(NextOf(*source).grey), 1);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  CodedPicture torn = phone->Code(2, true);
  torn.data.resize(torn.data.size() / 2);
  source->Offer(phone.get(), torn);
  ASSERT_TRUE(Soon([&] { return source->bad_frames() == 1 && phone->asked() == 1; }));
  // What refers to it is left out; the next key frame goes on.
  source->Offer(phone.get(), phone->Code(3, false));
  ASSERT_TRUE(Soon([&] { return source->counts().dropped == 1; }));
  source->Offer(phone.get(), phone->Code(4, true));
  EXPECT_EQ(NumberIn(NextOf(*source).grey), 4);
}

TEST(PhoneSource, HostileBytesHarmNothing) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  std::mt19937 random(1);
  for (int i = 1; i <= 300; ++i) {
    CodedPicture picture = phone->Code(i, true);
    if (i % 3 == 0) picture.codec = PacketHeader::kVp8;
    if (i % 2 == 0) picture.data.resize(random() % 2000);
    for (char& byte : picture.data) {
      if (random() % 10 == 0) byte = static_cast<char>(random());
    }
    source->Offer(phone.get(), std::move(picture));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  source->Offer(phone.get(), phone->Code(77, true));
  ASSERT_TRUE(Soon([&] { return NumberIn(NextOf(*source).grey) == 77; }));
  EXPECT_GT(source->bad_frames(), 10u);
}

TEST(PhoneSource, AKilledDecoderIsReplacedAndAKeyFrameAskedFor) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  source->Offer(phone.get(), phone->Code(1, true));
  EXPECT_EQ(NumberIn(NextOf(*source).grey), 1);
  for (int i = 0; i < 5; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const int asked = phone->asked();
    const pid_t pid = source->decoder_pid();
    ASSERT_GT(pid, 0);
    ASSERT_EQ(kill(pid, SIGKILL), 0);
    source->Offer(phone.get(), phone->Code(10 * i + 2, false));
    ASSERT_TRUE(Soon([&] { return phone->asked() > asked; }));
    const Timestamp begin = MonotonicNow();
    source->Offer(phone.get(), phone->Code(10 * i + 3, true));
    EXPECT_EQ(NumberIn(NextOf(*source).grey), 10 * i + 3);
    EXPECT_LT(MonotonicNow() - begin, 1000 * kMs);
  }
  EXPECT_EQ(source->decoder_restarts(), 5u);
}

TEST(PhoneSource, ATurnedPhoneIsLaidBackAsItsSensorLies) {
  const auto source = OpenPhone();
  const auto wide = std::make_shared<FakePhone>(cv::Size(320, 240));
  source->Begin(wide);
  source->Offer(wide.get(), wide->Code(5, true));
  EXPECT_EQ(NextOf(*source).grey.size(), cv::Size(320, 240));
  // Upright now, as a browser gives it: its numbers stand at the left once it is laid back.
  const auto upright = std::make_shared<FakePhone>(cv::Size(240, 320));
  source->Offer(wide.get(), upright->Code(6, true, 270));
  const Frame laid = NextOf(*source);
  ASSERT_EQ(laid.grey.size(), cv::Size(320, 240));
  cv::Mat again;
  cv::rotate(laid.grey, again, cv::ROTATE_90_CLOCKWISE);
  EXPECT_EQ(NumberIn(again), 6);
  EXPECT_EQ(laid.id, 1u) << "the same stream of frames goes on";
}

TEST(PhoneSource, PicturesOfAnotherSizeAreRefusedInWords) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>(cv::Size(640, 480));
  source->Begin(phone);
  source->Offer(phone.get(), phone->Code(1, true));
  ASSERT_TRUE(Soon([&] { return !phone->problem().empty(); }));
  EXPECT_EQ(phone->problem(), "pictures of 640x480 came, and this server takes 320x240");
  EXPECT_EQ(source->bad_frames(), 1u);
  // The next phone is told as soon, and the decoder was harmed by neither.
  const auto second = std::make_shared<FakePhone>(cv::Size(640, 480));
  source->Begin(second);
  source->Offer(second.get(), second->Code(1, true));
  ASSERT_TRUE(Soon([&] { return !second->problem().empty(); }));
  EXPECT_EQ(source->decoder_restarts(), 0u);
}

TEST(PhoneSource, AnotherLinkGoesOnAndTheOldOneIsNotHeard) {
  const auto source = OpenPhone();
  const auto first = std::make_shared<FakePhone>(), second = std::make_shared<FakePhone>();
  source->Begin(first);
  source->Offer(first.get(), first->Code(1, true));
  const Frame before = NextOf(*source);
  source->Begin(second);
  source->Offer(first.get(), first->Code(2, true));
  source->Offer(second.get(), second->Code(3, true));
  const Frame after = NextOf(*source);
  EXPECT_EQ(NumberIn(after.grey), 3);
  EXPECT_GT(after.id, before.id);
  EXPECT_GT(after.capture_time_ns, before.capture_time_ns);
  source->End(first.get());  // late: it has it no more
  source->Offer(second.get(), second->Code(4, false));
  EXPECT_EQ(NumberIn(NextOf(*source).grey), 4);
}

TEST(PhoneSource, AReloadedPageCountsAnewAndIsNotTakenForItsOldSelf) {
  const auto source = OpenPhone();
  const auto before = std::make_shared<FakePhone>(), after = std::make_shared<FakePhone>();
  source->Begin(before);
  source->Offer(before.get(), before->Code(1, true));
  NextOf(*source);
  source->Begin(after);
  const CodedPicture again = after->Code(1, true);
  source->Offer(after.get(), again);
  const auto picture = source->Find(NextOf(*source).id);
  ASSERT_TRUE(picture.has_value());
  EXPECT_EQ(picture->received_ns, again.received_ns);
}

TEST(PhoneSource, WaitsForAPhoneUntilItIsStopped) {
  const auto source = OpenPhone();
  std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    source->Stop();
  });
  const auto frame = source->Next();
  ASSERT_TRUE(frame.ok());
  EXPECT_FALSE(frame->has_value());
}

TEST(PhoneSource, MotionIsKeptForTwoSecondsAndBounded) {
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  MotionSample sample;
  sample.acceleration_m_s2 = {0, 9.8, 0};
  source->AddMotion(phone.get(), FakePhone::kAhead_ns, sample);  // before any clock
  EXPECT_EQ(source->counts().motion, 0u);
  source->Offer(phone.get(), phone->Code(1, true));
  NextOf(*source);
  const Timestamp begin = MonotonicNow() + FakePhone::kAhead_ns;
  for (int i = 0; i < 1000; ++i) source->AddMotion(phone.get(), begin + i * 4 * kMs, sample);
  sample.acceleration_m_s2.x() = std::nan("");
  source->AddMotion(phone.get(), begin + 5000 * kMs, sample);
  EXPECT_EQ(source->counts().motion, 1000u);
  EXPECT_LE(source->motion().size(), 400u);
  EXPECT_NEAR(static_cast<double>(source->motion().back().time_ns + FakePhone::kAhead_ns - begin),
              3996.0 * kMs, 50.0 * kMs);
}

TEST(PhoneSource, RefusesWhatAPhoneIsNot) {
  SourceOptions live;
  live.realtime = true;
  EXPECT_THAT(Refusal("?size=33x2", live), HasSubstr("even pixels from 160 to 1920"));
  EXPECT_THAT(Refusal("?fps=500", live), HasSubstr("fps"));
  EXPECT_THAT(Refusal("?lens=2", live), HasSubstr("size and fps"));
  EXPECT_THAT(Refusal("mine", live), HasSubstr("names no device"));
  EXPECT_THAT(Refusal("", SourceOptions{}), HasSubstr("--speed max"));
  live.first_frame = 3;
  EXPECT_THAT(Refusal("", live), HasSubstr("no range of frames"));
}

/// The pictures of an IVF file.
std::vector<std::string> PicturesOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string all((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::vector<std::string> pictures;
  for (std::size_t at = 32; at + 12 <= all.size();) {
    std::uint32_t size = 0;
    std::memcpy(&size, all.data() + at, sizeof size);
    pictures.push_back(all.substr(at + 12, size));
    at += 12 + size;
  }
  return pictures;
}

/// Numbered pictures from 1 on, the first a key frame; empty: ffmpeg makes none.
std::vector<std::string> Vp8Pictures(cv::Size size, int count) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("phone-" + std::to_string(getpid()) + ".ivf");
  const std::string command =
      "ffmpeg -v error -y -f rawvideo -pix_fmt gray -s " + std::to_string(size.width) + "x" +
      std::to_string(size.height) +
      " -r 30 -i - -c:v libvpx -deadline realtime -b:v 1M -auto-alt-ref 0 -lag-in-frames 0 " +
      file.string();
  FILE* ffmpeg = popen(command.c_str(), "w");
  if (ffmpeg == nullptr) return {};
  for (int i = 1; i <= count; ++i) {
    const cv::Mat picture = NumberedPicture(i, size);
    fwrite(picture.data, 1, picture.total(), ffmpeg);
  }
  std::vector<std::string> pictures;
  if (pclose(ffmpeg) == 0) pictures = PicturesOf(file);
  std::filesystem::remove(file);
  return pictures;
}

CodedPicture Vp8Picture(int number, bool key, const std::string& data) {
  CodedPicture picture;
  picture.picture_id = static_cast<std::uint64_t>(number);
  picture.codec = PacketHeader::kVp8;
  picture.key_frame = key;
  picture.capture_ns = MonotonicNow() + FakePhone::kAhead_ns;
  picture.data = data;
  picture.received_ns = MonotonicNow();
  return picture;
}

TEST(PhoneSource, DecodesVp8AsWell) {
  const std::vector<std::string> pictures = Vp8Pictures({320, 240}, 20);
  ASSERT_FALSE(pictures.empty()) << "ffmpeg (deploy/install test) makes no VP8";
  const auto source = OpenPhone();
  const auto phone = std::make_shared<FakePhone>();
  source->Begin(phone);
  int number = 0;
  for (const std::string& data : pictures) {
    ++number;
    source->Offer(phone.get(), Vp8Picture(number, number == 1, data));
    ASSERT_EQ(NumberIn(NextOf(*source).grey), number);
  }
  EXPECT_EQ(number, 20);
}

TEST(PhoneSource, PicturesThatAreTooLargeEndNoDecoder) {
  // Few pixels, but a side that no picture may have; and more pixels than are decoded at all.
  for (const cv::Size size : {cv::Size(8208, 16), cv::Size(1280, 720)}) {
    const std::vector<std::string> large = Vp8Pictures(size, 1);
    ASSERT_FALSE(large.empty()) << "ffmpeg (deploy/install test) makes no VP8";
    const auto source = OpenPhone();
    const auto phone = std::make_shared<FakePhone>();
    source->Begin(phone);
    source->Offer(phone.get(), phone->Code(1, true));
    EXPECT_EQ(NumberIn(NextOf(*source).grey), 1);
    for (int i = 1; i <= 5; ++i) {
      source->Offer(phone.get(), Vp8Picture(i + 1, true, large.front()));
      ASSERT_TRUE(Soon([&] { return source->bad_frames() == static_cast<std::uint64_t>(i); }));
    }
    source->Offer(phone.get(), phone->Code(9, true));
    EXPECT_EQ(NumberIn(NextOf(*source).grey), 9);
    EXPECT_EQ(source->decoder_restarts(), 0u);
  }
}

}  // namespace
}  // namespace saccade::phone_test
