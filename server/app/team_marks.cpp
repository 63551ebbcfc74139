#include "server/app/team_marks.hpp"

#include <absl/strings/str_format.h>

#include <algorithm>

namespace saccade {
namespace {

constexpr double kStayed_m = 0.005;

/// The same of the same, always: a copy that was made before a restart is found by it.
std::string RequestId(const std::string& device_id, const std::string& mark_id) {
  std::uint64_t high = 1469598103934665603ULL, low = 0x9e3779b97f4a7c15ULL;  // FNV-1a, twice
  for (const char c : device_id + "/" + mark_id) {
    high = (high ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
    low = (low ^ high) * 1099511628211ULL;
  }
  return absl::StrFormat("%08x-%04x-8%03x-%04x-%012x", high >> 32, high >> 16 & 0xffff,
                         high & 0xfff, 0x8000 | (low >> 48 & 0x3fff), low & 0xffffffffffffULL);
}

}  // namespace

bool SameMarks(const AnnotationList& a, const AnnotationList& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Annotation& x, const Annotation& y) {
                      return x.id == y.id && x.revision == y.revision &&
                             (x.anchor.point_in_world - y.anchor.point_in_world).norm() < kStayed_m;
                    });
}

std::optional<AnnotationDraft> CopyOf(const Annotation& mark, const Similarity3& own_from_member,
                                      const std::string& device_id) {
  if (mark.shape == AnnotationShape::kPicture || mark.shape == AnnotationShape::kCheckList) {
    return std::nullopt;
  }
  AnnotationDraft draft;
  draft.request_id = RequestId(device_id, mark.id);
  draft.shape = mark.shape;
  draft.text = mark.text;
  draft.author = mark.author;
  draft.size_m = mark.size_m * own_from_member.scale;
  draft.color_rgba = mark.color_rgba;
  draft.target = PointTarget{own_from_member * mark.anchor.point_in_world};
  if (!mark.ink_offset_m.empty()) {
    InkStroke::Points points;
    for (const Eigen::Vector3d& point : mark.ink_offset_m) {
      points.push_back(own_from_member.scale * (own_from_member.rotation * point));
    }
    draft.ink_offset_m = InkStroke(std::move(points));
  }
  if (mark.shape == AnnotationShape::kBox || mark.shape == AnnotationShape::kArrow) {
    draft.world_from_mark =
        own_from_member.rotation * mark.world_from_mark.value_or(Eigen::Quaterniond::Identity());
  }
  if (mark.shape == AnnotationShape::kBox) draft.extent_m = own_from_member.scale * mark.extent_m;
  return draft;
}

}  // namespace saccade
