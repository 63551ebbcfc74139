#include "server/anchors/edit_checks.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
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

}  // namespace

absl::Status CheckDraft(const AnnotationDraft& draft) {
  if (absl::Status status = CheckText(draft.text); !status.ok()) return status;
  if (absl::Status status = CheckSize(draft.size_m); !status.ok()) return status;
  if (draft.shape != AnnotationShape::kInk) return absl::OkStatus();
  if (!std::holds_alternative<PixelTarget>(draft.target)) {
    return absl::InvalidArgumentError(
        "target of an ink annotation must be frame_pixel: ink_px are pixels of that frame");
  }
  if (draft.ink_px.size() < 2 || draft.ink_px.size() > kMaxInkPoints) {
    return absl::InvalidArgumentError(absl::StrFormat("ink_px has %d points; a stroke has 2 to %d",
                                                      draft.ink_px.size(), kMaxInkPoints));
  }
  const auto finite = [](const Eigen::Vector2d& pixel) { return pixel.allFinite(); };
  if (!std::all_of(draft.ink_px.begin(), draft.ink_px.end(), finite)) {
    return absl::InvalidArgumentError("ink_px holds a number that is not finite");
  }
  return absl::OkStatus();
}

absl::Status CheckPatch(const AnnotationPatch& patch) {
  if (patch.text) {
    if (absl::Status status = CheckText(*patch.text); !status.ok()) return status;
  }
  if (patch.size_m) {
    if (absl::Status status = CheckSize(*patch.size_m); !status.ok()) return status;
  }
  if (!patch.text && !patch.size_m && !patch.color_rgba && !patch.target) {
    return absl::InvalidArgumentError("nothing to change: set text, size_m, color_rgba or target");
  }
  return absl::OkStatus();
}

std::string MakeUuid() {
  thread_local std::random_device device;
  std::array<std::uint32_t, 4> r;
  for (std::uint32_t& word : r) word = device();
  return absl::StrFormat("%08x-%04x-4%03x-%04x-%04x%08x", r[0], r[1] >> 16, r[1] & 0xfff,
                         0x8000u | (r[2] >> 16 & 0x3fff), r[2] & 0xffff, r[3]);
}

std::string ShortName(const Annotation& annotation) {
  static constexpr std::array kNames = {"cube", "note", "arrow", "ink"};
  return absl::StrCat(kNames[static_cast<std::size_t>(annotation.shape)], " ",
                      annotation.id.substr(0, 8));
}

}  // namespace saccade
