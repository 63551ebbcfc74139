#include "server/anchors/quota.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {
namespace {

void Add(const Holding& one, Holding& sum) {
  sum.annotations += one.annotations;
  sum.ink_points += one.ink_points;
  sum.bytes += one.bytes;
  sum.picture_bytes += one.picture_bytes;
}

/// One quota: nothing added is always allowed.
absl::Status Check(const char* quota, const char* unit, std::size_t there, std::size_t added,
                   std::size_t limit, const char* remedy) {
  if (added == 0 || there + added <= limit) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(quota, ": ", there, " of ", limit, " ", unit,
                                                   " are taken and this needs ", added, "; ",
                                                   remedy));
}

}  // namespace

Holding HoldingOf(const Annotation& annotation) {
  std::size_t bytes =
      annotation.text.size() + annotation.author.size() + annotation.ink_offset_m.bytes();
  if (annotation.check_items) {
    for (const CheckItem& item : *annotation.check_items) {
      bytes += item.text.size() + item.done_by.size();
    }
  }
  return {1, annotation.ink_offset_m.size(), bytes,
          annotation.picture ? annotation.picture->bytes.size() : 0};
}

absl::Status CheckQuotas(const std::vector<AnchorRecord>& records, const AnchorOptions& options,
                         const std::string& person_id, const Holding& added) {
  Holding all, own;
  for (const AnchorRecord& record : records) {
    const Holding one = HoldingOf(record.annotation);
    Add(one, all);
    if (!person_id.empty() && record.annotation.author_person_id == person_id) Add(one, own);
  }
  for (const absl::Status& status :
       {Check("quota of one person", "annotations", own.annotations, added.annotations,
              options.max_session_annotations, "delete some of yours first"),
        Check("quota of one person", "points of ink", own.ink_points, added.ink_points,
              options.max_session_ink_points, "delete some of your strokes, or draw a shorter one"),
        Check("quota of this server", "annotations", all.annotations, added.annotations,
              options.max_annotations, "delete some first"),
        Check("quota of this server", "points of ink", all.ink_points, added.ink_points,
              options.max_ink_points, "delete some strokes, or draw a shorter one"),
        Check("quota of this server", "bytes of texts and ink", all.bytes, added.bytes,
              options.max_bytes, "delete some annotations, or shorten this one"),
        Check("quota of one person", "bytes of pictures", own.picture_bytes, added.picture_bytes,
              options.max_person_picture_bytes, "delete some of your pictures"),
        Check("quota of this server", "bytes of pictures", all.picture_bytes, added.picture_bytes,
              options.max_picture_bytes, "delete some pictures, or make this one smaller")}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace saccade
