#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/calib3d.hpp>

#include "server/mount/drivers/sim_mount.hpp"
#include "tests/unit/server/sim/open_sim.hpp"

namespace saccade::driven_head_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(DrivenHead, ThePictureShowsWhatTheTurnedHeadSeesAndTheFrameSaysHowFar) {
  const std::unique_ptr<SimSource> source = OpenSim("desk?motion=still&noise=0");
  ASSERT_NE(source, nullptr);
  const auto head = std::make_shared<SimMount>(SimMountOptions());
  source->DriveHead(head);
  ASSERT_NE(source->info().mount, nullptr);
  head->AdvanceTo(0);
  MountDemand demand;
  demand.angles_rad = Eigen::Vector3d(-8, 4, 10) * kDegree;
  std::optional<Frame> last;
  for (int k = 0; k < 12; ++k) {
    ASSERT_TRUE(head->Send(demand).ok());
    const absl::StatusOr<std::optional<Frame>> frame = source->Next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    last = **frame;
    if (k == 0) {
      EXPECT_LT(std::abs(source->Truth(0).head.pan_rad), 1e-6) << "not there yet";
    }
  }
  const SimTruth truth = source->Truth(last->id);
  EXPECT_NEAR(truth.head.pan_rad, -8 * kDegree, 0.2 * kDegree);
  ASSERT_TRUE(last->mount);
  EXPECT_NEAR(last->mount->pan_rad, truth.head.pan_rad, 0.6 * kDegree);
  EXPECT_NE(last->mount->pan_rad, truth.head.pan_rad) << "encoders are not truth";
  std::vector<cv::Point2f> corners;
  const auto& board = std::get<ChessboardTarget>(*source->info().target);
  ASSERT_TRUE(cv::findChessboardCornersSB(last->grey, {board.columns, board.rows}, corners));
  if (corners.front().x > corners.back().x) std::reverse(corners.begin(), corners.end());
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto columns = static_cast<std::size_t>(board.columns);
    const auto pixel =
        source->PixelOf(last->id, {static_cast<double>(k % columns) * board.square_m,
                                   static_cast<double>(k / columns) * board.square_m, 0});
    ASSERT_TRUE(pixel);
    EXPECT_LT((Eigen::Vector2d(corners[k].x, corners[k].y) - *pixel).norm(), 0.4);
  }
}

TEST(DrivenHead, WithoutAHeadFramesCarryNoAngles) {
  const std::unique_ptr<SimSource> source = OpenSim("desk?motion=still");
  ASSERT_NE(source, nullptr);
  const absl::StatusOr<std::optional<Frame>> frame = source->Next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_FALSE((*frame)->mount);
  EXPECT_EQ(source->info().mount, nullptr);
}

}  // namespace
}  // namespace saccade::driven_head_test
