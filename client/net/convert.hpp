#pragma once

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
PicturePause FromProto(const v1::PicturePause& message);
ChatMessage FromProto(const v1::ChatMessage& message);
std::vector<ChatMessage> FromProto(
    const google::protobuf::RepeatedPtrField<v1::ChatMessage>& messages);
absl::StatusOr<ServerStatus> FromProto(const v1::GetStatusResponse& message);
absl::StatusOr<MapState> FromProto(const v1::GetMapResponse& message);
absl::StatusOr<Still> FromProto(const v1::GetFrameResponse& message);
absl::StatusOr<std::vector<Annotation>> FromProto(
    const google::protobuf::RepeatedPtrField<v1::Annotation>& messages);
absl::StatusOr<AnnotationChange> FromProto(const v1::AnnotationEvent& message);

/// Puts together what the server sends in parts. One thread.
class AnnotationParts {
 public:
  /// The whole change with its last part (`more` false); nothing until then. A full one begins
  /// anew.
  std::optional<AnnotationChange> Add(AnnotationChange part, bool more);

 private:
  std::optional<AnnotationChange> so_far_;
};

/// Nothing for the kinds that Watch() does not deliver. Annotations are as in the message: maybe a
/// part.
absl::StatusOr<std::optional<WatchEvent>> FromProto(const v1::Event& message);

}  // namespace saccade::net
