// Camera files that are wrong in ways people make them.
#include "server/capture/camera_files/plausibility.hpp"

#include <gmock/gmock.h>

#include "server/capture/camera_file.hpp"
#include "server/capture/dataset.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::plausibility_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

CameraIntrinsics Good() {
  return {.model = LensModel::kBrownConrady,
          .width = 640,
          .height = 480,
          .fx = 517.3,
          .fy = 516.5,
          .cx = 318.6,
          .cy = 255.3,
          .distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}};
}

class Plausibility : public DatasetFixture {
 protected:
  /// What is said of a camera.
  struct Said {
    std::string error;
    std::vector<std::string> warnings;
  };
  static Said Of(const CameraIntrinsics& lens) {
    CameraDraft draft;
    draft.file = "camera.yaml";
    draft.lens = lens;
    draft.told_lens = true;
    Said said;
    said.error = std::string(CheckPlausible(draft, said.warnings).message());
    return said;
  }
  static Said With(const std::function<void(CameraIntrinsics&)>& change) {
    CameraIntrinsics lens = Good();
    change(lens);
    return Of(lens);
  }
};

TEST_F(Plausibility, RightFilesOfTheRecordingsPassInSilence) {
  EXPECT_EQ(Of(Good()).error, "");
  EXPECT_THAT(Of(Good()).warnings, IsEmpty());
  int read = 0;
  const std::filesystem::path root = SACCADE_SOURCE_DIR "/../shared/data";
  for (const char* name : {"davison_desk", "tum_fr1_xyz", "tum_fr1_rpy", "checkerboard",
                           "apriltag_corner", "hall_imu", "kitchen"}) {
    if (!std::filesystem::exists(root / name / "camera.yaml")) continue;
    const auto lens = LoadCamera(root / name / "camera.yaml");
    ASSERT_TRUE(lens.ok()) << lens.status();
    EXPECT_THAT(Of(*lens).warnings, IsEmpty()) << name;
    ++read;
  }
  if (read == 0) GTEST_SKIP() << "none of ../shared/data's recordings is here";
}

TEST_F(Plausibility, FocalLengthInAnotherUnit) {
  const auto focal = [](double fx, double fy) {
    return With([&](CameraIntrinsics& lens) { lens.fx = fx, lens.fy = fy; }).error;
  };
  EXPECT_THAT(focal(4.2, 4.2), AllOf(HasSubstr("fx: 4.2 px makes a field of view of 178."),
                                     HasSubstr("millimetres"), HasSubstr("* 640")));
  EXPECT_THAT(focal(35, 35), HasSubstr("millimetres"));
  EXPECT_THAT(focal(0.0042, 0.0042), HasSubstr("metres"));
  const auto shares = With([](CameraIntrinsics& lens) {
    lens.fx = 0.81, lens.fy = 1.08, lens.cx = 0.498, lens.cy = 0.532;
  });
  EXPECT_THAT(shares.error, AllOf(HasSubstr("shares of the picture's size"),
                                  HasSubstr("fx and cx by 640, fy and cy by 480")));
}

TEST_F(Plausibility, FieldOfViewOfNoCameraOrOfFew) {
  const auto wide = [](LensModel model, double f) {
    return With([&](CameraIntrinsics& lens) {
      lens.model = model;
      lens.fx = lens.fy = f;
      lens.distortion = {};
    });
  };
  EXPECT_THAT(wide(LensModel::kPinhole, 40000).error, HasSubstr("field of view of 0.9"));
  EXPECT_THAT(wide(LensModel::kPinhole, 10000).warnings,
              ElementsAre(HasSubstr("fx: 10000 px"), HasSubstr("fy: 10000 px")));
  EXPECT_THAT(wide(LensModel::kKannalaBrandt, 170).error,
              AllOf(HasSubstr("fx: 170 px makes a field of view of 215"), HasSubstr("1 to 200")));
  EXPECT_EQ(wide(LensModel::kKannalaBrandt, 250).error, "");
}

TEST_F(Plausibility, CentreOnTheEdgeExchangedOrOfAnotherSize) {
  const auto centre = [](double cx, double cy) {
    return With([&](CameraIntrinsics& lens) { lens.cx = cx, lens.cy = cy; });
  };
  EXPECT_THAT(centre(0, 255.3).error,
              AllOf(HasSubstr("cx: 0 puts the optic axis"), HasSubstr("near 320")));
  EXPECT_THAT(centre(318.6, 0).error, AllOf(HasSubstr("cy: 0 puts"), HasSubstr("near 240")));
  EXPECT_THAT(centre(245, 318.6).error, HasSubstr("exchange them"));
  EXPECT_THAT(centre(159.3, 127.6).error,
              AllOf(HasSubstr("middle of a picture of about 319 x 255"), HasSubstr("fx: 10")));
  EXPECT_THAT(centre(-40, 255.3).warnings,
              ::testing::Contains(HasSubstr("cx: -40 is outside the picture")));
  EXPECT_THAT(centre(700, 255.3).warnings,
              ::testing::Contains(HasSubstr("cx: 700 is outside the picture")));
  EXPECT_THAT(centre(-700, 255.3).error, HasSubstr("cx: -700 is out of range"));
}

