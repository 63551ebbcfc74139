#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"
#include "tests/integration/attack/target.hpp"

namespace saccade::testing {

/// What came on the good expert's stream so far.
struct Received {
  long poses = 0, pictures = 0, bytes = 0;
  double encoded_fps_max_hz = 0;  // since ForgetMaximum()
  std::uint64_t bad_frames = 0, events_skipped = 0;
  std::size_t participants = 0;
};

/// The client that must not notice the attack: subscribes to everything, acknowledges every event,
/// places marks, and keeps a list of whatever went wrong for it.
class GoodExpert {
 public:
  explicit GoodExpert(Target& target);
  ~GoodExpert();

  const std::string& session_id() const { return session_id_; }

  /// On a thread of its own: `count` marks, each created, awaited on the stream, changed, awaited;
  /// beside every third one another that is deleted again.
  void PlaceMarks(int count, milliseconds pause);
  /// When all are placed: what went wrong, a line each; empty: nothing.
  std::string Verdict();
  std::size_t marks() const;

  Received received() const;
  void ForgetMaximum();
  /// Poses and bytes a second over the next `span`.
  double PoseRate(milliseconds span) const;
  double ByteRate(milliseconds span) const;
  /// False if that many participants are not announced within `limit`.
  bool WaitForParticipants(std::size_t count, milliseconds limit) const;

 private:
  void Read();
  void Take(const v1::Event& event);
  void Acknowledge();
  bool PlaceOne(int number);
  bool AwaitOnStream(const std::string& what);
  void Complain(const std::string& what);
  std::vector<std::string> ListedIds();

  std::unique_ptr<v1::SessionService::Stub> session_;
  std::unique_ptr<v1::AnnotationService::Stub> annotations_;
  std::string session_id_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::Event>> reader_;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  Received received_;
  std::uint64_t sequence_ = 0;
  std::set<std::string> seen_;  // "ID REVISION" and "-ID"
  std::vector<std::string> marks_, complaints_;
  bool leaving_ = false, ended_ = false;
  std::thread read_, acknowledge_, work_;
};

}  // namespace saccade::testing
