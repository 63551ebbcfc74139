#include <absl/strings/str_format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "server/capture/camera_file.hpp"
#include "server/capture/image_list.hpp"
#include "server/capture/target_file.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::parsers_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ParseSeconds, IsExactToTheNanosecond) {
  EXPECT_EQ(ParseSeconds("1305031102.175304").value(), 1305031102175304000);
  EXPECT_EQ(ParseSeconds("1403638538.577829").value(), 1403638538577829000);
  EXPECT_EQ(ParseSeconds("0.000000001").value(), 1);
  EXPECT_EQ(ParseSeconds("0.0000000019").value(), 1);  // below a nanosecond
  EXPECT_EQ(ParseSeconds("7").value(), 7000000000);
  EXPECT_EQ(ParseSeconds("9223372037").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ParseSeconds, RefusesWhatIsNotDecimal) {
  for (const char* text :
       {"", ".", "1e9", "-1", "+1", "1.2.3", "nan", "0x10", " 1", "1,5", "99999999999999999999"}) {
    EXPECT_FALSE(ParseSeconds(text).ok()) << text;
  }
}

class Parsers : public DatasetFixture {
 protected:
  std::string CameraError(const std::string& text) const {
    Write("camera.yaml", text);
    return std::string(LoadCamera(folder_ / "camera.yaml").status().message());
  }
  std::string ListError(const std::string& text) const {
    Write("rgb.txt", text);
    return std::string(LoadImageList(folder_ / "rgb.txt").status().message());
  }
  std::string TargetError(const std::string& text) const {
    Write("target.yaml", text);
    return std::string(LoadTarget(folder_ / "target.yaml").status().message());
  }
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return text;
  }
};

TEST_F(Parsers, CameraIsRead) {
  const auto camera = LoadCamera(folder_ / "camera.yaml");
  ASSERT_TRUE(camera.ok()) << camera.status();
  EXPECT_EQ(camera->model, LensModel::kBrownConrady);
  EXPECT_EQ(camera->width, 64);
  EXPECT_EQ(camera->fps, 100);
  EXPECT_EQ(camera->distortion[0], 0.1);
}

TEST_F(Parsers, CameraErrorsNameFileLineFieldAndRemedy) {
  const std::string good = kCamera;
  EXPECT_THAT(CameraError(Replaced(good, "brown_conrady", "fisheye")),
              AllOf(HasSubstr("camera.yaml:1: model"), HasSubstr("'fisheye' is unknown"),
                    HasSubstr("kannala_brandt")));
  EXPECT_THAT(CameraError(Replaced(good, "fx: 60", "fx: .nan")),
              AllOf(HasSubstr("camera.yaml:4: fx"), HasSubstr("not a finite number")));
  EXPECT_THAT(CameraError(Replaced(good, "fx: 60", "fx: -60")),
              AllOf(HasSubstr(":4: fx"), HasSubstr("above 0")));
  EXPECT_THAT(CameraError(Replaced(good, "fx: 60\n", "")),
              AllOf(HasSubstr("fx: missing"), HasSubstr("camera.yaml")));
  EXPECT_THAT(CameraError(Replaced(good, "[0.1, 0, 0, 0, 0]", "[0.1, 0]")),
              AllOf(HasSubstr(":8: distortion"), HasSubstr("has 2 coefficients"),
                    HasSubstr("[k1, k2, p1, p2, k3]")));
  EXPECT_THAT(CameraError(Replaced(good, "[0.1, 0, 0, 0, 0]", "[0.1, x, 0, 0, 0]")),
              HasSubstr("'x' is not a finite number"));
  EXPECT_THAT(CameraError(Replaced(good, "width: 64", "width: 64.5")),
              HasSubstr("not a whole number"));
  EXPECT_THAT(CameraError(Replaced(good, "fps: 100", "fsp: 100")),
              AllOf(HasSubstr(":9: fsp: unknown field"), HasSubstr("fps")));
  EXPECT_THAT(CameraError("model: [unclosed"), HasSubstr("not valid YAML"));
  EXPECT_THAT(CameraError("just words"), HasSubstr("key: value"));
  EXPECT_THAT(CameraError(""), HasSubstr("key: value"));
}

