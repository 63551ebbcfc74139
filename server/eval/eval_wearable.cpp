#include "server/eval/eval_wearable.hpp"

#include <absl/strings/str_format.h>

#include <utility>

namespace saccade {

absl::StatusOr<std::unique_ptr<Tracker>> MakeTracker(const SourceInfo& info,
                                                     const TrackerArguments& arguments) {
  TrackerOptions options;
  if (!arguments.config.empty()) {
    if (const absl::Status status = options.LoadToml(arguments.config); !status.ok()) return status;
  }
  for (const std::string& pair : arguments.set) {
    if (const absl::Status status = options.SetPair(pair); !status.ok()) return status;
  }
  return Tracker::Create(info, options);
}

absl::StatusOr<std::unique_ptr<Wearable>> MakeWearable(const SourceInfo& info,
                                                       const TrackerArguments& arguments) {
  absl::StatusOr<std::unique_ptr<Tracker>> tracker = MakeTracker(info, arguments);
  if (!tracker.ok()) return tracker.status();
  return Wearable::Create(info, *std::move(tracker), AnchorOptions());
}

absl::StatusOr<Annotation> PlaceAsExpert(Wearable& wearable, AnnotationTarget target, int number) {
  AnnotationDraft draft;
  draft.request_id = absl::StrFormat("00000000-0000-4000-8000-%012d", number);
  draft.author = "expert";
  draft.target = std::move(target);
  absl::StatusOr<Annotation> answer = absl::InternalError("not answered");
  wearable.Execute(
      CreateAnnotation{.editor = "expert",
                       .draft = std::move(draft),
                       .done = [&answer](absl::StatusOr<Annotation> a) { answer = std::move(a); }});
  return answer;
}

}  // namespace saccade
