#include "server/eval/claims.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace saccade::claims_test {
namespace {

CameraModel Camera() {
  CameraIntrinsics c;
  c.width = 640;
  c.height = 480;
  c.fx = c.fy = 500;
  c.cx = 320;
  c.cy = 240;
  return CameraModel(c);
}

const Eigen::Vector3d kPoint(0, 0, 2);

/// A mark that is `off_m` off along the ray, in a map that is `scale` times too small.
std::vector<Annotation> Marks(AnchorState state, double off_m, double claimed_m,
                              double scale = 1.0) {
  Annotation mark;
  mark.id = "a";
  mark.anchor.state = state;
  mark.anchor.method = AnchorMethod::kPlane;
  mark.anchor.point_in_world = (kPoint + Eigen::Vector3d(0, 0, off_m)) / scale;
  mark.anchor.error_m = claimed_m / scale;
  mark.anchor.error_px = 0.5;
  return {mark};
}

class Claims : public ::testing::Test {
 protected:
  Claims() { log_.Place({"a", 1, 10.0, {320, 240}, 2.0, false, kPoint}); }
  void Show(double time_s, const std::vector<Annotation>& marks, bool metric = true) {
    log_.Observe({time_s, true, metric, &camera_, {}, {}}, marks,
                 [](const Eigen::Vector3d&) { return true; });
  }
  nlohmann::ordered_json Report(double scale = 1.0) const {
    ClaimTotals totals;
    totals.Add(log_, scale);
    return totals.Report();
  }
  const CameraModel camera_ = Camera();
  ClaimLog log_;
};

TEST_F(Claims, AreTakenOnceASecondAndHeldAgainstTheTruth) {
  for (int k = 0; k < 120; ++k) {
    Show(10.0 + k / 30.0, Marks(AnchorState::kTracking, k < 30 ? 0.10 : 0.01, 0.02));
  }
  ASSERT_EQ(log_.claims().size(), 4u);
  EXPECT_NEAR(log_.claims()[3].age_s(), 3.0, 1e-6);
  const auto report = Report();
  EXPECT_EQ(report["tracking"]["length"]["sightings"], 4);
  EXPECT_DOUBLE_EQ(report["tracking"]["length"]["beyond_3_sigma"], 0.25);
  EXPECT_NEAR(report["tracking"]["length"]["median_error_over_claim"], 0.5, 1e-9);
  EXPECT_EQ(report["far_anchors"], 1);
  EXPECT_EQ(report["far_unsaid_anchors"], 1);
  EXPECT_DOUBLE_EQ(report["by_method"]["plane"]["length"]["beyond_3_sigma"], 0.25);
  EXPECT_DOUBLE_EQ(report["by_age"]["0 to 1 s"]["length"]["beyond_3_sigma"], 1.0);
  EXPECT_DOUBLE_EQ(report["by_age"]["3 to 10 s"]["length"]["beyond_3_sigma"], 0.0);
}

TEST_F(Claims, OnlyWhoClaimsToBeTrackingIsHeldToIt) {
  Show(10, Marks(AnchorState::kPaused, 0.5, 0.01));
  Show(11, Marks(AnchorState::kProvisional, 0.5, 0.01));
  Show(14.5, Marks(AnchorState::kTracking, 0.01, 0.01));
  const auto report = Report();
  EXPECT_EQ(report["sightings"], 3);
  EXPECT_EQ(report["tracking"]["length"]["sightings"], 1);
  EXPECT_EQ(report["far_anchors"], 0);
  EXPECT_DOUBLE_EQ(report["tracking_within_3s"], 0.0) << "trusted after 4.5 s";
}

TEST_F(Claims, AMapWithoutMetresIsScaledByItsWholeTrajectory) {
  Show(10, Marks(AnchorState::kTracking, 0.03, 0.02, /*scale=*/5.0), /*metric=*/false);
  EXPECT_NEAR(Report(5.0)["tracking"]["length"]["median_error_over_claim"], 1.5, 1e-9);
}

TEST_F(Claims, FileSaysMillimetresOfMetricMapsAlone) {
  Show(10, Marks(AnchorState::kTracking, 0.03, 0.02));
  Show(11, Marks(AnchorState::kTracking, 0.03, 0.02), /*metric=*/false);
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("claims-" + std::to_string(::getpid()) + ".csv");
  ASSERT_TRUE(log_.Write(file, 1.0).ok());
  std::ifstream stream(file);
  std::string head, metric, free;
  std::getline(stream, head);
  std::getline(stream, metric);
  std::getline(stream, free);
  std::filesystem::remove(file);
  EXPECT_EQ(head.find("time_s,anchor,state,method,age_s,posed,metric,claimed_mm,error_mm,"), 0u);
  EXPECT_EQ(metric.find("10.00,1,tracking,plane,0.00,1,1,20.00,30.00,0.500,"), 0u) << metric;
  EXPECT_EQ(free.find("11.00,1,tracking,plane,1.00,1,0,,30.00,0.500,"), 0u) << free;
  EXPECT_NE(free.find(",1.000,1.500,"), std::string::npos) << "shares of the distance: " << free;
}

}  // namespace
}  // namespace saccade::claims_test
