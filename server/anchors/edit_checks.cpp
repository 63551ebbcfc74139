#include "server/anchors/edit_checks.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <variant>

#include "shared/scene/limits.hpp"

namespace saccade {
namespace {

absl::Status CheckText(const std::string& text) {
  if (text.size() <= kMaxTextBytes) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("text has %d bytes; at most %d are kept", text.size(), kMaxTextBytes));
}

absl::Status CheckSize(double size_m) {
  if (size_m > 0 && size_m <= kMaxSizeM) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("size_m is %g; give more than 0 and at most %g m", size_m, kMaxSizeM));
}

absl::Status CheckExtent(const Eigen::Vector3d& extent_m) {
  if (extent_m.allFinite() && extent_m.minCoeff() > 0 && extent_m.maxCoeff() <= kMaxSizeM) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("extent_m holds an edge that is not above 0 and at most %g m", kMaxSizeM));
}

absl::Status CheckRotation(const Eigen::Quaterniond& rotation) {
  if (std::abs(rotation.norm() - 1.0) < 1e-6) return absl::OkStatus();
  return absl::InvalidArgumentError("world_from_mark is no rotation; give a unit quaternion");
}

absl::Status CheckOffset(const InkStroke& offsets) {
  for (const Eigen::Vector3d& offset : offsets) {
    if (!offset.allFinite() || offset.cwiseAbs().maxCoeff() > kMaxCoordinateM) {
      return absl::InvalidArgumentError(
          "ink_offset_m holds a number that is not finite or beyond 10 km; give metres");
    }
  }
  return absl::OkStatus();
}

/// A stroke in pixels of the target's frame, or as offsets from the target.
absl::Status CheckInk(const AnnotationDraft& draft) {
  if (absl::Status status = CheckOffset(draft.ink_offset_m); !status.ok()) return status;
  const std::size_t points = draft.ink_px.empty() ? draft.ink_offset_m.size() : draft.ink_px.size();
  if (!draft.ink_px.empty() && !std::holds_alternative<PixelTarget>(draft.target)) {
    return absl::InvalidArgumentError(
        "target of an ink annotation must be frame_pixel: ink_px are pixels of that frame");
  }
  if (points < 2 || points > kMaxInkPoints) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s has %d points; a stroke has 2 to %d",
        draft.ink_px.empty() && !draft.ink_offset_m.empty() ? "ink_offset_m" : "ink_px", points,
        kMaxInkPoints));
  }
  const auto finite = [](const Eigen::Vector2d& pixel) { return pixel.allFinite(); };
  if (!std::all_of(draft.ink_px.begin(), draft.ink_px.end(), finite)) {
    return absl::InvalidArgumentError("ink_px holds a number that is not finite");
  }
  return absl::OkStatus();
}

absl::Status CheckShape(const AnnotationDraft& draft) {
  switch (draft.shape) {
    case AnnotationShape::kInk:
      return CheckInk(draft);
    case AnnotationShape::kMeasure:
      if (draft.end_target || draft.ink_offset_m.size() == 1) {
        return CheckOffset(draft.ink_offset_m);
      }
      return absl::InvalidArgumentError(
          "end_target of a measure is missing: give it, or one point of ink_offset_m");
    case AnnotationShape::kPicture:
      if (draft.picture && !draft.picture->bytes.empty()) return absl::OkStatus();
      return absl::InvalidArgumentError("picture is missing: give the bytes of a PNG or JPEG");
    case AnnotationShape::kCheckList:
      if (!draft.check_items.empty() && draft.check_items.size() <= kMaxCheckItems) {
        return absl::OkStatus();
      }
      return absl::InvalidArgumentError(
          absl::StrFormat("check_items has %d lines; a check list has 1 to %d",
                          draft.check_items.size(), kMaxCheckItems));
    default:
      return absl::OkStatus();
  }
}

}  // namespace

absl::Status CheckDraft(const AnnotationDraft& draft) {
  if (absl::Status status = CheckText(draft.text); !status.ok()) return status;
  if (absl::Status status = CheckSize(draft.size_m); !status.ok()) return status;
  if (draft.extent_m) {
    if (absl::Status status = CheckExtent(*draft.extent_m); !status.ok()) return status;
  }
  if (draft.world_from_mark) {
    if (absl::Status status = CheckRotation(*draft.world_from_mark); !status.ok()) return status;
  }
  return CheckShape(draft);
}

absl::Status CheckPatch(const AnnotationPatch& patch) {
  if (patch.text) {
    if (absl::Status status = CheckText(*patch.text); !status.ok()) return status;
  }
  if (patch.size_m) {
    if (absl::Status status = CheckSize(*patch.size_m); !status.ok()) return status;
  }
  if (patch.extent_m) {
    if (absl::Status status = CheckExtent(*patch.extent_m); !status.ok()) return status;
  }
  if (patch.world_from_mark) {
    if (absl::Status status = CheckRotation(*patch.world_from_mark); !status.ok()) return status;
  }
  if (!patch.text && !patch.size_m && !patch.color_rgba && !patch.target && !patch.end_target &&
      !patch.locked && !patch.world_from_mark && !patch.extent_m) {
    return absl::InvalidArgumentError(
        "nothing to change: set text, size_m, color_rgba, target, end_target, locked, "
        "world_from_mark or extent_m");
  }
  return absl::OkStatus();
}

absl::Status CheckPatchSuits(const AnnotationPatch& patch, AnnotationShape shape) {
  const auto no = [shape](const char* field, const char* who) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ": a ", ToString(shape), " has none; only ", who));
  };
  if (patch.end_target && shape != AnnotationShape::kMeasure) {
    return no("end_target", "a measure has another end");
  }
  if (patch.extent_m && shape != AnnotationShape::kBox) return no("extent_m", "a box has edges");
  if (patch.world_from_mark && shape != AnnotationShape::kBox && shape != AnnotationShape::kArrow) {
    return no("world_from_mark", "arrows and boxes are turned");
  }
  return absl::OkStatus();
}

absl::Status CheckMayChange(const Annotation& annotation, const Editor& editor) {
  if (!annotation.locked || IsAuthorOrWearer(annotation, editor)) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat(
      "id: ", ShortName(annotation), " is locked by ",
      annotation.locked_by.empty() ? "its author" : annotation.locked_by, ": only its author",
      annotation.author.empty() ? "" : absl::StrCat(", ", annotation.author, ","),
      " and the wearer change, delete or unlock it"));
}

absl::Status CheckMayLock(const Annotation& annotation, const Editor& editor) {
  if (IsAuthorOrWearer(annotation, editor)) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat("locked: ", ShortName(annotation), " is not yours: only its author",
                   annotation.author.empty() ? "" : absl::StrCat(", ", annotation.author, ","),
                   " and the wearer lock it"));
}

bool IsAuthorOrWearer(const Annotation& annotation, const Editor& editor) {
  return editor.wearer ||
         (!annotation.author_person_id.empty() && annotation.author_person_id == editor.person_id);
}

std::string MakeUuid() {
  thread_local std::random_device device;
  std::array<std::uint32_t, 4> r;
  for (std::uint32_t& word : r) word = device();
  return absl::StrFormat("%08x-%04x-4%03x-%04x-%04x%08x", r[0], r[1] >> 16, r[1] & 0xfff,
                         0x8000u | (r[2] >> 16 & 0x3fff), r[2] & 0xffff, r[3]);
}

std::string ShortName(const Annotation& annotation) {
  return absl::StrCat(ToString(annotation.shape), " ", annotation.id.substr(0, 8));
}

}  // namespace saccade
