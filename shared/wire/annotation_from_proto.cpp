#include <absl/strings/str_cat.h>

#include <cmath>
#include <memory>
#include <utility>

#include "shared/wire/annotation_shape.hpp"
#include "shared/wire/bad_field.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade::wire {
namespace {

absl::StatusOr<AnnotationShape> ShapeFromProto(v1::AnnotationShape shape, absl::string_view field) {
  if (const std::optional<AnnotationShape> known = KnownShape(shape)) return *known;
  return BadField(field, absl::StrCat("unknown shape ", static_cast<int>(shape),
                                      ": use CUBE, NOTE, ARROW, INK, BOX, MEASURE, PIN, PICTURE or "
                                      "CHECK_LIST"));
}

/// What a shape does not have must not be given: it would be lost without a word.
absl::Status CheckBelongs(const v1::AnnotationDraft& draft, absl::string_view field) {
  const auto shape = draft.shape();
  const bool ink = shape == v1::ANNOTATION_SHAPE_INK;
  const bool measure = shape == v1::ANNOTATION_SHAPE_MEASURE;
  const bool box = shape == v1::ANNOTATION_SHAPE_BOX;
  const bool arrow = shape == v1::ANNOTATION_SHAPE_ARROW;
  const bool picture = shape == v1::ANNOTATION_SHAPE_PICTURE;
  const bool list = shape == v1::ANNOTATION_SHAPE_CHECK_LIST;
  const struct {
    bool given, fits;
    const char *name, *whose;
  } kRules[] = {
      {!draft.ink_px().empty(), ink, ".ink_px", "only an INK shape has a stroke"},
      {!draft.ink_offset_m().empty(), ink || measure, ".ink_offset_m",
       "only an INK shape has a stroke, and a MEASURE another end"},
      {draft.has_end_target(), measure, ".end_target", "only a MEASURE has another end"},
      {draft.has_world_from_mark(), arrow || box, ".world_from_mark",
       "only an ARROW or a BOX is turned"},
      {draft.has_extent_m(), box, ".extent_m", "only a BOX has edges of its own"},
      {!draft.picture().empty(), picture, ".picture", "only a PICTURE has one"},
      {!draft.check_items().empty(), list, ".check_items", "only a CHECK_LIST has lines"}};
  for (const auto& rule : kRules) {
    if (rule.given && !rule.fits) return BadField(absl::StrCat(field, rule.name), rule.whose);
  }
  return absl::OkStatus();
}

absl::Status ReadInk(const v1::AnnotationDraft& message, const ImageSize& image,
                     absl::string_view field, AnnotationDraft& draft) {
  const bool offsets = message.ink_px().empty() && !message.ink_offset_m().empty();
  const std::string ink = absl::StrCat(field, offsets ? ".ink_offset_m" : ".ink_px");
  if (!message.ink_px().empty() && !message.ink_offset_m().empty()) {
    return BadField(absl::StrCat(field, ".ink_offset_m"), "give this or ink_px, not both");
  }
  const int points = offsets ? message.ink_offset_m_size() : message.ink_px_size();
  if (points < 2) return BadField(ink, "a stroke has at least 2 points");
  if (static_cast<std::size_t>(points) > kMaxInkPoints) {
    return BadField(ink, absl::StrCat("at most ", kMaxInkPoints, " points, not ", points));
  }
  if (!offsets && !message.target().has_frame_pixel()) {
    return BadField(absl::StrCat(field, ".target"), "an INK shape with ink_px needs a frame_pixel");
  }
  for (int i = 0; i < message.ink_px_size(); ++i) {
    absl::StatusOr<Eigen::Vector2d> pixel =
        FromProto(message.ink_px(i), image, absl::StrCat(ink, "[", i, "]"));
    if (!pixel.ok()) return pixel.status();
    draft.ink_px.push_back(*pixel);
  }
  return absl::OkStatus();
}

absl::Status ReadOffsets(const v1::AnnotationDraft& message, absl::string_view field,
                         AnnotationDraft& draft) {
  InkStroke::Points points;
  for (int i = 0; i < message.ink_offset_m_size(); ++i) {
    absl::StatusOr<Eigen::Vector3d> offset =
        FromProto(message.ink_offset_m(i), absl::StrCat(field, ".ink_offset_m[", i, "]"));
    if (!offset.ok()) return offset.status();
    points.push_back(*offset);
  }
  draft.ink_offset_m = std::move(points);
  return absl::OkStatus();
}

absl::Status ReadMeasure(const v1::AnnotationDraft& message, const ImageSize& image,
                         absl::string_view field, AnnotationDraft& draft) {
  if (!message.has_end_target()) {
    if (message.ink_offset_m_size() == 1) return absl::OkStatus();
    return BadField(absl::StrCat(field, ".end_target"),
                    "is missing: a MEASURE needs it, or one point of ink_offset_m");
  }
  if (!message.ink_offset_m().empty()) {
    return BadField(absl::StrCat(field, ".ink_offset_m"), "give this or end_target, not both");
  }
  absl::StatusOr<AnnotationTarget> end =
      FromProto(message.end_target(), image, absl::StrCat(field, ".end_target"));
  if (!end.ok()) return end.status();
  draft.end_target = *std::move(end);
  return absl::OkStatus();
}

absl::Status ReadItems(const v1::AnnotationDraft& message, absl::string_view field,
                       AnnotationDraft& draft) {
  const std::string items = absl::StrCat(field, ".check_items");
  if (message.check_items().empty()) return BadField(items, "a CHECK_LIST has at least 1 line");
  if (static_cast<std::size_t>(message.check_items_size()) > kMaxCheckItems) {
    return BadField(items, absl::StrCat("at most ", kMaxCheckItems, " lines, not ",
                                        message.check_items_size()));
  }
  for (int i = 0; i < message.check_items_size(); ++i) {
    const std::string one = absl::StrCat(items, "[", i, "]");
    const std::string& text = message.check_items(i);
    if (text.empty()) return BadField(one, "is empty");
    if (absl::Status good = CheckText(text, kMaxCheckItemBytes, one); !good.ok()) return good;
    if (text.find('\n') != text.npos) return BadField(one, "holds a line feed: give two lines");
    draft.check_items.push_back(text);
  }
  return absl::OkStatus();
}

absl::Status CheckPicture(const v1::AnnotationDraft& message, absl::string_view field) {
  const std::string picture = absl::StrCat(field, ".picture");
  if (message.picture().empty())
    return BadField(picture, "is missing: give the bytes of a PNG or JPEG");
  if (message.picture().size() <= kMaxPictureBytes) return absl::OkStatus();
  return BadField(picture, absl::StrCat("at most ", kMaxPictureBytes, " bytes, not ",
                                        message.picture().size(), ": make it smaller"));
}

absl::Status ReadShape(const v1::AnnotationDraft& message, const ImageSize& image,
                       absl::string_view field, AnnotationDraft& draft) {
  switch (draft.shape) {
    case AnnotationShape::kInk:
      return ReadInk(message, image, field, draft);
    case AnnotationShape::kMeasure:
      return ReadMeasure(message, image, field, draft);
    case AnnotationShape::kCheckList:
      return ReadItems(message, field, draft);
    case AnnotationShape::kPicture:
      return CheckPicture(message, field);
    default:
      return absl::OkStatus();
  }
}

}  // namespace

