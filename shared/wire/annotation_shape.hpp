#pragma once

#include <optional>

#include "saccade/v1/annotation.pb.h"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// Nothing: none, or one of a newer program.
inline std::optional<AnnotationShape> KnownShape(v1::AnnotationShape shape) {
  switch (shape) {
    case v1::ANNOTATION_SHAPE_CUBE:
      return AnnotationShape::kCube;
    case v1::ANNOTATION_SHAPE_NOTE:
      return AnnotationShape::kNote;
    case v1::ANNOTATION_SHAPE_ARROW:
      return AnnotationShape::kArrow;
    case v1::ANNOTATION_SHAPE_INK:
      return AnnotationShape::kInk;
    case v1::ANNOTATION_SHAPE_BOX:
      return AnnotationShape::kBox;
    case v1::ANNOTATION_SHAPE_MEASURE:
      return AnnotationShape::kMeasure;
    case v1::ANNOTATION_SHAPE_PIN:
      return AnnotationShape::kPin;
    case v1::ANNOTATION_SHAPE_PICTURE:
      return AnnotationShape::kPicture;
    case v1::ANNOTATION_SHAPE_CHECK_LIST:
      return AnnotationShape::kCheckList;
    default:
      return std::nullopt;
  }
}

}  // namespace saccade
