#include "server/rpc/talk_service.hpp"

#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>

#include <algorithm>
#include <utility>

#include "server/pipeline/busy.hpp"
#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

absl::Status CheckPackets(const v1::SpeakRequest& request) {
  const int count = request.packets_size();
  if (count == 0 || count > TalkService::kMaxPackets) {
    return absl::InvalidArgumentError(
        absl::StrCat("packets: ", count, "; give 1 to ", TalkService::kMaxPackets));
  }
  for (int i = 0; i < count; ++i) {
    const v1::VoicePacket& packet = request.packets(i);
    const std::size_t bytes = packet.opus().size();
    if (bytes == 0 || bytes > TalkService::kMaxOpusBytes) {
      return absl::InvalidArgumentError(absl::StrCat(
          "packets[", i, "].opus: ", bytes, " bytes; give 1 to ", TalkService::kMaxOpusBytes));
    }
    if (i > 0 && packet.sequence() <= request.packets(i - 1).sequence()) {
      return absl::InvalidArgumentError(
          absl::StrCat("packets[", i, "].sequence: ", packet.sequence(), " does not rise"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

TalkService::TalkService(Backend& backend, StreamHub& hub, Gatekeeper& gate,
                         const RateLimit& packets)
    : backend_(backend), hub_(hub), gate_(gate), packets_(packets) {
  // By their numbers in the proto; limits_test calls every one.
  MarkMethodCallback(0, Early(gate, "TalkService/Say", this, &TalkService::Say));
  MarkMethodCallback(1, Early(gate, "TalkService/ListMessages", this, &TalkService::ListMessages));
  MarkMethodCallback(2, Early(gate, "TalkService/Speak", this, &TalkService::Speak));
}

absl::Status TalkService::CheckMessage(const v1::SayRequest& request) const {
  if (!request.request_id().empty()) {
    absl::Status uuid = wire::CheckUuid(request.request_id(), "request_id");
    if (!uuid.ok()) return uuid;
  }
  absl::Status text = wire::CheckText(request.text(), kMaxTextBytes, "text");
  if (!text.ok()) return text;
  const std::string& mark = request.annotation_id();
  if (mark.empty()) {
    if (!request.text().empty()) return absl::OkStatus();
    return absl::InvalidArgumentError("text: is empty; say something, or name a mark");
  }
  absl::Status uuid = wire::CheckUuid(mark, "annotation_id");
  if (!uuid.ok()) return uuid;
  const std::shared_ptr<const AnnotationList> annotations = backend_.annotations();
  const bool known = std::any_of(annotations->begin(), annotations->end(),
                                 [&mark](const Annotation& one) { return one.id == mark; });
  if (known) return absl::OkStatus();
  return absl::NotFoundError("annotation_id: there is no such mark (any more)");
}

grpc::ServerUnaryReactor* TalkService::Say(Context* context, const v1::SayRequest* request,
                                           v1::SayResponse* response) {
  UnaryCall call(*context, "TalkService/Say", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kSay, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (absl::Status valid = CheckMessage(*request); !valid.ok()) return call.Finish(valid);
  v1::ChatMessage message;
  message.set_participant_id(session->participant_id);
  message.set_person_id(session->person_id);
  message.set_display_name(session->display_name);
  message.set_text(request->text());
  message.set_annotation_id(request->annotation_id());
  message.set_sent_unix_ns(absl::GetCurrentTimeNanos());
  *response->mutable_message() = *chat_.Say(std::move(message), request->request_id());
  hub_.OnChat(chat_.log());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* TalkService::ListMessages(Context* context,
                                                    const v1::ListMessagesRequest* request,
                                                    v1::ListMessagesResponse* response) {
  UnaryCall call(*context, "TalkService/ListMessages", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kRead, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  const std::shared_ptr<const ChatLog> log = chat_.log();
  for (auto at = After(*log, request->after_number()); at != log->end(); ++at) {
    *response->add_messages() = **at;
  }
  call.set_log(UnaryCall::Log::kNothing);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* TalkService::Speak(Context* context, const v1::SpeakRequest* request,
                                             v1::SpeakResponse* /*response*/) {
  UnaryCall call(*context, "TalkService/Speak", UnaryCall::Log::kNothing);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kSpeak, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (absl::Status valid = CheckPackets(*request); !valid.ok()) return call.Finish(valid);
  const std::optional<Timestamp> wait_ns =
      packets_.Take(session->participant_id, MonotonicNow(), request->packets_size());
  if (wait_ns) return call.Finish(BusyError("too many packets of voice", *wait_ns));
  VoiceBatch batch{session->participant_id, {}};
  for (const v1::VoicePacket& packet : request->packets()) {
    batch.packets.push_back(std::make_shared<const v1::VoicePacket>(packet));
  }
  hub_.OnVoice(std::move(batch));
  return call.Finish(absl::OkStatus());
}

}  // namespace saccade