absl::StatusOr<Eigen::Vector3d> CheckExtent(const v1::Vector3& message, absl::string_view field) {
  const absl::StatusOr<Eigen::Vector3d> extent = FromProto(message, field);
  if (!extent.ok()) return extent.status();
  const char* const part[3] = {".x", ".y", ".z"};
  for (int i = 0; i < 3; ++i) {
    const double edge = (*extent)[i];
    if (edge < kMinSizeM || edge > kMaxSizeM) {
      return BadField(absl::StrCat(field, part[i]),
                      absl::StrCat(edge, " is not between ", kMinSizeM, " and ", kMaxSizeM));
    }
  }
  return extent;
}

absl::Status CheckEditGroup(absl::string_view group) {
  absl::Status text = CheckText(group, kMaxEditGroupBytes, "edit_group");
  if (!text.ok()) return text;
  return group.find('\n') == group.npos ? absl::OkStatus()
                                        : BadField("edit_group", "holds a line feed");
}

absl::StatusOr<AnnotationDraft> FromProto(const v1::AnnotationDraft& message,
                                          const ImageSize& image, absl::string_view field) {
  AnnotationDraft draft;
  absl::StatusOr<AnnotationShape> shape =
      ShapeFromProto(message.shape(), absl::StrCat(field, ".shape"));
  if (!shape.ok()) return shape.status();
  draft.shape = *shape;
  absl::Status text = CheckText(message.text(), kMaxTextBytes, absl::StrCat(field, ".text"));
  if (!text.ok()) return text;
  draft.text = message.text();
  absl::StatusOr<double> size = CheckSize(message.size_m(), absl::StrCat(field, ".size_m"));
  if (!size.ok()) return size.status();
  draft.size_m = *size;
  if (message.color_rgba() != 0) draft.color_rgba = message.color_rgba();
  absl::StatusOr<AnnotationTarget> target =
      FromProto(message.target(), image, absl::StrCat(field, ".target"));
  if (!target.ok()) return target.status();
  draft.target = *target;
  if (absl::Status belongs = CheckBelongs(message, field); !belongs.ok()) return belongs;
  if (message.has_world_from_mark()) {
    const auto turn = FromProto(message.world_from_mark(), absl::StrCat(field, ".world_from_mark"));
    if (!turn.ok()) return turn.status();
    draft.world_from_mark = *turn;
  }
  if (message.has_extent_m()) {
    const auto extent = CheckExtent(message.extent_m(), absl::StrCat(field, ".extent_m"));
    if (!extent.ok()) return extent.status();
    draft.extent_m = *extent;
  }
  if (absl::Status read = ReadShape(message, image, field, draft); !read.ok()) return read;
  if (absl::Status read = ReadOffsets(message, field, draft); !read.ok()) return read;
  return draft;
}

