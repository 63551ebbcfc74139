#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>
#include <random>

#include "server/overlay/text_painter.hpp"
#include "shared/text/characters.hpp"
#include "shared/text/font_catalogue.hpp"
#include "shared/text/text_layout.hpp"

namespace saccade::text_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TextLayout Set(const std::string& text, double width_px = 1e9, int lines = 1) {
  FontStore fonts(FontCatalogue::System());
  return LayOut(fonts, text, {14, width_px, lines});
}

std::string Repeat(const std::string& part, std::size_t bytes) {
  std::string text;
  while (text.size() + part.size() <= bytes) text += part;
  return text;
}

TEST(Text, EveryNamedScriptHasAFont) {
  EXPECT_THAT(FontCatalogue::System().Missing(), IsEmpty());
  for (const char* text :
       {"Größe ẞ „Öl“ ≈ 5 µm ±3 °C →", "Zażółć gęślą jaźń ŁÓDŹ", "שלום עֲבוֹדָה „טוב“",
        "فحص الزيت پچژگ ٠١٢", "检查油位，請檢查。《盖子》", "オイルを確認", "확인하세요",
        "⚠️🔧✅❌🛠️👩‍🔧🇵🇱👍🏽1️⃣", "Проверить масло",
        "Έλεγχος"}) {
    EXPECT_EQ(Set(text).missing, 0) << text;
  }
}

TEST(Text, WithoutFontsBoxesAreDrawnAndTheRemedyIsSaid) {
  const FontCatalogue none{std::vector<FontFile>()};
  EXPECT_THAT(none.Missing(), SizeIs(5));
  EXPECT_THAT(none.Missing()[3], HasSubstr("fonts-wqy-microhei"));
  TextPainter painter(none);
  TextStyle style;
  style.color = {255, 255, 255};
  EXPECT_GT(cv::countNonZero(painter.Sprite("", "油 a", style)->pixels.reshape(1)), 20);
  FontStore fonts(none);
  EXPECT_EQ(LayOut(fonts, "油a", {14, 1e9, 1}).missing, 2);
}

TEST(Text, ArabicIsJoinedAndRunsFromTheRight) {
  const TextLayout joined = Set("زيت");
  const TextLayout apart = Set("ز\u200cي\u200cت");
  ASSERT_THAT(joined.lines, SizeIs(1));
  EXPECT_TRUE(joined.lines[0].right_to_left);
  EXPECT_LT(joined.width_px, 0.95 * apart.width_px) << "letters alone are wider";
  EXPECT_NE(joined.lines[0].glyphs[0].glyph, apart.lines[0].glyphs[0].glyph);
}

/// The numbers of a line's glyphs from left to right.
std::vector<std::uint32_t> Glyphs(const std::string& text) {
  std::vector<std::uint32_t> glyphs;
  const TextLayout layout = Set(text);
  for (const PlacedGlyph& glyph : layout.lines.at(0).glyphs) glyphs.push_back(glyph.glyph);
  return glyphs;
}

TEST(Text, HebrewAndNumbersAreInTheOrderOfTheBidirectionalAlgorithm) {
  const std::uint32_t alef = Glyphs("א")[0], bet = Glyphs("ב")[0], a = Glyphs("a")[0],
                      one = Glyphs("1")[0], two = Glyphs("2")[0], blank = Glyphs("a b")[1];
  EXPECT_THAT(Glyphs("אב"), ElementsAre(bet, alef));
  EXPECT_THAT(Glyphs("אב 12"), ElementsAre(one, two, blank, bet, alef));
  EXPECT_THAT(Glyphs("a אב"), ElementsAre(a, blank, bet, alef));
  EXPECT_THAT(Glyphs("אב a"), ElementsAre(a, blank, bet, alef));
}

TEST(Text, NothingCanTurnTheWordsBesideItRound) {
  EXPECT_EQ(DrawableText("a\u202eb\u2066c\u2069d\u202c"), U"abcd");
  EXPECT_EQ(DrawableText("tab\tbell\x07 escape\x1b[31m\r\n"), U"tab bell  escape [31m\n");
}

TEST(Text, MalformedBytesBecomeOneReplacementEach) {
  EXPECT_EQ(DrawableText("a\xff\xc3"), U"a\ufffd\ufffd");
  EXPECT_EQ(DrawableText("\xe2\x82z"), U"\ufffdz");
  EXPECT_EQ(DrawableText("\xed\xa0\x80"), U"\ufffd");      // a surrogate
  EXPECT_EQ(DrawableText("\xc0\xaf"), U"\ufffd\ufffd");    // overlong
  EXPECT_EQ(DrawableText("\xf4\x90\x80\x80"), U"\ufffd");  // beyond Unicode
  EXPECT_EQ(Set("\xff").missing, 0);
}

TEST(Text, WhatBelongsTogetherIsOneCharacter) {
  const auto count = [](const char32_t* text) { return SplitClusters(text).size(); };
  EXPECT_EQ(count(U"e\u0301x"), 2u);
  EXPECT_EQ(count(U"👩‍🔧👍🏽"), 2u);
  EXPECT_EQ(count(U"🇩🇪🇵🇱"), 2u);
  EXPECT_EQ(count(U"1\ufe0f\u20e3⚠\ufe0f"), 2u);
  EXPECT_TRUE(SplitClusters(U"✅")[0].emoji);
  EXPECT_FALSE(SplitClusters(U"✓")[0].emoji);
}

