#include "shared/wire/from_proto.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace saccade::from_proto_test {
namespace {

using ::testing::StartsWith;

constexpr wire::ImageSize kImage{640, 480};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

v1::AnnotationDraft GoodDraft() {
  v1::AnnotationDraft draft;
  draft.set_shape(v1::ANNOTATION_SHAPE_CUBE);
  auto& target = *draft.mutable_target()->mutable_frame_pixel();
  target.set_frame_id(12);
  target.mutable_pixel()->set_u(319.5);
  target.mutable_pixel()->set_v(239.5);
  return draft;
}

std::string ErrorOf(const v1::AnnotationDraft& draft) {
  const auto result = wire::FromProto(draft, kImage);
  if (!result.ok()) {
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  }
  return std::string(result.status().message());
}

TEST(DraftFromProto, DefaultsAreFilledIn) {
  const auto draft = wire::FromProto(GoodDraft(), kImage);
  ASSERT_TRUE(draft.ok()) << draft.status();
  EXPECT_EQ(draft->size_m, 0.05);
  EXPECT_EQ(draft->color_rgba, 0xffffffffu);
  const auto& target = std::get<PixelTarget>(draft->target);
  EXPECT_EQ(target.frame_id, 12u);
  EXPECT_EQ(target.pixel, Eigen::Vector2d(319.5, 239.5));
}

TEST(DraftFromProto, ThePictureReachesHalfAPixelBeyondItsOutermostCentres) {
  auto draft = GoodDraft();
  auto& pixel = *draft.mutable_target()->mutable_frame_pixel()->mutable_pixel();
  for (const double u : {-0.5, 0.0, 639.5}) {
    pixel.set_u(u);
    EXPECT_EQ(ErrorOf(draft), "") << u;
  }
  for (const double u : {-0.51, 639.51, 1e300, -1e300, kNan, kInfinity, -kInfinity}) {
    pixel.set_u(u);
    EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target.frame_pixel.pixel.u: ")) << u;
  }
  pixel.set_u(0);
  pixel.set_v(480);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target.frame_pixel.pixel.v: "));
  draft.mutable_target()->mutable_frame_pixel()->clear_pixel();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target.frame_pixel.pixel: "));
}

TEST(DraftFromProto, EveryWrongFieldIsNamed) {
  auto draft = GoodDraft();
  draft.set_shape(v1::ANNOTATION_SHAPE_UNSPECIFIED);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.shape: "));
  draft.set_shape(static_cast<v1::AnnotationShape>(77));
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.shape: "));
  draft = GoodDraft();
  for (const double size : {-1.0, 1e-9, 10.1, kNan, kInfinity}) {
    draft.set_size_m(size);
    EXPECT_THAT(ErrorOf(draft), StartsWith("draft.size_m: ")) << size;
  }
  draft = GoodDraft();
  draft.set_text(std::string(500, 'x'));
  EXPECT_EQ(ErrorOf(draft), "");
  draft.set_text(std::string(501, 'x'));
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.text: "));
  draft.set_text("bell \a");
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.text: "));
  draft = GoodDraft();
  draft.clear_target();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target: "));
  draft.mutable_target()->mutable_point_in_world_m()->set_y(kNan);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target.point_in_world_m.y: "));
  draft.mutable_target()->mutable_point_in_world_m()->set_y(1e9);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target.point_in_world_m.y: "));
  draft.mutable_target()->mutable_ray();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target.ray.direction_in_world: "));
}

TEST(DraftFromProto, AStrokeBelongsToInkAndToAFrame) {
  auto draft = GoodDraft();
  draft.add_ink_px();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_px: "));
  draft.set_shape(v1::ANNOTATION_SHAPE_INK);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_px: "));  // one point
  draft.add_ink_px()->set_u(10);
  EXPECT_EQ(ErrorOf(draft), "");
  draft.mutable_ink_px(1)->set_v(kNan);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_px[1].v: "));
  draft.mutable_ink_px(1)->set_v(3);
  draft.mutable_target()->set_feature_id(4);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.target: "));
  draft = GoodDraft();
  draft.set_shape(v1::ANNOTATION_SHAPE_INK);
  for (std::size_t i = 0; i < kMaxInkPoints + 1; ++i) draft.add_ink_px();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_px: "));
}

TEST(CheckUuid, TakesUuidsAndNothingElse) {
  EXPECT_TRUE(wire::CheckUuid("6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11", "id").ok());
  EXPECT_TRUE(wire::CheckUuid("6F1C2C9E-3D43-4D0A-9F5E-0C9B1A7F2D11", "id").ok());
  for (const char* bad :
       {"", "x", "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d1", "../../../etc/passwd",
        "6f1c2c9e3d434d0a9f5e0c9b1a7f2d1100000", "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d1g"}) {
    EXPECT_FALSE(wire::CheckUuid(bad, "id").ok()) << bad;
  }
}

// Random bytes that happen to parse, and random mutations of a good request: never a crash, and
// what passes is finite and inside the picture.
void ExpectSound(const v1::AnnotationDraft& message) {
  const auto draft = wire::FromProto(message, kImage);
  if (!draft.ok()) {
    EXPECT_THAT(std::string(draft.status().message()), StartsWith("draft"));
    return;
  }
  EXPECT_TRUE(std::isfinite(draft->size_m) && draft->size_m > 0 && draft->size_m <= 10);
  EXPECT_LE(draft->text.size(), 500u);
  if (const auto* pixel = std::get_if<PixelTarget>(&draft->target)) {
    EXPECT_TRUE(pixel->pixel.allFinite() && pixel->pixel.minCoeff() >= -0.5);
  }
  if (const auto* point = std::get_if<PointTarget>(&draft->target)) {
    EXPECT_TRUE(point->point_in_world.allFinite());
  }
}

TEST(DraftFromProto, SurvivesRandomBytes) {
  std::mt19937 random(1);
  int parsed = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes(random() % 60, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    v1::AnnotationDraft message;
    if (!message.ParseFromString(bytes)) continue;
    ++parsed;
    ExpectSound(message);
  }
  EXPECT_GT(parsed, 100);
}

TEST(DraftFromProto, SurvivesMutatedRequests) {
  std::mt19937 random(2);
  auto ink = GoodDraft();
  ink.set_shape(v1::ANNOTATION_SHAPE_INK);
  for (int i = 0; i < 5; ++i) ink.add_ink_px()->set_u(i);
  int parsed = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = (i % 2 == 0 ? GoodDraft() : ink).SerializeAsString();
    for (unsigned k = 0; k < 1 + random() % 4; ++k) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    v1::AnnotationDraft message;
    if (!message.ParseFromString(bytes)) continue;
    ++parsed;
    ExpectSound(message);
  }
  EXPECT_GT(parsed, 1000);
}

}  // namespace
}  // namespace saccade::from_proto_test
