#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>

#include "server/rpc/stream_hub.hpp"

namespace saccade {

/// The gRPC end of one stream: at most one write under way, the next event made when it is done.
/// What it writes is encoded already, for the most part once for all streams, and is not copied.
/// Owns itself from Open until gRPC reports OnDone.
class StreamWriter : public grpc::ServerWriteReactor<grpc::ByteBuffer>, public Subscriber {
 public:
  /// `context` belongs to the call; `hold` keeps the session while the stream is open.
  static StreamWriter* Open(StreamHub& hub, Session session, const SubscriptionOptions& options,
                            grpc::CallbackServerContext& context, std::shared_ptr<void> hold);

  void Pump() override;
  void Close(const absl::Status& status) override;
  void Abandon(const absl::Status& status) override;

 private:
  StreamWriter(StreamHub& hub, Session session, const SubscriptionOptions& options,
               grpc::CallbackServerContext& context, std::shared_ptr<void> hold)
      : Subscriber(std::move(session), options, hub.bytes()),
        hub_(hub),
        context_(context),
        hold_(std::move(hold)) {}

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  StreamHub& hub_;
  std::recursive_mutex context_mutex_;    // held to use context_ from outside gRPC's callbacks
  grpc::CallbackServerContext& context_;  // until done_
  bool done_ = false;
  const std::shared_ptr<void> hold_;
  std::shared_ptr<StreamWriter> self_;
  grpc::ByteBuffer event_;  // an encoded v1::Event, being written while writing_
  bool writing_ = false;
  bool finished_ = false;                // Finish was called
  std::optional<absl::Status> closing_;  // Finish with this as soon as no write is under way
};

}  // namespace saccade
