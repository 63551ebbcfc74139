#include "server/tracker/line_time.hpp"

#include <gtest/gtest.h>

namespace saccade::line_time_test {
namespace {

CameraModel Camera(int width, int height) {
  CameraIntrinsics lens;
  lens.width = width;
  lens.height = height;
  lens.fx = lens.fy = 500.0;
  lens.cx = 0.5 * width;
  lens.cy = 0.5 * height;
  return CameraModel(lens);
}

TEST(LineTime, RowsOfAWidePictureAreReadFromTheTop) {
  const CameraModel camera = Camera(640, 480);
  EXPECT_NEAR(LateInReadouts(camera, {10.0, -0.5}), -0.5, 1e-12);
  EXPECT_NEAR(LateInReadouts(camera, {600.0, 239.5}), 0.0, 1e-12);
  EXPECT_NEAR(LateInReadouts(camera, {600.0, 479.5}), 0.5, 1e-12);
}

// `tum_fr1_xyz` turned by 90 degrees, seeds 1 to 3: 0.91 to 1.02 cm by rows, 0.42 to 0.44 by
// columns (0.43 to 0.46 as it was taken).
TEST(LineTime, OfAnUprightOneTheLinesAreColumns) {
  const CameraModel camera = Camera(480, 640);
  EXPECT_NEAR(LateInReadouts(camera, {-0.5, 600.0}), -0.5, 1e-12);
  EXPECT_NEAR(LateInReadouts(camera, {239.5, 10.0}), 0.0, 1e-12);
}

TEST(LineTime, OutsideThePictureItIsThatOfTheEdge) {
  const CameraModel camera = Camera(640, 480);
  EXPECT_EQ(LateInReadouts(camera, {10.0, -100.0}), -0.5);
  EXPECT_EQ(LateInReadouts(camera, {10.0, 1000.0}), 0.5);
}

}  // namespace
}  // namespace saccade::line_time_test