absl::StatusOr<AnnotationPatch> FromProto(const v1::UpdateAnnotationRequest& message,
                                          const ImageSize& image) {
  AnnotationPatch patch;
  if (absl::Status id = CheckUuid(message.id(), "id"); !id.ok()) return id;
  patch.id = message.id();
  if (message.has_text()) {
    absl::Status text = CheckText(message.text(), kMaxTextBytes, "text");
    if (!text.ok()) return text;
    patch.text = message.text();
  }
  if (message.has_size_m()) {
    const absl::StatusOr<double> size_m = CheckSize(message.size_m(), "size_m");
    if (!size_m.ok()) return size_m.status();
    patch.size_m = *size_m;
  }
  if (message.has_color_rgba()) patch.color_rgba = message.color_rgba();
  if (message.has_locked()) patch.locked = message.locked();
  if (message.has_target()) {
    absl::StatusOr<AnnotationTarget> target = FromProto(message.target(), image, "target");
    if (!target.ok()) return target.status();
    patch.target = *std::move(target);
  }
  if (message.has_end_target()) {
    absl::StatusOr<AnnotationTarget> end = FromProto(message.end_target(), image, "end_target");
    if (!end.ok()) return end.status();
    patch.end_target = *std::move(end);
  }
  if (message.has_world_from_mark()) {
    const auto turn = FromProto(message.world_from_mark(), "world_from_mark");
    if (!turn.ok()) return turn.status();
    patch.world_from_mark = *turn;
  }
  if (message.has_extent_m()) {
    const auto extent = CheckExtent(message.extent_m(), "extent_m");
    if (!extent.ok()) return extent.status();
    patch.extent_m = *extent;
  }
  return patch;
}

}  // namespace saccade::wire