TEST_F(Parsers, CameraMustBePossible) {
  const std::string good = kCamera;
  const auto refuse = [&](const std::string& from, const std::string& to, const char* field,
                          const char* words) {
    EXPECT_THAT(CameraError(Replaced(good, from, to)), AllOf(HasSubstr(field), HasSubstr(words)))
        << to;
  };
  refuse("fx: 60", "fx: 1e300", "camera.yaml:4: fx", "up to 1e+06");
  refuse("fx: 60", "fx: 1e-300", ":4: fx", "field of view of 180 deg");
  refuse("fx: 60", "fx: 9000", ":4: fx", "field of view of 0.407");
  refuse("fy: 60", "fy: 0.5", ":5: fy", "field of view");
  refuse("fy: 60", "fy: 600", ":5: fy", "nearly square");
  refuse("cx: 32", "cx: 129", ":6: cx", "from -64 up to 128");
  refuse("cy: 24", "cy: -1e9", ":7: cy", "out of range");
  refuse("width: 64", "width: 100000", ":2: width", "up to 8192");
  refuse("width: 64\nheight: 48", "width: 8192\nheight: 8192", ":2: width", "33554432");
  refuse("fps: 100", "fps: 0", ":9: fps", "from 0.1 up to 1000");
  refuse("fps: 100", "fps: 1e300", ":9: fps", "from 0.1 up to 1000");
  refuse("fps: 100", "fps: 100\nrolling_shutter_readout_s: 0.5", ":10: rolling_shutter_readout_s",
         "longer than a frame");
  refuse("fps: 100", "fps: 100\nrolling_shutter_readout_s: -0.1", "rolling_shutter_readout_s",
         "from 0");
  refuse("[0.1, 0, 0, 0, 0]", "[1e300, 0, 0, 0, 0]", ":8: distortion", "out of range");
  refuse("[0.1, 0, 0, 0, 0]", "[-90000, 0, 0, 0, 0]", ":8: distortion", "inverted");
  refuse("fps: 100", "T_body_camera: [1e9, 0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", "T_body_camera",
         "out of range");
  // A fisheye's focal length is pixels a radian.
  const std::string fisheye = Replaced(Replaced(good, "brown_conrady", "kannala_brandt"),
                                       "[0.1, 0, 0, 0, 0]", "[0, 0, 0, 0]");
  EXPECT_EQ(CameraError(Replaced(Replaced(fisheye, "fx: 60", "fx: 22"), "fy: 60", "fy: 22")), "");
  EXPECT_THAT(CameraError(Replaced(Replaced(fisheye, "fx: 60", "fx: 9"), "fy: 60", "fy: 9")),
              HasSubstr("fx"));
}

TEST_F(Parsers, PlacesMustBePossible) {
  EXPECT_THAT(TargetError("type: chessboard\ncolumns: 9\nrows: 6\nsquare_m: 1e300\n"),
              AllOf(HasSubstr("target.yaml:4: square_m"), HasSubstr("up to 10")));
  EXPECT_THAT(TargetError("type: patches\npoints:\n"
                          "  - {id: 0, point_in_world_m: [0, 1e300, 0], template: p.pgm}\n"),
              HasSubstr("point_in_world_m: 1e+300 is out of range"));
  Write("start.yaml",
        "position_m: [0, 0, 1e99]\nposition_sigma_m: 0.02\norientation_xyzw: [0, 0, 0, 1]\n"
        "orientation_sigma_rad: 0\n");
  EXPECT_THAT(LoadStart(folder_ / "start.yaml").status().message(),
              HasSubstr("position_m: 1e+99 is out of range"));
}

TEST_F(Parsers, DeepNestingIsRefusedInWords) {
  const int n = 100'000;
  std::string block;
  for (int i = 0; i < 1000; ++i) block += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  for (const std::string& text : std::vector<std::string>{
           "fx: " + std::string(n, '['), "fx: " + std::string(n, '[') + std::string(n, ']'),
           "fx: " + std::string(n, '{'), std::string(n, '['), "- " + std::string(n, '-'), block,
           "fx: &a [*a, *a, *a]", std::string(n, '?') + " a"}) {
    EXPECT_THAT(CameraError(text), HasSubstr("camera.yaml")) << text.substr(0, 30);
  }
}

