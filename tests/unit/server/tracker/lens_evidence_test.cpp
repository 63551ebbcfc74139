// A wrong lens file is found out by what residuals do, and a right one is never blamed.
#include "server/tracker/lens_evidence.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <random>

#include "server/capture/dataset.hpp"
#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::lens_evidence_test {
namespace {

using ::testing::HasSubstr;

constexpr char kWords[] = "The lens file does not fit: residuals grow with the radius";

CameraIntrinsics Lens(LensModel model, std::array<double, 5> distortion = {}) {
  return {.model = model,
          .width = 640,
          .height = 480,
          .fx = 458,
          .fy = 459,
          .cx = 322,
          .cy = 238,
          .distortion = distortion};
}

/// Fits `told` to what `truth` sees of 60 points from 12 places, with 0.3 px of noise.
std::optional<LensFit> FitTo(const CameraIntrinsics& truth, const CameraIntrinsics& told) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.3);
  std::map<FeatureId, Eigen::Vector3d> points;
  for (FeatureId id = 1; id <= 60; ++id) {
    points[id] = {1.6 * unit(random), 1.2 * unit(random), 2.0 + 0.8 * unit(random)};
  }
  const CameraModel camera(truth);
  std::vector<LensView> views;
  for (int k = 0; k < 12; ++k) {
    LensView view;
    view.world_from_camera.translation = 0.4 * Eigen::Vector3d(unit(random), unit(random), 0.5);
    view.world_from_camera.rotation =
        ExpQuaternion(0.25 * Eigen::Vector3d(unit(random), unit(random), unit(random)));
    for (const auto& [id, point] : points) {
      const auto pixel = camera.Project(view.world_from_camera.Inverse() * point);
      if (!pixel || !camera.InImage(*pixel)) continue;
      view.seen.push_back({id, *pixel + Eigen::Vector2d(noise(random), noise(random))});
    }
    if (k > 0) view.world_from_camera.translation += 0.01 * Eigen::Vector3d::Random();
    views.push_back(std::move(view));
  }
  return FitLens(CameraModel(told), std::move(views), points);
}

TEST(LensFit, FindsNothingAgainstARightLens) {
  for (const CameraIntrinsics& lens :
       {Lens(LensModel::kPinhole), Lens(LensModel::kBrownConrady, {-0.28, 0.07, 0, 0, 0}),
        Lens(LensModel::kKannalaBrandt), Lens(LensModel::kFov, {0.9})}) {
    const auto fit = FitTo(lens, lens);
    ASSERT_TRUE(fit);
    EXPECT_LT(std::abs(fit->stretch[1]), 4.0 * std::sqrt(fit->covariance(1, 1)));
    EXPECT_LT(std::abs(fit->stretch[1]), 0.01);
    EXPECT_NEAR(fit->best_rms_px, 0.26, 0.05);  // 0.3 px, less what poses and points take up
  }
}

TEST(LensFit, MeasuresHowAWrongLensGrowsWithTheRadius) {
  // 0.5 hypot(640, 480) / 458: rho = 1 is the tangent 0.873 of a pinhole camera.
  const auto barrel =
      FitTo(Lens(LensModel::kBrownConrady, {-0.1, 0, 0, 0, 0}), Lens(LensModel::kPinhole));
  ASSERT_TRUE(barrel);
  EXPECT_NEAR(barrel->stretch[1], -0.1 * 0.873 * 0.873, 0.01);
  const auto cushion =
      FitTo(Lens(LensModel::kBrownConrady, {0.1, 0, 0, 0, 0}), Lens(LensModel::kPinhole));
  ASSERT_TRUE(cushion);
  EXPECT_NEAR(cushion->stretch[1], 0.1 * 0.873 * 0.873, 0.01);
  const auto equidistant = FitTo(Lens(LensModel::kKannalaBrandt), Lens(LensModel::kPinhole));
  ASSERT_TRUE(equidistant);
  EXPECT_LT(equidistant->stretch[1], -0.1);
}

LensFit Fitted(double growth, double sigma = 0.01) {
  LensFit fit;
  fit.stretch[1] = growth;
  fit.covariance(1, 1) = sigma * sigma;
  return fit;
}

