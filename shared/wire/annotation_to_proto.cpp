#include "shared/wire/to_proto.hpp"

namespace saccade::wire {

v1::AnnotationShape ToProto(AnnotationShape shape) {
  switch (shape) {
    case AnnotationShape::kCube:
      return v1::ANNOTATION_SHAPE_CUBE;
    case AnnotationShape::kNote:
      return v1::ANNOTATION_SHAPE_NOTE;
    case AnnotationShape::kArrow:
      return v1::ANNOTATION_SHAPE_ARROW;
    case AnnotationShape::kInk:
      return v1::ANNOTATION_SHAPE_INK;
    case AnnotationShape::kBox:
      return v1::ANNOTATION_SHAPE_BOX;
    case AnnotationShape::kMeasure:
      return v1::ANNOTATION_SHAPE_MEASURE;
    case AnnotationShape::kPin:
      return v1::ANNOTATION_SHAPE_PIN;
    case AnnotationShape::kPicture:
      return v1::ANNOTATION_SHAPE_PICTURE;
    case AnnotationShape::kCheckList:
      return v1::ANNOTATION_SHAPE_CHECK_LIST;
  }
  return v1::ANNOTATION_SHAPE_UNSPECIFIED;
}

v1::Annotation ToProto(const Annotation& annotation) {
  v1::Annotation message;
  message.set_id(annotation.id);
  message.set_shape(ToProto(annotation.shape));
  message.set_text(annotation.text);
  message.set_author(annotation.author);
  message.set_size_m(annotation.size_m);
  message.set_color_rgba(annotation.color_rgba);
  message.set_created_unix_ns(annotation.created_unix_ns);
  message.set_revision(annotation.revision);
  *message.mutable_anchor() = ToProto(annotation.anchor);
  message.mutable_ink_offset_m()->Reserve(static_cast<int>(annotation.ink_offset_m.size()));
  for (const Eigen::Vector3d& offset : annotation.ink_offset_m) {
    *message.add_ink_offset_m() = ToProto(offset);
  }
  message.set_author_person_id(annotation.author_person_id);
  message.set_locked(annotation.locked);
  if (annotation.world_from_mark) {
    *message.mutable_world_from_mark() = ToProto(*annotation.world_from_mark);
  }
  if (annotation.shape == AnnotationShape::kBox) {
    *message.mutable_extent_m() = ToProto(annotation.extent_m);
  }
  message.set_number(annotation.number);
  message.set_length_m(annotation.length_m);
  message.set_length_sigma_m(annotation.length_sigma_m);
  if (annotation.picture) *message.mutable_picture() = ToProto(*annotation.picture);
  if (annotation.check_items) {
    for (const CheckItem& item : *annotation.check_items) {
      v1::CheckItem& line = *message.add_check_items();
      line.set_text(item.text);
      line.set_done(item.done);
      line.set_done_by(item.done_by);
      line.set_done_unix_ns(item.done_unix_ns);
    }
  }
  return message;
}

v1::PictureFacts ToProto(const Picture& picture) {
  v1::PictureFacts message;
  message.set_sha256(picture.sha256);
  message.set_media_type(picture.media_type);
  message.set_width(static_cast<std::uint32_t>(picture.width));
  message.set_height(static_cast<std::uint32_t>(picture.height));
  return message;
}

v1::AnnotationTarget ToProto(const AnnotationTarget& target) {
  v1::AnnotationTarget message;
  if (const auto* pixel = std::get_if<PixelTarget>(&target)) {
    message.mutable_frame_pixel()->set_frame_id(pixel->frame_id);
    *message.mutable_frame_pixel()->mutable_pixel() = ToProto(pixel->pixel);
  } else if (const auto* feature = std::get_if<FeatureTarget>(&target)) {
    message.set_feature_id(feature->feature_id);
  } else if (const auto* point = std::get_if<PointTarget>(&target)) {
    *message.mutable_point_in_world_m() = ToProto(point->point_in_world);
  } else if (const auto* ray = std::get_if<RayTarget>(&target)) {
    *message.mutable_ray()->mutable_origin_in_world_m() = ToProto(ray->origin_in_world);
    *message.mutable_ray()->mutable_direction_in_world() = ToProto(ray->direction_in_world);
  }
  return message;
}

}  // namespace saccade::wire