TEST_F(Parsers, OnlyRegularFilesOfASensibleSizeAreRead) {
  for (const char* name : {"camera.yaml", "rgb.txt", "target.yaml", "start.yaml"}) {
    const auto load = [&] {
      const std::filesystem::path file = folder_ / name;
      const std::string kind = name;
      if (kind == "camera.yaml") return LoadCamera(file).status();
      if (kind == "rgb.txt") return LoadImageList(file).status();
      if (kind == "target.yaml") return LoadTarget(file).status();
      return LoadStart(file).status();
    };
    std::filesystem::remove(folder_ / name);
    ASSERT_EQ(mkfifo((folder_ / name).c_str(), 0600), 0);
    EXPECT_THAT(load().message(), AllOf(HasSubstr(name), HasSubstr("is a named pipe")));
    std::filesystem::remove(folder_ / name);
    std::filesystem::create_symlink("/dev/zero", folder_ / name);
    EXPECT_THAT(load().message(), AllOf(HasSubstr(name), HasSubstr("is a device")));
    std::filesystem::remove(folder_ / name);
    std::filesystem::create_directory(folder_ / name);
    EXPECT_THAT(load().message(), AllOf(HasSubstr(name), HasSubstr("is a folder")));
    std::filesystem::remove(folder_ / name);
    Write(name, "");
    std::filesystem::resize_file(folder_ / name, std::uintmax_t{1} << 36);
    EXPECT_THAT(load().message(), AllOf(HasSubstr(name), HasSubstr("too long")));
    std::filesystem::remove(folder_ / name);
  }
}

TEST_F(Parsers, ImageListErrorsNameTheLine) {
  EXPECT_THAT(ListError("1.0 a.png\n1.0 b.png\n"),
              AllOf(HasSubstr("rgb.txt:2:"), HasSubstr("not after 1.0 of line 1")));
  EXPECT_THAT(ListError("# c\n2.0 a.png\n1.0 b.png\n"), HasSubstr("rgb.txt:3:"));
  EXPECT_THAT(ListError("soon a.png\n"), HasSubstr("rgb.txt:1: time stamp 'soon'"));
  EXPECT_THAT(ListError("1.0\n"), HasSubstr("no file name"));
  EXPECT_THAT(ListError("# nothing\n"), HasSubstr("lists no picture"));
  EXPECT_THAT(ListError(std::string(10000, 'x')), HasSubstr("too long"));
  std::filesystem::remove(folder_ / "rgb.txt");
  EXPECT_THAT(LoadImageList(folder_ / "rgb.txt").status().message(),
              AllOf(HasSubstr("rgb.txt: cannot be opened"), HasSubstr("SECONDS FILE")));
}

TEST_F(Parsers, TimeStampsInAnotherUnitAreRefusedByFileLineUnitAndRemedy) {
  const auto list = [](double first, double step, int decimals) {
    std::string text = "# timestamp filename\n";
    for (int i = 0; i < 300; ++i) {
      text += absl::StrFormat("%.*f", decimals, first + i * step) + " a.png\n";
    }
    return text;
  };
  const struct {
    const char* unit;
    double per_second;
    const char* remedy;
  } kUnits[] = {{"milliseconds", 1e3, "divide by 1000"},
                {"microseconds", 1e6, "divide by 1000000"},
                {"nanoseconds", 1e9, "divide by 1000000000"}};
  for (const auto& unit : kUnits) {
    // Since 1970, as cameras and ROS write them: no date in seconds.
    EXPECT_THAT(ListError(list(1305031102.2 * unit.per_second, unit.per_second / 30, 0)),
                AllOf(HasSubstr("rgb.txt:2: "), HasSubstr(unit.unit), HasSubstr(unit.remedy)));
    // Since the recording began, at several rates.
    for (const double fps : {5.0, 30.0, 120.0}) {
      EXPECT_THAT(ListError(list(0, unit.per_second / fps, 0)),
                  AllOf(HasSubstr("rgb.txt:3: time stamps are in seconds"), HasSubstr(unit.unit),
                        HasSubstr(unit.remedy)))
          << fps;
    }
  }
  // A picture a second, or one long pause, is slow and no other unit.
  Write("rgb.txt", list(0, 1.0, 3));
  EXPECT_TRUE(LoadImageList(folder_ / "rgb.txt").ok());
  Write("rgb.txt", "0 a.png\n0.03 b.png\n3600 c.png\n3600.03 d.png\n3600.06 e.png\n");
  EXPECT_TRUE(LoadImageList(folder_ / "rgb.txt").ok());
  Write("rgb.txt", "0 a.png\n3600 b.png\n");
  EXPECT_TRUE(LoadImageList(folder_ / "rgb.txt").ok());
  EXPECT_THAT(ListError("7200.0 a.png\n3600.0 b.png\n"),
              AllOf(HasSubstr("rgb.txt:2:"), HasSubstr("if the clock was set back here")));
}

