#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::round_trip_test {
namespace {

MapSnapshot MakeSnapshot() {
  MapSnapshot snapshot;
  snapshot.frame_id = 42;
  snapshot.capture_time_ns = 1'234;
  snapshot.status = TrackingStatus::kCoasting;
  snapshot.quality = TrackingQuality::kPoor;
  snapshot.advice = "move slowly";
  snapshot.metric = true;
  snapshot.world_from_camera.translation = {1, -2, 3};
  snapshot.world_from_camera.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  Matrix6d root = Matrix6d::Random();
  snapshot.pose_covariance = root * root.transpose();
  snapshot.velocity_in_world = {0.1, 0.2, 0.3};
  snapshot.angular_velocity_in_camera = {-0.1, 0, 1};
  snapshot.attempted = 9;
  snapshot.matched = 4;
  snapshot.map_revision = 3;
  return snapshot;
}

TEST(RoundTrip, Pose) {
  const MapSnapshot in = MakeSnapshot();
  const auto out = wire::FromProto(wire::ToProtoPose(in, in.capture_time_ns), "pose");
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->frame_id, in.frame_id);
  EXPECT_EQ(out->capture_time_ns, in.capture_time_ns);
  EXPECT_EQ(out->status, in.status);
  EXPECT_EQ(out->quality, in.quality);
  EXPECT_EQ(out->advice, in.advice);
  EXPECT_EQ(out->metric, in.metric);
  EXPECT_EQ(out->world_from_camera.translation, in.world_from_camera.translation);
  EXPECT_LT(RotationAngle(out->world_from_camera, in.world_from_camera), 1e-12);
  EXPECT_LT((out->pose_covariance - in.pose_covariance).norm(), 1e-12);
  EXPECT_EQ(out->velocity_in_world, in.velocity_in_world);
  EXPECT_EQ(out->angular_velocity_in_camera, in.angular_velocity_in_camera);
  EXPECT_EQ(out->matched, in.matched);
  EXPECT_EQ(out->map_revision, in.map_revision);
}

// proto/saccade/v1/geometry.proto states this number.
TEST(ToProto, TheWorkedQuaternionOfTheProtoFile) {
  const Eigen::Quaterniond right(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()));
  const v1::Quaternion q = wire::ToProto(right);
  EXPECT_NEAR(q.y(), 0.7071068, 1e-6);
  EXPECT_NEAR(q.w(), 0.7071068, 1e-6);
  EXPECT_LT((right * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(ToProto, CovarianceIsTheUpperTriangleRowByRow) {
  Eigen::Matrix3d m;
  m << 1, 2, 3, 2, 4, 5, 3, 5, 6;
  EXPECT_THAT(wire::ToProto(m).upper(), ::testing::ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(RoundTrip, FeatureAndAnnotation) {
  FeatureSnapshot feature;
  feature.id = 7;
  feature.state = FeatureState::kFailed;
  feature.point_in_world = {1, 2, 3};
  feature.covariance_in_world = 0.5 * Eigen::Matrix3d::Identity();
  feature.pixel = Eigen::Vector2d(3, 4);
  feature.matched_count = 9;
  const auto same = wire::FromProto(wire::ToProto(feature), "feature");
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->state, feature.state);
  EXPECT_EQ(same->pixel, feature.pixel);
  EXPECT_EQ(same->covariance_in_world, feature.covariance_in_world);

  Annotation ink;
  ink.id = "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";
  ink.shape = AnnotationShape::kInk;
  ink.text = "here";
  ink.anchor.state = AnchorState::kPaused;
  ink.anchor.method = AnchorMethod::kPlane;
  ink.anchor.error_m = 0.012;
  ink.anchor.error_px = 3.5;
  ink.anchor.reason = "lost";
  ink.ink_offset_m = {{0, 0, 0}, {0.1, 0, 0}};
  const v1::Annotation message = wire::ToProto(ink);
  EXPECT_DOUBLE_EQ(message.anchor().error_mm(), 12.0);
  const auto back = wire::FromProto(message, "annotation");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->shape, ink.shape);
  EXPECT_EQ(back->anchor.state, ink.anchor.state);
  EXPECT_EQ(back->anchor.method, ink.anchor.method);
  EXPECT_EQ(back->anchor.error_px, ink.anchor.error_px);
  EXPECT_EQ(back->ink_offset_m.size(), 2u);
}

TEST(RoundTrip, IntrinsicsOfEveryLens) {
  for (const LensModel model : {LensModel::kPinhole, LensModel::kRadial1, LensModel::kBrownConrady,
                                LensModel::kKannalaBrandt, LensModel::kFov}) {
    CameraIntrinsics in{
        .model = model, .width = 640, .height = 480, .fx = 500, .fy = 510, .cx = 320, .cy = 240};
    if (model != LensModel::kPinhole) in.distortion[0] = 1e-6;
    const auto out = wire::FromProto(wire::ToProto(in), "intrinsics");
    ASSERT_TRUE(out.ok()) << out.status();
    EXPECT_EQ(out->model, model);
    EXPECT_EQ(out->fy, 510);
    EXPECT_EQ(out->distortion, in.distortion);
  }
}

TEST(StateFromProto, BadStateIsNamed) {
  v1::PoseEvent pose = wire::ToProtoPose(MakeSnapshot(), 0);
  pose.mutable_world_from_camera()->mutable_rotation()->set_x(
      std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(std::string(wire::FromProto(pose, "pose").status().message()),
              ::testing::StartsWith("pose.world_from_camera.rotation: "));
  pose = wire::ToProtoPose(MakeSnapshot(), 0);
  pose.mutable_covariance()->mutable_upper()->RemoveLast();
  EXPECT_THAT(std::string(wire::FromProto(pose, "pose").status().message()),
              ::testing::StartsWith("pose.covariance.upper: "));
  pose = wire::ToProtoPose(MakeSnapshot(), 0);
  pose.set_status(static_cast<v1::TrackingStatus>(55));
  EXPECT_FALSE(wire::FromProto(pose, "pose").ok());
  v1::CameraIntrinsics intrinsics = wire::ToProto(
      CameraIntrinsics{.width = 640, .height = 480, .fx = 500, .fy = 510, .cx = 1, .cy = 2});
  intrinsics.set_fx_px(-1);
  EXPECT_FALSE(wire::FromProto(intrinsics, "intrinsics").ok());
}

}  // namespace
}  // namespace saccade::round_trip_test
