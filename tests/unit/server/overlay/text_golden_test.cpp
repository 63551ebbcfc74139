// What the wearer reads, held against pictures that people have looked at:
// tests/golden/overlay_text. To write them anew after a deliberate change, and look at them again:
//   SACCADE_UPDATE_GOLDEN=1 build/release/bin/overlay_test --gtest_filter='TextGolden.*'
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/overlay/overlay.hpp"
#include "tests/unit/server/anchors/synthetic_map.hpp"

namespace saccade::text_golden_test {
namespace {

// Other versions of the fonts and of FreeType draw edges otherwise; letters stay where they are.
constexpr double kSame = 0.75;   // likeness of the least alike stretch of two pictures
constexpr double kOther = 0.65;  // of a text drawn wrongly

const std::string kFolder = SACCADE_SOURCE_DIR "/tests/golden/overlay_text/";

/// The augmented picture of a grey one with one note in its middle.
cv::Mat Picture(const std::string& text, AnchorState state = AnchorState::kTracking) {
  testing::SyntheticMap map(
      testing::SyntheticMap::Options{.features = 0, .pose_sigma_m = 0, .pose_sigma_rad = 0});
  const MapSnapshot snapshot = *map.Snapshot(Rigid3());
  Annotation note;
  note.id = "n";
  note.shape = AnnotationShape::kNote;
  note.text = text;
  note.color_rgba = 0xffd08cff;
  note.anchor.state = state;
  note.anchor.point_in_world = {-0.3, 0.1, 1.5};
  Frame frame;
  frame.grey = cv::Mat(480, 640, CV_8UC1, cv::Scalar(120));
  frame.camera = map.camera();
  OverlayOptions options;
  options.world_axes = options.status_line = false;
  return Augment(frame, snapshot, {note}, options);
}

/// The letters in the label's box, blurred as far as an edge may be off.
cv::Mat Ink(const cv::Mat& picture) {
  cv::Mat grey, field, blurred;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  cv::morphologyEx(grey < 60, field, cv::MORPH_CLOSE, cv::Mat::ones(15, 15, CV_8U));
  cv::erode(field, field, cv::Mat::ones(7, 7, CV_8U));  // without its border
  grey.convertTo(grey, CV_32F);
  grey.setTo(0, ~field);
  cv::GaussianBlur(grey, blurred, {}, 1.0);
  return blurred;
}

/// Correlation of the stretch (two letters wide) in which two texts are least alike; 1: the same.
double Likeness(const cv::Mat& a, const cv::Mat& b) {
  constexpr int kStretch_px = 20;
  const cv::Mat x = Ink(a), y = Ink(b);
  double least = 1.0;
  for (int left = 0; left + kStretch_px <= x.cols; left += kStretch_px / 4) {
    const cv::Mat p = x.colRange(left, left + kStretch_px),
                  q = y.colRange(left, left + kStretch_px);
    const double most = std::max(p.dot(p), q.dot(q));
    if (most < 1e5) continue;  // no more than a point of a letter
    least = std::min(least, p.dot(q) / std::sqrt((p.dot(p) + 1.0) * (q.dot(q) + 1.0)));
  }
  return least;
}

/// As another version of the font might draw it: a third of a pixel off, softer, paler.
cv::Mat OtherVersion(const cv::Mat& picture) {
  cv::Mat out;
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, 0.35, 0, 1, 0.25);
  cv::warpAffine(picture, out, shift, picture.size());
  cv::GaussianBlur(out, out, {}, 0.5);
  return 0.92 * out;
}

/// As the overlay was until 2026-11-28: ASCII, and a question mark for each other character.
std::string AsciiOnly(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) out += c;
    if (byte >= 0xc0) out += '?';
  }
  return out;
}

struct Sample {
  const char* name;
  std::string text;
  std::vector<std::string> wrong;  // what other faults would look like
};

const std::vector<Sample>& Samples() {
  static const std::vector<Sample> samples = {
      {"german", "Größe prüfen: ≈ 5 mm", {"Grosse prufen: = 5 mm"}},
      {"polish", "Dokręć śrubę – źle!", {"□□□□□□ □□□□□ – □□□!"}},
      {"hebrew", "בדוק את מפלס השמן (5 מ״מ)", {"(5 מ״מ) ןמשה סלפמ תא קודב"}},
      {"arabic",
       "افحص مستوى الزيت 5 مم",
       {// Letters that do not join, as without shaping; and from left to right.
        "ا\u200cف\u200cح\u200cص م\u200cس\u200cت\u200cو\u200cى ا\u200cل\u200cز\u200cي\u200cت 5 "
        "م\u200cم",
        "مم 5 تيزلا ىوتسم صحفا"}},
      {"chinese", "检查油位，然后关上盖子", {"□□□□□□□□□□□"}},
      {"emoji", "⚠️ 🔧 OK ✅ 👩‍🔧 🇩🇪", {"⚠ □ OK ✓ □□ DE"}},
      {"mixed", "Öl: פתח 3 زيت 油位 🔧", {"Öl: 油位 🔧 زيت 3 פתח"}},
  };
  return samples;
}

class TextGolden : public ::testing::TestWithParam<std::size_t> {};

TEST_P(TextGolden, EqualsThePictureAndNoWrongOneDoes) {
  const Sample& sample = Samples()[GetParam()];
  const std::string file = kFolder + sample.name + ".png";
  const cv::Mat actual = Picture(sample.text);
  if (std::getenv("SACCADE_UPDATE_GOLDEN") != nullptr) {
    ASSERT_TRUE(cv::imwrite(file, actual));
    GTEST_SKIP() << "wrote " << file;
  }
  const cv::Mat golden = cv::imread(file);
  ASSERT_FALSE(golden.empty()) << file << " is missing; see the head of this file";
  const double same = Likeness(golden, actual);
  std::printf("%s: %.3f", sample.name, same);
  EXPECT_GT(same, kSame) << sample.text;
  const double version = Likeness(golden, OtherVersion(actual));
  std::printf(", other version %.3f", version);
  EXPECT_GT(version, kSame) << "the test would not survive another version of the fonts";
  std::vector<std::string> all_wrong = sample.wrong;
  all_wrong.push_back(AsciiOnly(sample.text));
  for (const std::string& wrong : all_wrong) {
    const double other = Likeness(golden, Picture(wrong));
    std::printf(", wrong %.3f", other);
    EXPECT_LT(other, kOther) << "the test would not see '" << wrong << "'";
  }
  std::printf("\n");
}

INSTANTIATE_TEST_SUITE_P(Languages, TextGolden, ::testing::Range<std::size_t>(0, 7),
                         [](const auto& sample) { return Samples()[sample.param].name; });

}  // namespace
}  // namespace saccade::text_golden_test
