#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "saccade/v1/session.pb.h"
#include "server/rpc/stream_hub.hpp"

namespace saccade {

/// The gRPC end of one stream: at most one write under way, the next event made when it is done.
/// Owns itself from Open until gRPC reports OnDone.
class StreamWriter : public grpc::ServerWriteReactor<v1::Event>, public Subscriber {
 public:
  static StreamWriter* Open(StreamHub& hub, Session session, const SubscriptionOptions& options);

  void Pump() override;
  void Close(const absl::Status& status) override;

 private:
  StreamWriter(StreamHub& hub, Session session, const SubscriptionOptions& options)
      : Subscriber(std::move(session), options), hub_(hub) {}

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  StreamHub& hub_;
  std::shared_ptr<StreamWriter> self_;
  v1::Event event_;  // being written while writing_
  bool writing_ = false;
  bool finished_ = false;                // Finish was called
  std::optional<absl::Status> closing_;  // Finish with this as soon as no write is under way
};

}  // namespace saccade
