#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "server/capture/image_file.hpp"
#include "server/markers/koller_code.hpp"
#include "server/markers/koller_edges.hpp"
#include "server/markers/marker_detector.hpp"
#include "server/markers/marker_sheet.hpp"
#include "server/markers/puddles.hpp"

namespace saccade::koller_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

KollerCells Turned(const KollerCells& cells) {
  KollerCells turned{};
  for (int k = 0; k < 9; ++k) turned[3 * (k % 3) + 2 - k / 3] = cells[k];
  return turned;
}

TEST(KollerCode, IsReadInEveryTurnAndNoSingleErrorIsTakenForAnother) {
  for (int id = 0; id < kKollerIds; ++id) {
    KollerCells cells = KollerCellsOf(id);
    for (int turns = 0; turns < 4; ++turns) {
      const auto reading = ReadKollerCells(cells);
      ASSERT_TRUE(reading.ok()) << id << " " << turns;
      EXPECT_EQ(reading->id, id);
      EXPECT_EQ(reading->turns, turns);
      for (bool& cell : cells) {
        cell = !cell;
        EXPECT_FALSE(ReadKollerCells(cells).ok()) << id;
        cell = !cell;
      }
      cells = Turned(cells);
    }
  }
}

TEST(KollerCode, AMirrorShowsAnotherCode) {
  for (int id = 0; id < kKollerIds; ++id) {
    const KollerCells cells = KollerCellsOf(id);
    KollerCells mirrored{};
    for (int k = 0; k < 9; ++k) mirrored[3 * (k / 3) + 2 - k % 3] = cells[k];
    EXPECT_EQ(ReadKollerCells(mirrored)->id, MirroredKollerId(id));
  }
}

TEST(KollerEdges, AreWhereTheCodeSaysHoweverBlurredUnlessASideIsSomethingElses) {
  constexpr int kSide = 80, kAt = 30;
  const cv::Scalar black(25, 25, 25), red(38, 36, 200);
  for (const int id : {0, 6, 15}) {
    cv::Mat sharp(140, 140, CV_8UC3, cv::Scalar(220, 222, 225));
    sharp(cv::Rect(kAt, kAt, kSide, kSide)).setTo(black);
    const KollerCells cells = KollerCellsOf(id);
    for (int k = 0; k < 9; ++k) {
      const cv::Rect cell(kAt + 10 + 20 * (k % 3), kAt + 10 + 20 * (k / 3), 20, 20);
      if (cells[k]) sharp(cell).setTo(red);
    }
    const double low = kAt - 0.5, high = low + kSide;
    const std::array<Eigen::Vector2d, 4> whole = {
        {{low, low}, {high, low}, {high, high}, {low, high}}};
    for (const double blur_px : {0.4, 2.0, 4.0}) {
      cv::Mat picture;
      cv::GaussianBlur(sharp, picture, {}, blur_px);
      const SquareSampler square(picture, whole);
      EXPECT_LT(LookAtEdges(square, cells, 0).worst_cells, 0.06) << id << " " << blur_px;
      if (id != 0) continue;  // of one cell: what a stack of cartons before a square looks like
      for (int side = 0; side < 4; ++side) {
        std::array<Eigen::Vector2d, 4> moved = whole;
        for (const int k : {side, (side + 1) % 4}) {
          moved[k] += 0.25 * (whole[(side + 3) % 4] - whole[side]);
        }
        EXPECT_GT(LookAtEdges({picture, moved}, cells, 0).worst_cells, 0.24)
            << side << " " << blur_px;
      }
    }
  }
}

TEST(Puddles, ABlackSquareOnWhiteIsTheDeepestAndItsAreaItsOwn) {
  cv::Mat grey(120, 160, CV_8UC1, cv::Scalar(140));
  grey(cv::Rect(30, 20, 80, 80)).setTo(220);  // paper
  grey(cv::Rect(50, 40, 40, 40)).setTo(30);
  grey(cv::Rect(5, 5, 15, 100)).setTo(100);  // a shallower one
  const std::vector<Puddle> puddles = FindPuddles(grey);
  ASSERT_FALSE(puddles.empty());
  EXPECT_EQ(puddles[0].depth, 190);
  EXPECT_EQ(puddles[0].area_px, 1600);
  EXPECT_NEAR(puddles[0].compactness, 1, 0.01);
  EXPECT_TRUE(cv::Rect(50, 40, 40, 40).contains(puddles[0].bottom));
  EXPECT_TRUE(FindPuddles(cv::Mat()).empty());
}

TEST(MarkerIds, AreParsedOrRefusedWithAnExample) {
  EXPECT_THAT(*ParseMarkerIds("2:5"), ElementsAre(2, 3, 4));
  EXPECT_THAT(*ParseMarkerIds("7"), ElementsAre(7));
  EXPECT_THAT(*ParseMarkerIds("4,1,9"), ElementsAre(4, 1, 9));
  for (const char* bad : {"", "5:2", "3:3", "a", "1,1", "1,,2", "-1", "0:9:2", "0:100000"}) {
    const auto refused = ParseMarkerIds(bad);
    ASSERT_FALSE(refused.ok()) << bad;
    EXPECT_THAT(std::string(refused.status().message()), HasSubstr("0:8"));
  }
}