TEST_F(Parsers, ImageListTakesWindowsFilesAndNamesWithSpaces) {
  Write("rgb.txt", "\xEF\xBB\xBF# head\r\n1.5 rgb/a b.png\r\n\r\n2.5\trgb/c.png \r\n");
  const auto list = LoadImageList(folder_ / "rgb.txt");
  ASSERT_TRUE(list.ok()) << list.status();
  ASSERT_EQ(list->size(), 2);
  EXPECT_EQ(list->at(0).file, "rgb/a b.png");
  EXPECT_EQ(list->at(0).timestamp, "1.5");
  EXPECT_EQ(list->at(1).file, "rgb/c.png");
  EXPECT_EQ(list->at(1).line, 4);
}

TEST_F(Parsers, PatchTargetIsReadWithItsTemplates) {
  cv::imwrite((folder_ / "p.pgm").string(), cv::Mat(11, 11, CV_8UC1, cv::Scalar(7)));
  Write("target.yaml",
        "type: patches\npoints:\n  - {id: 4, point_in_world_m: [1, 2, -3], template: p.pgm}\n");
  const auto target = LoadTarget(folder_ / "target.yaml");
  ASSERT_TRUE(target.ok()) << target.status();
  const auto& patches = std::get<PatchTarget>(*target);
  ASSERT_EQ(patches.points.size(), 1);
  EXPECT_EQ(patches.points[0].id, 4);
  EXPECT_EQ(patches.points[0].point_in_world, Eigen::Vector3d(1, 2, -3));
  EXPECT_EQ(patches.points[0].templ.at<std::uint8_t>(5, 5), 7);
}

TEST_F(Parsers, TargetErrorsNameTheEntry) {
  cv::imwrite((folder_ / "even.pgm").string(), cv::Mat(10, 10, CV_8UC1, cv::Scalar(7)));
  cv::imwrite((folder_ / "p.pgm").string(), cv::Mat(11, 11, CV_8UC1, cv::Scalar(7)));
  const std::string head = "type: patches\npoints:\n";
  EXPECT_THAT(TargetError(head + "  - {id: 0, point_in_world_m: [0, 0, 0], template: gone.pgm}\n"),
              AllOf(HasSubstr("target.yaml:3: template"), HasSubstr("gone.pgm")));
  EXPECT_THAT(TargetError(head + "  - {id: 0, point_in_world_m: [0, 0, 0], template: even.pgm}\n"),
              AllOf(HasSubstr("10x10"), HasSubstr("odd side")));
  EXPECT_THAT(TargetError(head + "  - {id: 0, point_in_world_m: [0, 0], template: p.pgm}\n"),
              HasSubstr("has 2 numbers; give 3"));
  const std::string one = "  - {id: 0, point_in_world_m: [0, 0, 0], template: p.pgm}\n";
  EXPECT_THAT(TargetError(head + one + one), HasSubstr("target.yaml:4: id: 0 occurs twice"));
  EXPECT_THAT(TargetError("type: patches\npoints: []\n"), HasSubstr("is empty"));
  EXPECT_THAT(TargetError("type: blobs\n"), HasSubstr("use patches or chessboard"));
  EXPECT_THAT(TargetError("type: chessboard\ncolumns: 9\nrows: 6\nsquare_m: 0\n"),
              HasSubstr("square_m"));
}

TEST_F(Parsers, ChessboardHintIsThreePixels) {
  Write("target.yaml",
        "type: chessboard\ncolumns: 9\nrows: 6\nsquare_m: 0.04\nhint_px: [1, 2, 3, 4, 5, 6]\n");
  const auto target = LoadTarget(folder_ / "target.yaml");
  ASSERT_TRUE(target.ok()) << target.status();
  const auto& board = std::get<ChessboardTarget>(*target);
  ASSERT_TRUE(board.hint_px);
  EXPECT_EQ(board.hint_px->at(2), Eigen::Vector2d(5, 6));
}

TEST_F(Parsers, StartRefusesAQuaternionThatIsNotUnit) {
  const std::string good =
      "position_m: [0, 0, -0.6]\nposition_sigma_m: 0.02\norientation_xyzw: [0, 0, 0, 1]\n"
      "orientation_sigma_rad: 0\n";
  Write("start.yaml", good);
  const auto start = LoadStart(folder_ / "start.yaml");
  ASSERT_TRUE(start.ok()) << start.status();
  EXPECT_EQ(start->world_from_camera.translation.z(), -0.6);
  EXPECT_EQ(start->velocity_sigma_m_s, 0.1);  // its default
  Write("start.yaml", Replaced(good, "[0, 0, 0, 1]", "[0, 0, 0, 2]"));
  EXPECT_THAT(LoadStart(folder_ / "start.yaml").status().message(),
              AllOf(HasSubstr("start.yaml:3: orientation_xyzw"), HasSubstr("x y z w")));
}

}  // namespace
}  // namespace saccade::parsers_test
