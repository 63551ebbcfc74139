// Each field of the shapes beyond cube, note, arrow and ink: its limits, and its name in the error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::marks_test {
namespace {

using ::testing::StartsWith;

constexpr wire::ImageSize kImage{640, 480};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr char kId[] = "6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";

v1::AnnotationDraft Draft(v1::AnnotationShape shape) {
  v1::AnnotationDraft draft;
  draft.set_shape(shape);
  draft.mutable_target()->mutable_point_in_world_m()->set_z(1);
  if (shape == v1::ANNOTATION_SHAPE_MEASURE) draft.mutable_end_target()->set_feature_id(7);
  if (shape == v1::ANNOTATION_SHAPE_PICTURE) draft.set_picture("bytes");
  if (shape == v1::ANNOTATION_SHAPE_CHECK_LIST) draft.add_check_items("oil");
  return draft;
}

std::string ErrorOf(const v1::AnnotationDraft& draft) {
  return std::string(wire::FromProto(draft, kImage).status().message());
}

TEST(Marks, EveryShapeIsTaken) {
  for (int shape = v1::ANNOTATION_SHAPE_BOX; shape <= v1::ANNOTATION_SHAPE_CHECK_LIST; ++shape) {
    EXPECT_EQ(ErrorOf(Draft(static_cast<v1::AnnotationShape>(shape))), "") << shape;
  }
}

TEST(Marks, WhatAShapeDoesNotHaveIsRefusedByName) {
  const auto refused = [](v1::AnnotationShape shape, auto give) {
    v1::AnnotationDraft draft = Draft(shape);
    give(draft);
    return ErrorOf(draft);
  };
  const auto turn = [](v1::AnnotationDraft& d) { d.mutable_world_from_mark()->set_w(1); };
  const auto extent = [](v1::AnnotationDraft& d) { *d.mutable_extent_m() = {}; };
  const auto end = [](v1::AnnotationDraft& d) { d.mutable_end_target()->set_feature_id(1); };
  const auto picture = [](v1::AnnotationDraft& d) { d.set_picture("x"); };
  const auto item = [](v1::AnnotationDraft& d) { d.add_check_items("x"); };
  const auto offset = [](v1::AnnotationDraft& d) { d.add_ink_offset_m(); };
  EXPECT_THAT(refused(v1::ANNOTATION_SHAPE_CUBE, turn), StartsWith("draft.world_from_mark: "));
  EXPECT_THAT(refused(v1::ANNOTATION_SHAPE_ARROW, extent), StartsWith("draft.extent_m: "));
  EXPECT_THAT(refused(v1::ANNOTATION_SHAPE_BOX, end), StartsWith("draft.end_target: "));
  EXPECT_THAT(refused(v1::ANNOTATION_SHAPE_NOTE, picture), StartsWith("draft.picture: "));
  EXPECT_THAT(refused(v1::ANNOTATION_SHAPE_NOTE, item), StartsWith("draft.check_items: "));
  EXPECT_THAT(refused(v1::ANNOTATION_SHAPE_PIN, offset), StartsWith("draft.ink_offset_m: "));
}

TEST(Marks, BoxesHaveEdgesAndATurn) {
  v1::AnnotationDraft draft = Draft(v1::ANNOTATION_SHAPE_BOX);
  v1::Vector3& extent = *draft.mutable_extent_m();
  extent.set_x(0.1), extent.set_y(10), extent.set_z(0.001);
  draft.mutable_world_from_mark()->set_y(1);
  const auto read = wire::FromProto(draft, kImage);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read->extent_m, Eigen::Vector3d(0.1, 10, 0.001));
  EXPECT_EQ(read->world_from_mark->y(), 1.0);
  for (const double bad : {0.0, -1.0, 10.1, 1e-9, kNan}) {
    extent.set_y(bad);
    EXPECT_THAT(ErrorOf(draft), StartsWith("draft.extent_m.y: ")) << bad;
  }
  extent.set_y(1);
  for (const double bad : {0.0, 2.0, kNan}) {
    draft.mutable_world_from_mark()->set_y(bad);
    EXPECT_THAT(ErrorOf(draft), StartsWith("draft.world_from_mark: ")) << bad;
  }
}

TEST(Marks, AMeasureHasOneOtherEnd) {
  v1::AnnotationDraft draft = Draft(v1::ANNOTATION_SHAPE_MEASURE);
  draft.clear_end_target();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.end_target: "));
  draft.add_ink_offset_m()->set_x(1);
  EXPECT_EQ(ErrorOf(draft), "");
  draft.mutable_end_target()->set_feature_id(3);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_offset_m: "));
  draft.clear_end_target();
  draft.add_ink_offset_m();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.end_target: "));
  draft = Draft(v1::ANNOTATION_SHAPE_MEASURE);
  draft.mutable_end_target()->mutable_frame_pixel()->mutable_pixel()->set_u(641);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.end_target.frame_pixel.pixel.u: "));
}

TEST(Marks, InkIsGivenInPixelsOrAsOffsetsNotBoth) {
  v1::AnnotationDraft draft = Draft(v1::ANNOTATION_SHAPE_INK);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_px: "));
  draft.add_ink_offset_m();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_offset_m: "));
  draft.add_ink_offset_m()->set_x(0.1);
  EXPECT_EQ(ErrorOf(draft), "") << "any target will do";
  draft.mutable_ink_offset_m(1)->set_z(kNan);
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_offset_m[1].z: "));
  draft.mutable_ink_offset_m(1)->set_z(0);
  draft.add_ink_px();
  draft.add_ink_px();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_offset_m: "));
  draft.clear_ink_px();
  for (std::size_t i = 0; i < kMaxInkPoints; ++i) draft.add_ink_offset_m();
  EXPECT_THAT(ErrorOf(draft), StartsWith("draft.ink_offset_m: at most"));
}