TEST(LensEvidence, SpeaksOnlyWhenMostFitsAgree) {
  LensEvidence evidence{LensEvidenceOptions()};
  for (int k = 0; k < 4; ++k) evidence.Judge(Fitted(-0.2));
  EXPECT_FALSE(evidence.Growth()) << "too few";
  evidence.Judge(std::nullopt);
  EXPECT_FALSE(evidence.Growth()) << "a fit that failed says nothing";
  evidence.Judge(Fitted(-0.1));
  ASSERT_TRUE(evidence.Growth());
  EXPECT_EQ(*evidence.Growth(), -0.2);
  for (int k = 0; k < 3; ++k) evidence.Judge(Fitted(0.01));
  EXPECT_FALSE(evidence.Growth()) << "taken back";
}

TEST(LensEvidence, HeedsNeitherBothDirectionsNorLargeSigmasNorSmallGrowth) {
  LensEvidence both{LensEvidenceOptions()}, vague{LensEvidenceOptions()},
      small{LensEvidenceOptions()};
  for (int k = 0; k < 20; ++k) {
    both.Judge(Fitted(k % 2 == 0 ? 0.2 : -0.2));
    vague.Judge(Fitted(0.2, 0.1));
    small.Judge(Fitted(0.05, 0.001));
    EXPECT_FALSE(both.Growth() || vague.Growth() || small.Growth());
  }
}

/// Runs `source` on a tracker that is told `told`; whether it ever said that the lens is wrong.
bool IsBlamed(FrameSource& source, const CameraIntrinsics& told) {
  const auto camera = std::make_shared<const CameraModel>(told);
  SourceInfo info = source.info();
  info.camera = camera;
  TrackerOptions options;
  const auto tracker = Tracker::Create(info, options);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  for (auto frame = source.Next(); frame.ok() && *frame; frame = source.Next()) {
    (*frame)->camera = camera;
    const auto snapshot = (*tracker)->Track(**frame);
    if (snapshot->advice.find(kWords) == 0) return true;
  }
  return false;
}

bool SimIsBlamed(LensModel truth, LensModel told) {
  SimOptions sim;
  sim.duration_s = told == truth ? 6.0 : 12.0;  // at most
  sim.lens = truth;
  auto source = SimSource::Open(sim);
  EXPECT_TRUE(source.ok()) << source.status();
  CameraIntrinsics lens = (*source)->info().camera->intrinsics();
  if (told != truth) lens.model = told, lens.distortion = {};
  return IsBlamed(**source, lens);
}

TEST(LensEvidence, EquidistantLensCalledBrownConradyIsFoundOutOnASimulatedRecording) {
  EXPECT_TRUE(SimIsBlamed(LensModel::kKannalaBrandt, LensModel::kBrownConrady));
}

TEST(LensEvidence, RightLensesOfTheSimulatorAreNotBlamed) {
  EXPECT_FALSE(SimIsBlamed(LensModel::kKannalaBrandt, LensModel::kKannalaBrandt));
  EXPECT_FALSE(SimIsBlamed(LensModel::kBrownConrady, LensModel::kBrownConrady));
}

TEST(LensEvidence, DroppedDistortionIsFoundOutOnRecordingsAndRightFilesAreNotBlamed) {
  const std::filesystem::path root = SACCADE_SOURCE_DIR "/../shared/data";
  int run = 0;
  for (const char* name : {"hall_imu", "checkerboard"}) {
    if (!std::filesystem::exists(root / name / "camera.yaml")) continue;
    for (const bool dropped : {false, true}) {
      auto source = OpenDataset(root / name, {});
      ASSERT_TRUE(source.ok()) << source.status();
      CameraIntrinsics lens = (*source)->info().camera->intrinsics();
      if (dropped) lens.model = LensModel::kPinhole, lens.distortion = {};
      EXPECT_EQ(IsBlamed(**source, lens), dropped) << name;
    }
    ++run;
  }
  if (run == 0) GTEST_SKIP() << "none of ../shared/data's recordings is here";
}

TEST(LensWords, SayWhatAndHowMuch) {
  EXPECT_THAT(LensWords(-0.214), HasSubstr("-21 % from the centre to the corner"));
  EXPECT_THAT(LensWords(-0.214), HasSubstr(kWords));
}

}  // namespace
}  // namespace saccade::lens_evidence_test
