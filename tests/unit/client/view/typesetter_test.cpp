#include "client/view/typesetter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "client/view/theme.hpp"

namespace saccade::view::typesetter_test {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// ImGui's fonts without a window.
class Letters : public ::testing::Test {
 protected:
  Letters() { ImGui::CreateContext(); }
  ~Letters() override { ImGui::DestroyContext(); }

  void Make(float scale = 1) { ASSERT_TRUE(ApplyTheme(scale, false, fonts_).ok()); }
  /// As it is shown once the font has it.
  std::string Shown(const std::string& text, float width_px = 0) {
    Types().Set(text, width_px);
    Make();
    return Types().Set(text, width_px);
  }
  float Width(const std::string& set) {
    return fonts_.text->CalcTextSizeA(fonts_.text->FontSize, 1e6f, 0, set.c_str()).x;
  }
  static std::vector<unsigned> Characters(const std::string& set) {
    std::vector<unsigned> out;
    for (const char* at = set.c_str(); *at != 0;) {
      // Three bytes each: all of the private use area.
      out.push_back((at[0] & 0xfu) << 12 | (at[1] & 0x3fu) << 6 | (at[2] & 0x3fu));
      at += 3;
    }
    return out;
  }

  const ImFontGlyph& Glyph(unsigned character) {
    return *fonts_.text->FindGlyph(static_cast<ImWchar>(character));
  }
  int Visible(const std::string& set) {
    int count = 0;
    for (const unsigned each : Characters(set)) count += Glyph(each).Visible != 0 ? 1 : 0;
    return count;
  }
  cv::Mat Texels(const ImFontGlyph& glyph) {
    unsigned char* bytes = nullptr;
    int width = 0, height = 0;
    ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&bytes, &width, &height);
    const auto at = [](float share, int size) {
      return static_cast<int>(std::lround(share * static_cast<float>(size)));
    };
    return cv::Mat(height, width, CV_8UC4, bytes)(
        cv::Range(at(glyph.V0, height), at(glyph.V1, height)),
        cv::Range(at(glyph.U0, width), at(glyph.U1, width)));
  }
  bool LookAlike(unsigned a, unsigned b) {
    const cv::Mat one = Texels(Glyph(a)), other = Texels(Glyph(b));
    return one.size() == other.size() && cv::norm(one, other, cv::NORM_INF) == 0;
  }

  Fonts fonts_;
};

TEST_F(Letters, WhatIsSimpleStaysAsItIs) {
  Make();
  for (const char* text : {"check the seal", "Ölstand · масло · λάδι", "±3 °C → ok", ""}) {
    EXPECT_EQ(Types().Set(text), text);
    EXPECT_TRUE(Typesetter::IsSimple(text));
  }
  EXPECT_FALSE(Types().stale());
}

TEST_F(Letters, ArabicIsJoinedAndSeenFromTheRight) {
  const std::string joined = Shown("زيت"), apart = Shown("ز\u200cي\u200cت");
  EXPECT_GT(Width(joined), 5);
  EXPECT_LT(Width(joined), 0.95f * Width(apart));
  const auto whole = Characters(Shown("שמן")), first = Characters(Shown("ש"));
  ASSERT_EQ(whole.size(), 3u);
  EXPECT_TRUE(LookAlike(whole.back(), first.front())) << "what is read first stands right";
  EXPECT_FALSE(LookAlike(whole.front(), first.front()));
}

TEST_F(Letters, LatinBesideOtherScriptsIsAsHeavyAsElsewhere) {
  const FontCatalogue& regular = FontCatalogue::System(FontWeight::kRegular);
  const auto font = regular.FontFor(U"n", false);
  ASSERT_TRUE(font);
  EXPECT_THAT(regular.fonts()[*font].path, HasSubstr("/DejaVuSans.ttf")) << "not its light one";
}

TEST_F(Letters, UntilTheFontHasItItIsABlankNotAQuestionMark) {
  Make();
  EXPECT_EQ(Types().Set("油位"), " ");
  EXPECT_TRUE(Types().stale());
  Make();
  EXPECT_FALSE(Types().stale());
  const std::string set = Types().Set("油位");
  for (const unsigned c : Characters(set)) {
    const ImFontGlyph* glyph = fonts_.text->FindGlyphNoFallback(static_cast<ImWchar>(c));
    ASSERT_NE(glyph, nullptr);
    EXPECT_TRUE(glyph->Visible);
    EXPECT_GT(glyph->X1 - glyph->X0, 6);
    EXPECT_LT(glyph->Y1, fonts_.text->FontSize + 3) << "in its line";
  }
}

TEST_F(Letters, AnEmojiHasItsColoursInTextAndInAField) {
  const auto set = Characters(Shown("😀"));
  ASSERT_EQ(set.size(), 1u);
  const ImFontGlyph* glyph = fonts_.text->FindGlyphNoFallback(static_cast<ImWchar>(set[0]));
  ASSERT_NE(glyph, nullptr);
  EXPECT_TRUE(glyph->Colored);
  const cv::Mat texels = Texels(*glyph);
  const auto& face = texels.at<cv::Vec4b>(texels.rows / 4, texels.cols / 2);
  EXPECT_GT(face[0], face[2] + 60) << "yellow: more red than blue, " << face;
}

TEST_F(Letters, WhatAFieldHasIsWhatWasWritten) {
  Make();
  for (const char* text : {"ok", "😀 ok 🔧", "שמן 油 ☎"}) {
    const std::string field = Types().ToField(text);
    EXPECT_EQ(Types().FromField(field), text);
    EXPECT_EQ(Types().ToField(Types().FromField(field)), field);
  }
  EXPECT_THAT(Types().ToField("😀"), Not(HasSubstr("😀"))) << "ImGui has no more than 16 bits";
  const std::string before = Types().ToField("🔧");
  Make(1.5f);  // another monitor: a field that is written in goes on
  EXPECT_EQ(Types().ToField("🔧"), before);
  EXPECT_EQ(Types().FromField(before), "🔧");
  Make(1);
}

TEST_F(Letters, LinesAreBrokenInTheOrderInWhichTheyAreRead) {
  const std::string text = "את הבדיקה שמן מתחילים לפני עבודה";
  EXPECT_THAT(Shown(text), Not(HasSubstr("\n")));
  const std::string narrow = Shown(text, 90);
  const std::size_t end = narrow.find('\n');
  ASSERT_NE(end, std::string::npos);
  EXPECT_LE(Width(narrow), 92);
  // Words that are read first make the first line; other counts come from the other end.
  EXPECT_THAT(Visible(narrow.substr(0, end)), AnyOf(2, 8, 11, 18, 22));
  EXPECT_THAT(Visible(narrow.substr(narrow.rfind('\n') + 1)), AnyOf(5, 9, 16, 19, 25));
}

}  // namespace
}  // namespace saccade::view::typesetter_test
