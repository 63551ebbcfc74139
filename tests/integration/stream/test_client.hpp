#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/gaze.grpc.pb.h"
#include "saccade/v1/map.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "shared/time/timestamp.hpp"

namespace saccade::testing {

struct ReceivedEvent {
  v1::Event event;
  Timestamp received_ns = 0;
};

/// An expert with a connection of its own and a thread that reads its stream. Calls that must
/// succeed end the test program with the reason if they do not.
class TestClient {
 public:
  explicit TestClient(const std::string& address, v1::Role role = v1::ROLE_EXPERT);
  ~TestClient() { Leave(); }

  const std::string& session_id() const { return session_id_; }
  const std::string& participant_id() const { return participant_id_; }
  v1::SessionService::Stub& session() { return *session_; }
  v1::AnnotationService::Stub& annotations() { return *annotations_; }
  v1::MapService::Stub& map() { return *map_; }

  /// Opens the stream; `request.session_id` is filled in.
  void Subscribe(v1::SubscribeRequest request = {}, bool acknowledge = true);
  /// Between reads: while paused nothing is taken from the socket.
  void PauseReading(bool paused);
  void Acknowledge(std::uint64_t sequence, bool request_key_frame = false);
  /// Cancels the stream and waits for its thread; how it ended.
  grpc::Status Leave();
  /// Waits for the server to end the stream.
  grpc::Status WaitForEnd();

  /// All events so far.
  std::vector<ReceivedEvent> events() const;
  /// Waits until `wanted` holds of the events so far.
  bool WaitFor(const std::function<bool(const std::vector<ReceivedEvent>&)>& wanted,
               std::chrono::milliseconds limit = std::chrono::seconds(5)) const;

  v1::AnnotationDraft CubeAt(double u, double v, std::uint64_t frame_id) const;
  grpc::Status Create(const v1::AnnotationDraft& draft, const std::string& request_id,
                      v1::CreateAnnotationResponse& response);
  /// Id of the newest frame that the server has tracked.
  std::uint64_t NewestFrame();

 private:
  void Read(bool acknowledge);

  std::unique_ptr<v1::SessionService::Stub> session_;
  std::unique_ptr<v1::AnnotationService::Stub> annotations_;
  std::unique_ptr<v1::MapService::Stub> map_;
  std::string session_id_;
  std::string participant_id_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<v1::Event>> reader_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<ReceivedEvent> events_;
  bool paused_ = false, leaving_ = false;
  std::thread thread_;
  grpc::Status end_;
};

}  // namespace saccade::testing
