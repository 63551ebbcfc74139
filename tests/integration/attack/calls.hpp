#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <deque>
#include <map>
#include <memory>
#include <string>

#include "tests/integration/attack/socket.hpp"

namespace saccade::testing {

/// Answer to one call made of bytes.
struct RawReply {
  grpc::Status status;
  std::string bytes;

  bool Is(grpc::StatusCode code) const { return status.error_code() == code; }
  /// Refused as too much, with the time after which to try again (google.rpc.RetryInfo).
  bool RefusedWithRetry() const;
};

/// One call of any method with any bytes; of a server stream the first message counts.
RawReply Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
              const std::string& request, milliseconds deadline = seconds(3));

/// The same for messages: `method` is "Service/Method" of saccade.v1.
template <typename Response>
RawReply Ask(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
             const google::protobuf::Message& request, Response& response,
             milliseconds deadline = seconds(3)) {
  RawReply reply =
      Call(channel, "/saccade.v1." + method, request.SerializePartialAsString(), deadline);
  response.ParsePartialFromString(reply.bytes);
  return reply;
}

/// Joins, waiting for as long as the server says, until `patience` is over; session_id or "".
/// `role` as in v1::Role.
std::string JoinSession(const std::shared_ptr<grpc::Channel>& channel, int role,
                        milliseconds patience = seconds(20), const std::string& name = "stranger");

/// Many streams of one method, each held open after its one request; nothing is read of them
/// beyond what gRPC itself reads.
class HeldStreams {
 public:
  ~HeldStreams() { Cancel(); }
  void Open(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
            const std::string& request);
  /// Handles what has happened so far, and says how many are still open.
  int open(milliseconds wait);
  void Cancel();

 private:
  struct Held;
  enum class Step { kStarted, kWritten, kFinished };
  struct Tag {
    Held* held;
    Step step;
  };
  struct Held {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call;
    grpc::ByteBuffer request;
    grpc::Status status;
    Tag started{this, Step::kStarted}, written{this, Step::kWritten},
        finished{this, Step::kFinished};
    bool over = false;
  };
  bool TakeOne(milliseconds wait);

  grpc::CompletionQueue queue_;
  std::deque<Held> held_;
  int waiting_ = 0;  // tags not handed back yet
  bool cancelled_ = false;
};

/// What happened how often, for the note that a test prints.
class Tally {
 public:
  void Add(const std::string& what, long count = 1);
  void Add(const grpc::Status& status);
  long of(const std::string& what) const;
  std::string ToString() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, long> counts_;
};

}  // namespace saccade::testing