class Sheet : public ::testing::Test {
 protected:
  Sheet() : folder_(fs::temp_directory_path() / ("saccade-sheet-" + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Sheet() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST_F(Sheet, IsPrintedToScaleAndItsMarkersAreRead) {
  constexpr double kDots_per_m = 100 / 0.0254;
  struct Case {
    const char *detector, *family, *paper;
    double side_m;
    int markers, pages;
  };
  for (const Case& c : {Case{"koller", "koller", "a4", 0.06, 8, 2},
                        Case{"apriltag", "apriltag36h11", "letter", 0.16, 2, 2},
                        Case{"aruco", "aruco_4x4_50", "a4", 0.04, 9, 1}}) {
    const fs::path pdf = folder_ / (std::string(c.family) + ".pdf");
    SheetOptions options{c.family, {}, c.side_m, c.paper};
    for (int id = 0; id < c.markers; ++id) options.ids.push_back(id);
    const auto sheet = WriteMarkerSheet(options, pdf);
    ASSERT_TRUE(sheet.ok()) << sheet.status();
    EXPECT_EQ(sheet->pages, c.pages) << c.family;
    const std::string pages = (folder_ / c.family).string();
    ASSERT_EQ(std::system(("pdftoppm -r 100 -png " + pdf.string() + " " + pages).c_str()), 0);
    const auto detector = MakeMarkerDetector(c.detector, {{c.family}, 1});
    ASSERT_TRUE(detector.ok());
    std::vector<int> ids;
    for (int page = 0; page < sheet->pages; ++page) {
      const auto picture = LoadPicture(pages + "-" + std::to_string(page + 1) + ".png");
      ASSERT_TRUE(picture.ok()) << picture.status();
      EXPECT_NEAR(picture->grey.cols, 1e-3 * sheet->page_width_mm * kDots_per_m, 2);
      for (const MarkerSighting& seen :
           (*detector)->Detect((*detector)->needs_color() ? picture->color : picture->grey)) {
        ids.push_back(seen.id);
        const SheetLayout::Place& place = sheet->places[seen.id];
        EXPECT_EQ(place.page, page);
        EXPECT_NEAR(ShortestSide(seen), c.side_m * kDots_per_m, 1.0) << c.family << seen.id;
        const double middle_m = 1e-3 * place.left_mm + 0.5 * c.side_m;
        EXPECT_NEAR(Middle(seen).x(), middle_m * kDots_per_m - 0.5, 1.5);
      }
    }
    std::sort(ids.begin(), ids.end());
    EXPECT_EQ(ids, options.ids) << c.family;
    EXPECT_EQ(WriteMarkerSheet(options, pdf).status().code(), absl::StatusCode::kAlreadyExists);
  }
}

TEST_F(Sheet, OnePageMayBeAPicture) {
  const fs::path png = folder_ / "one.png", svg = folder_ / "one.svg";
  const SheetOptions options{"koller", {5}, 0.16, "a4"};
  ASSERT_TRUE(WriteMarkerSheet(options, svg).ok());
  EXPECT_GT(fs::file_size(svg), 1000u);
  ASSERT_TRUE(WriteMarkerSheet(options, png).ok());
  const auto picture = LoadPicture(png);
  ASSERT_TRUE(picture.ok());
  const auto detector = MakeMarkerDetector("koller", {});
  const auto seen = (*detector)->Detect(picture->color);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].id, 5);
  EXPECT_NEAR(ShortestSide(seen[0]), 0.16 * 300 / 0.0254, 1.0);
}

TEST_F(Sheet, WhatCannotBePrintedIsRefusedWithTheRemedy) {
  const auto refusal = [&](SheetOptions options, const char* name) {
    return std::string(WriteMarkerSheet(options, folder_ / name).status().message());
  };
  EXPECT_THAT(refusal({"koller", {0}, 0.3, "a4"}, "s.pdf"), HasSubstr("0.169"));
  EXPECT_THAT(refusal({"koller", {16}, 0.1, "a4"}, "s.pdf"), HasSubstr("0 to 15"));
  EXPECT_THAT(refusal({"qr", {0}, 0.1, "a4"}, "s.pdf"), HasSubstr("apriltag36h11"));
  EXPECT_THAT(refusal({"koller", {0}, 0.1, "a3"}, "s.pdf"), HasSubstr("letter"));
  EXPECT_THAT(refusal({"koller", {0, 1, 2}, 0.16, "a4"}, "s.svg"), HasSubstr("3 pages"));
  EXPECT_THAT(refusal({"koller", {0}, 0.1, "a4"}, "s.gif"), HasSubstr(".pdf"));
  EXPECT_THAT(refusal({"koller", {0}, 0.1, "a4"}, "no/s.pdf"), HasSubstr("cannot write"));
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST(KollerDetector, RefusesWhatItIsNot) {
  EXPECT_THAT(std::string(MakeMarkerDetector("koller", {{"apriltag36h11"}}).status().message()),
              HasSubstr("there is koller"));
  EXPECT_THAT(std::string(MakeMarkerDetector("koller", {{}, 2}).status().message()),
              HasSubstr("border-bits"));
  EXPECT_THAT(std::string(MakeMarkerDetector("koller", {{}, 1, {16}}).status().message()),
              HasSubstr("0 to 15"));
}

}  // namespace
}  // namespace saccade::koller_test
