#include "server/eval/eval_wearable.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <utility>

#include "server/tracker/make_tracker.hpp"

namespace saccade {

namespace {

absl::Status SetMode(absl::string_view value, LandmarkOptions& landmarks) {
  if (value == "koller" || value == "fused") return landmarks.Set("mode", value);
  if (value == "natural") return landmarks.Set("mode", "off");
  return absl::InvalidArgumentError(
      absl::StrCat("--set tracker=", value, ": give koller, fused or natural"));
}

}  // namespace

absl::StatusOr<TrackerSetup> ReadSetup(const TrackerArguments& arguments) {
  TrackerSetup setup;
  if (!arguments.config.empty()) {
    for (const absl::Status& status :
         {setup.tracker.LoadToml(arguments.config), setup.landmarks.LoadToml(arguments.config)}) {
      if (!status.ok()) return status;
    }
  }
  for (const std::string& pair : arguments.set) {
    absl::string_view key = pair;
    const std::size_t equals = pair.find('=');
    absl::Status status;
    if (absl::ConsumePrefix(&key, "tracker=")) {
      status = SetMode(key, setup.landmarks);
    } else if (equals != std::string::npos && absl::ConsumePrefix(&key, "landmarks.")) {
      const std::size_t at = key.find('=');
      status = setup.landmarks.Set(key.substr(0, at), key.substr(at + 1));
    } else {
      status = setup.tracker.SetPair(pair);
    }
    if (!status.ok()) return status;
  }
  if (const absl::Status valid = setup.landmarks.Validate(); !valid.ok()) return valid;
  return setup;
}

absl::StatusOr<std::unique_ptr<Tracker>> MakeTracker(const SourceInfo& info,
                                                     const TrackerArguments& arguments) {
  const absl::StatusOr<TrackerSetup> setup = ReadSetup(arguments);
  if (!setup.ok()) return setup.status();
  return MakeTracker(info, setup->tracker, setup->landmarks);
}

absl::StatusOr<std::unique_ptr<FrameTracker>> MakeFrameTracker(const SourceInfo& info,
                                                               const TrackerArguments& arguments) {
  const absl::StatusOr<TrackerSetup> setup = ReadSetup(arguments);
  if (!setup.ok()) return setup.status();
  return MakeFrameTracker(info, setup->tracker, setup->landmarks);
}

absl::StatusOr<std::unique_ptr<Wearable>> MakeWearable(const SourceInfo& info,
                                                       const TrackerArguments& arguments) {
  absl::StatusOr<std::unique_ptr<FrameTracker>> tracker = MakeFrameTracker(info, arguments);
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
