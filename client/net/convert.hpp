#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "client/net/types.hpp"
#include "saccade/v1/session.pb.h"

/// Answers of the services to domain types, through shared/wire. Pure functions, any thread.
namespace saccade::net {

v1::Role ToProto(Role role);
v1::VideoView ToProto(VideoView view);
v1::AnnotationDraft ToProto(const AnnotationDraft& draft);

Statistics FromProto(const v1::StatisticsEvent& message);
std::vector<Participant> FromProto(const v1::PresenceEvent& message);
absl::StatusOr<ServerStatus> FromProto(const v1::GetStatusResponse& message);
absl::StatusOr<MapState> FromProto(const v1::GetMapResponse& message);
absl::StatusOr<Still> FromProto(const v1::GetFrameResponse& message);
absl::StatusOr<std::vector<Annotation>> FromProto(
    const google::protobuf::RepeatedPtrField<v1::Annotation>& messages);
absl::StatusOr<AnnotationChange> FromProto(const v1::AnnotationEvent& message);

/// The strokes of one subscription: an estimate that came without its stroke is completed by it.
class KnownStrokes {
 public:
  /// Turns `anchors` of the event into `upserted`; remembers strokes, forgets removed ones.
  void Complete(v1::AnnotationEvent& event);

 private:
  absl::flat_hash_map<std::string, v1::Annotation> known_;  // by id
};

/// Nothing for the kinds that Watch() does not deliver.
absl::StatusOr<std::optional<WatchEvent>> FromProto(const v1::Event& message);

}  // namespace saccade::net
