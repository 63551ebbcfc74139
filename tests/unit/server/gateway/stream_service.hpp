#pragma once

#include <atomic>
#include <memory>

namespace grpc {
class Channel;
}

namespace saccade {

/// A gRPC server in this process whose methods suit the gateway's tests. Requests are plain text:
///   /test.v1.Test/Echo     answers the request, with trailing metadata x-trailer
///   /test.v1.Test/Fail     FAILED_PRECONDITION with a message that needs escaping
///   /test.v1.Test/Count    N messages of S bytes for the request "N S", the number first
///   /test.v1.Test/Silent   says nothing until it is cancelled
class StreamService {
 public:
  StreamService();
  ~StreamService();
  std::shared_ptr<grpc::Channel> channel() const;

  std::atomic<int> messages_written = 0;  // taken over by gRPC
  std::atomic<int> open_calls = 0;
  std::atomic<int> cancelled_calls = 0;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