TEST(Marks, CheckListsAndPicturesAreBounded) {
  v1::AnnotationDraft list = Draft(v1::ANNOTATION_SHAPE_CHECK_LIST);
  list.add_check_items(std::string(100, 'x'));
  EXPECT_EQ(ErrorOf(list), "");
  list.set_check_items(1, std::string(101, 'x'));
  EXPECT_THAT(ErrorOf(list), StartsWith("draft.check_items[1]: "));
  list.set_check_items(1, "two\nlines");
  EXPECT_THAT(ErrorOf(list), StartsWith("draft.check_items[1]: "));
  list.set_check_items(1, "");
  EXPECT_THAT(ErrorOf(list), StartsWith("draft.check_items[1]: "));
  list.clear_check_items();
  EXPECT_THAT(ErrorOf(list), StartsWith("draft.check_items: "));
  for (int i = 0; i < 31; ++i) list.add_check_items("x");
  EXPECT_THAT(ErrorOf(list), StartsWith("draft.check_items: "));
  v1::AnnotationDraft picture = Draft(v1::ANNOTATION_SHAPE_PICTURE);
  picture.clear_picture();
  EXPECT_THAT(ErrorOf(picture), StartsWith("draft.picture: "));
  picture.set_picture(std::string(kMaxPictureBytes, 'x'));
  EXPECT_EQ(ErrorOf(picture), "");
  picture.set_picture(std::string(kMaxPictureBytes + 1, 'x'));
  EXPECT_THAT(ErrorOf(picture), StartsWith("draft.picture: "));
}

TEST(Marks, APatchNamesItsFields) {
  v1::UpdateAnnotationRequest request;
  const auto error = [&request] {
    return std::string(wire::FromProto(request, kImage).status().message());
  };
  EXPECT_THAT(error(), StartsWith("id: "));
  request.set_id(kId);
  EXPECT_EQ(error(), "");
  request.mutable_extent_m()->set_x(-1);
  EXPECT_THAT(error(), StartsWith("extent_m.x: "));
  request.clear_extent_m();
  request.mutable_world_from_mark();
  EXPECT_THAT(error(), StartsWith("world_from_mark: "));
  request.mutable_world_from_mark()->set_w(1);
  request.mutable_end_target();
  EXPECT_THAT(error(), StartsWith("end_target: "));
  request.mutable_end_target()->set_feature_id(2);
  request.set_locked(false);
  const auto patch = wire::FromProto(request, kImage);
  ASSERT_TRUE(patch.ok()) << patch.status();
  EXPECT_EQ(patch->locked, false);
  EXPECT_TRUE(patch->end_target.has_value());
}

TEST(Marks, GroupsAreShortAndOneLine) {
  EXPECT_TRUE(wire::CheckEditGroup("").ok());
  EXPECT_TRUE(wire::CheckEditGroup(std::string(64, 'x')).ok());
  for (const std::string& bad : {std::string(65, 'x'), std::string("a\nb"), std::string("\a")}) {
    EXPECT_THAT(std::string(wire::CheckEditGroup(bad).message()), StartsWith("edit_group: "));
  }
}

TEST(Marks, GoOverTheWireAndBack) {
  Annotation in;
  in.id = kId;
  in.shape = AnnotationShape::kCheckList;
  in.author_person_id = "person";
  in.locked = true;
  in.check_items = std::make_shared<std::vector<CheckItem>>(
      std::vector<CheckItem>{{"oil", true, "Bob", 5}, {"lid", false, "", 0}});
  auto out = wire::FromProto(wire::ToProto(in), "annotation");
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->author_person_id, "person");
  EXPECT_TRUE(out->locked);
  EXPECT_EQ(*out->check_items, *in.check_items);

  in.shape = AnnotationShape::kMeasure;
  in.ink_offset_m = {{1, 2, 3}};
  in.length_m = 3.7;
  in.length_sigma_m = 0.01;
  in.number = 4;
  out = wire::FromProto(wire::ToProto(in), "annotation");
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->shape, AnnotationShape::kMeasure);
  EXPECT_EQ(out->length_m, 3.7);
  EXPECT_EQ(out->length_sigma_m, 0.01);
  EXPECT_EQ(out->number, 4u);
  in.ink_offset_m = {};
  EXPECT_FALSE(wire::FromProto(wire::ToProto(in), "annotation").ok());

  in.shape = AnnotationShape::kBox;
  in.extent_m = {1, 2, 3};
  in.world_from_mark = Eigen::Quaterniond(0, 1, 0, 0);
  in.picture = std::make_shared<Picture>(Picture{"hash", "image/png", 4, 3, "bytes"});
  out = wire::FromProto(wire::ToProto(in), "annotation");
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->extent_m, in.extent_m);
  EXPECT_EQ(out->world_from_mark->coeffs(), in.world_from_mark->coeffs());
  EXPECT_EQ(out->picture->sha256, "hash");
  EXPECT_EQ(out->picture->height, 3);
  EXPECT_EQ(out->picture->bytes, "") << "they come on their own";
}

}  // namespace
}  // namespace saccade::marks_test