TEST(Text, LinesBreakAtBlanksAndBetweenIdeographsAndFit) {
  const TextLayout english = Set("check the oil level here, then close the lid again", 120, 20);
  EXPECT_GT(english.lines.size(), 2u);
  EXPECT_FALSE(english.cut);
  const TextLayout chinese = Set(Repeat("检查油位，然后关上盖子。", 480), 120, 40);
  EXPECT_FALSE(chinese.cut);
  const TextLayout word = Set(std::string(500, 'W'), 120, 90);
  EXPECT_FALSE(word.cut);
  for (const TextLayout* layout : {&english, &chinese, &word}) {
    for (const TextLine& line : layout->lines) EXPECT_LE(line.width_px, 120.5);
  }
  EXPECT_FALSE(MayBreakBetween(U'位', U'，'));
  EXPECT_FALSE(MayBreakBetween(U'《', U'盖'));
  EXPECT_TRUE(MayBreakBetween(U'油', U'位'));
  EXPECT_EQ(Set("one\ntwo\n\nthree", 1e9, 9).lines.size(), 3u);
}

TEST(Text, WhatIsCutEndsInAnEllipsisWithinItsWidth) {
  for (const std::string& text :
       {Repeat("oil level ", 500), Repeat("זיתשמן ", 500), Repeat("油", 500), Repeat("🔧", 500)}) {
    const TextLayout cut = Set(text, 200, 2);
    EXPECT_TRUE(cut.cut);
    ASSERT_THAT(cut.lines, SizeIs(2));
    EXPECT_LE(cut.lines[1].width_px, 200.5) << text;
    const std::uint32_t ellipsis = Glyphs("…")[0];
    const std::vector<PlacedGlyph>& glyphs = cut.lines[1].glyphs;
    const PlacedGlyph& last = cut.lines[1].right_to_left ? glyphs.front() : glyphs.back();
    EXPECT_EQ(last.glyph, ellipsis) << text;
  }
}

// Whatever 500 bytes hold: no crash, a bounded picture, a bounded time. Clean under the address and
// undefined behaviour sanitizers on 2026-11-29; deploy/test does not build this folder with them.
TEST(Text, AnyBytesEndSoonAndStaySmall) {
  std::vector<std::string> texts = {
      "",
      " ",
      "\n",
      Repeat("\u0301", 500),
      "a" + Repeat("\u0301\u0323\u20dd", 499),
      Repeat("\u200d", 500),
      Repeat("👩\u200d", 500),
      Repeat("\u202e\u2066", 500),
      Repeat("\n", 500),
      Repeat("a\n", 500),
      Repeat("﷽", 500),
      Repeat("\xf4\x8f\xbf\xbf", 500),
      Repeat("a\u200b", 500),
      Repeat("\ufe0f", 500),
      Repeat("🇩", 500),
      Repeat("نَّ", 500),
      std::string(500, '\0'),
      std::string(100000, 'x'),
  };
  std::mt19937 random(11);
  const char32_t starts[] = {0x20,   0x300,  0x590,  0x600,   0x900,  0xe00,
                             0x1100, 0x2000, 0x4e00, 0x1f300, 0xe0000};
  for (int run = 0; run < 150; ++run) {
    std::string text;
    while (text.size() < 496) {
      const std::uint32_t kind = random() % 12;
      if (kind == 11) {
        text += static_cast<char>(random());
      } else {
        const char32_t c = starts[kind] + random() % 160;
        if (c < 0x80) text += static_cast<char>(c);
        if (c >= 0x80 && c < 0x800)
          text += {static_cast<char>(0xc0 | c >> 6), static_cast<char>(0x80 | (c & 63))};
        if (c >= 0x800 && c < 0x10000)
          text += {static_cast<char>(0xe0 | c >> 12), static_cast<char>(0x80 | (c >> 6 & 63)),
                   static_cast<char>(0x80 | (c & 63))};
        if (c >= 0x10000)
          text += {static_cast<char>(0xf0 | c >> 18), static_cast<char>(0x80 | (c >> 12 & 63)),
                   static_cast<char>(0x80 | (c >> 6 & 63)), static_cast<char>(0x80 | (c & 63))};
      }
    }
    texts.push_back(text);
  }
  TextPainter painter(FontCatalogue::System());
  TextStyle style;
  style.layout = {14, 380, 24};
  style.color = {255, 255, 255};
  double worst_ms = 0;
  for (const std::string& text : texts) {
    for (const TextGround ground : {TextGround::kBox, TextGround::kHalo}) {
      style.ground = ground;
      const std::clock_t start = std::clock();  // the processor's time: others use it, too
      const auto sprite = painter.Sprite("do not trust", text, style);
      worst_ms =
          std::max(worst_ms, 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      EXPECT_LE(sprite->pixels.cols, 380);
      EXPECT_LE(sprite->pixels.rows, 26 * 18 + 2);
    }
  }
  std::printf("worst text: %.1f ms\n", worst_ms);
  EXPECT_LT(worst_ms, 150);
}

TEST(Text, WhatWasDrawnIsKeptAndThePileIsBounded) {
  TextPainter painter(FontCatalogue::System());
  TextStyle style;
  style.layout = {14, 380, 24};
  const auto first = painter.Sprite("", "a text", style);
  EXPECT_EQ(first, painter.Sprite("", "a text", style));
  style.color = {1, 2, 3};
  EXPECT_NE(first, painter.Sprite("", "a text", style)) << "another colour is another picture";
  style.color = {};
  for (int i = 0; i < 300; ++i) painter.Sprite("", std::to_string(i), style);
  EXPECT_NE(first, painter.Sprite("", "a text", style)) << "256 others came since";
  EXPECT_NE(painter.Sprite("a", "b", style), painter.Sprite("", "ab", style));
}

}  // namespace
}  // namespace saccade::text_test