TEST_F(Plausibility, CoefficientsInAnotherOrder) {
  const auto bent = [](std::array<double, 5> distortion) {
    return With([&](CameraIntrinsics& lens) { lens.distortion = distortion; });
  };
  EXPECT_THAT(bent({0.2624, -0.9531, 1.1633, -0.0054, 0.0026}).error,
              AllOf(HasSubstr("k1, k2, k3, p1, p2"),
                    HasSubstr("[0.2624, -0.9531, -0.0054, 0.0026, 1.1633]")));
  EXPECT_THAT(bent({-0.0054, 0.0026, 0.2624, -0.9531, 1.1633}).error,
              AllOf(HasSubstr("p1 = 0.2624"), HasSubstr("[k1, k2, p1, p2, k3]")));
  EXPECT_THAT(bent({-0.28, 0.07, 0.0, 0.0002, 1.7e-05}).warnings,
              ::testing::Contains(HasSubstr("[-0.28, 0.07, 0.0002, 1.7e-05, 0]")));
  EXPECT_THAT(bent({-0.02, 0.09, -0.11, 0.04, 0}).error,
              AllOf(HasSubstr("equidistant"), HasSubstr("kannala_brandt"),
                    HasSubstr("[-0.02, 0.09, -0.11, 0.04]")));
  EXPECT_THAT(bent({-0.02, 0.011, -0.02, 0.0008, 0}).warnings,
              ::testing::Contains(HasSubstr("kannala_brandt")));
}

TEST_F(Plausibility, EquidistantLensCalledBrownConrady) {
  // TUM-VI's fisheye, under the wrong name.
  const auto said = With([](CameraIntrinsics& lens) {
    lens.width = lens.height = 512;
    lens.fx = lens.fy = 190.98, lens.cx = 254.9, lens.cy = 256.9;
    lens.distortion = {0.00348, 0.000715, -0.00205, 0.000203, 0};
  });
  EXPECT_EQ(said.error, "");
  EXPECT_THAT(said.warnings,
              ElementsAre(AllOf(HasSubstr("model: 107 deg wide"), HasSubstr("kannala_brandt"))));
}

TEST_F(Plausibility, LensThatTurnsBackInsideThePicture) {
  const auto bent = [](double k1) {
    return With([&](CameraIntrinsics& lens) {
      lens.fx = lens.fy = 400;
      lens.distortion = {k1, 0, 0, 0, 0};
    });
  };
  EXPECT_THAT(bent(-0.9).error, AllOf(HasSubstr("distortion: can be inverted at"),
                                      HasSubstr("of 81 places"), HasSubstr("px from the centre")));
  EXPECT_EQ(bent(-0.18).error, "");
  EXPECT_THAT(bent(-0.18).warnings, ElementsAre(HasSubstr("nothing is seen beyond")));
  EXPECT_THAT(bent(-0.1).warnings, IsEmpty());
}

TEST_F(Plausibility, FovLensInRadians) {
  const auto fov = [](double w) {
    return With([&](CameraIntrinsics& lens) {
      lens.model = LensModel::kFov;
      lens.fx = lens.fy = 400;
      lens.distortion = {w, 0, 0, 0, 0};
    });
  };
  EXPECT_EQ(fov(0.93).error, "");
  EXPECT_THAT(fov(53.3).error, AllOf(HasSubstr("radians"), HasSubstr("0.93")));
  EXPECT_THAT(fov(0).error, HasSubstr("pinhole"));
}

TEST_F(Plausibility, OneKeyTwiceIsRefusedByBothLines) {
  Write("camera.yaml", std::string(kCamera) + "fx: 61\n");
  EXPECT_THAT(LoadCamera(folder_ / "camera.yaml").status().message(),
              AllOf(HasSubstr("camera.yaml:10: fx: is on line 4 already"), HasSubstr("keep one")));
}

TEST_F(Plausibility, PicturesOfAnotherSizeAreToldTheWholeFile) {
  Write("camera.yaml",
        "model: brown_conrady\nwidth: 128\nheight: 96\nfx: 120\nfy: 120\ncx: 63.5\ncy: 47.5\n"
        "distortion: [0.1, 0, 0, 0, 0]\n");
  EXPECT_THAT(OpenDataset(folder_, {}).status().message(),
              AllOf(HasSubstr("is 64x48 but camera.yaml says 128x96"),
                    HasSubstr("{model: brown_conrady, width: 64, height: 48, fx: 60, fy: 60, cx: "
                              "31.5, cy: 23.5, distortion: [0.1, 0, 0, 0, 0], fps: 30}")));
  EXPECT_THAT(SizeRemedy(Good(), {480, 640}), HasSubstr("turn them"));
  EXPECT_THAT(SizeRemedy(Good(), {640, 360}), HasSubstr("they were cut"));
}

}  // namespace
}  // namespace saccade::plausibility_test
