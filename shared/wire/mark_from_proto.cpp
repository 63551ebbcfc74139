// What a client reads from the server: annotations.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "shared/wire/annotation_shape.hpp"
#include "shared/wire/bad_field.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade::wire {
namespace {

/// What only some shapes have.
absl::Status ReadMark(const v1::Annotation& message, absl::string_view field, Annotation& out) {
  out.locked = message.locked();
  out.number = message.number();
  out.length_m = message.length_m();
  out.length_sigma_m = message.length_sigma_m();
  if (!std::isfinite(out.length_m) || !std::isfinite(out.length_sigma_m)) {
    return BadField(absl::StrCat(field, ".length_m"), "must be a finite number");
  }
  if (out.shape == AnnotationShape::kMeasure && out.ink_offset_m.size() != 1) {
    return BadField(absl::StrCat(field, ".ink_offset_m"), "a MEASURE has one other end");
  }
  if (message.has_world_from_mark()) {
    const auto turn = FromProto(message.world_from_mark(), absl::StrCat(field, ".world_from_mark"));
    if (!turn.ok()) return turn.status();
    out.world_from_mark = *turn;
  }
  if (message.has_extent_m()) {
    const auto extent = FromProto(message.extent_m(), absl::StrCat(field, ".extent_m"));
    if (!extent.ok()) return extent.status();
    out.extent_m = *extent;
  }
  if (message.has_picture()) {
    auto picture = std::make_shared<Picture>();
    picture->sha256 = message.picture().sha256();
    picture->media_type = message.picture().media_type();
    picture->width = static_cast<int>(std::min<std::uint32_t>(message.picture().width(), 65536));
    picture->height = static_cast<int>(std::min<std::uint32_t>(message.picture().height(), 65536));
    out.picture = std::move(picture);
  }
  if (out.shape == AnnotationShape::kCheckList) {
    auto items = std::make_shared<std::vector<CheckItem>>();
    for (const v1::CheckItem& item : message.check_items()) {
      items->push_back({item.text(), item.done(), item.done_by(), item.done_unix_ns()});
    }
    out.check_items = std::move(items);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Annotation> FromProto(const v1::Annotation& message, absl::string_view field) {
  Annotation out;
  out.id = message.id();
  // A shape of a newer server is still shown.
  out.shape = KnownShape(message.shape()).value_or(AnnotationShape::kCube);
  out.text = message.text();
  out.author = message.author();
  out.author_person_id = message.author_person_id();
  out.size_m = message.size_m();
  out.color_rgba = message.color_rgba();
  out.created_unix_ns = message.created_unix_ns();
  out.revision = message.revision();
  absl::StatusOr<Anchor> anchor = FromProto(message.anchor(), absl::StrCat(field, ".anchor"));
  if (!anchor.ok()) return anchor.status();
  out.anchor = *std::move(anchor);
  InkStroke::Points ink;
  ink.reserve(static_cast<std::size_t>(message.ink_offset_m_size()));
  for (const v1::Vector3& offset : message.ink_offset_m()) {
    absl::StatusOr<Eigen::Vector3d> one = FromProto(offset, absl::StrCat(field, ".ink_offset_m"));
    if (!one.ok()) return one.status();
    ink.push_back(*one);
  }
  out.ink_offset_m = std::move(ink);
  if (absl::Status read = ReadMark(message, field, out); !read.ok()) return read;
  return out;
}

}  // namespace saccade::wire
