#include "server/record/recorder.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>

#include <system_error>
#include <utility>

#include "shared/io/log.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kFlushEvery{400};  // what a killed server loses at most, and a little
constexpr seconds kSyncEvery{2}, kLookEvery{1}, kKeyFrameEvery{2}, kStateEvery{10};
constexpr seconds kLateFile{3};  // without a picture to begin it
constexpr Timestamp kMicrosecond_ns = 1000;

/// Ids that nobody can claim: no session of the table's.
Session SessionOf(const char* what) {
  Session session;
  session.id = absl::StrCat("recording/", what);
  session.participant_id = "recording";
  session.display_name = "recording";
  session.role = v1::ROLE_VIEWER;
  return session;
}

SubscriptionOptions Listening(std::initializer_list<v1::Topic> topics) {
  SubscriptionOptions options;
  for (const v1::Topic topic : topics) options.topics.set(static_cast<std::size_t>(topic));
  options.window = 256;
  return options;
}

Timestamp UnixNow() { return absl::GetCurrentTimeNanos(); }

}  // namespace

Recorder::Recorder(StreamHub& hub, RecorderOptions options)
    : hub_(hub),
      options_(std::move(options)),
      queue_(std::make_shared<RecordQueue>(options_.queue_bytes)),
      flow_session_(SessionOf("flow")),
      state_session_(SessionOf("state")),
      thread_([this](std::stop_token stop) { Run(stop); }) {}

void Recorder::Stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  queue_->Wake();
  thread_.join();
}

RecordingState Recorder::recording() const {
  const std::lock_guard lock(mutex_);
  return published_;
}

void Recorder::StartRecording(Done<RecordingState> done) { Post({true, std::move(done)}); }
void Recorder::StopRecording(Done<RecordingState> done) { Post({false, std::move(done)}); }

void Recorder::Post(Order order) {
  {
    const std::lock_guard lock(mutex_);
    if (!stopped_) {
      orders_.push_back(std::move(order));
      queue_->Wake();
      return;
    }
  }
  order.done(absl::UnavailableError("the server is shutting down"));
}

void Recorder::Publish() {
  if (writer_) {
    state_.bytes = bytes_before_ + writer_->mcap().bytes();
    state_.messages = messages_before_ + writer_->mcap().messages();
  }
  state_.events_lost = queue_->lost() - lost_before_;
  const std::lock_guard lock(mutex_);
  published_ = state_;
}

void Recorder::Run(std::stop_token stop) {
  while (!stop.stop_requested()) {
    std::deque<Order> orders;
    {
      const std::lock_guard lock(mutex_);
      orders.swap(orders_);
    }
    for (const Order& order : orders) Carry(order);
    std::deque<RecordedEvent> events = queue_->TakeAll(writer_ ? milliseconds(100) : seconds(1));
    if (!writer_) continue;
    absl::Status status = Take(std::move(events));
    if (status.ok()) status = Attend(Clock::now());
    if (!status.ok()) End(status);
    Publish();
  }
  std::deque<Order> left;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    left.swap(orders_);
  }
  End(absl::OkStatus());
  Publish();
  for (const Order& order : left) {
    order.done(absl::UnavailableError("the server is shutting down"));
  }
}

void Recorder::Carry(const Order& order) {
  absl::Status status;
  if (order.start) {
    if (!writer_) status = Begin();
  } else {
    End(absl::OkStatus());
  }
  Publish();
  status.ok() ? order.done(state_) : order.done(status);
}

absl::Status Recorder::CheckRoom() const {
  std::error_code error;
  const fs::space_info space = fs::space(options_.directory, error);
  if (error || space.available >= options_.keep_free_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrFormat(
      "%s: %d MB are free and record.keep_free_mb is %d: make room and start the recording anew",
      options_.directory.string(), space.available >> 20, options_.keep_free_bytes >> 20));
}

absl::Status Recorder::Begin() {
  std::error_code error;
  if (fs::create_directories(options_.directory, error)) {  // its owner's alone
    fs::permissions(options_.directory, fs::perms::owner_all, error);
  }
  if (error) {
    return absl::UnavailableError(absl::StrCat(options_.directory.string(), ": ", error.message(),
                                               "; choose another --record"));
  }
  queue_->TakeAll(milliseconds(0));  // of what was before
  bytes_before_ = messages_before_ = 0;
  lost_before_ = lost_seen_ = queue_->lost();
  state_ = {};
  if (absl::Status opened = OpenFile(); !opened.ok()) {
    state_.problem = std::string(opened.message());
    return opened;
  }
  state_.on = true;
  state_.since_unix_ns = UnixNow();
  OpenState();
  OpenFlow();
  Log(absl::StrCat("recording into ", state_.file));
  return absl::OkStatus();
}

absl::Status Recorder::OpenFile() {
  if (absl::Status room = CheckRoom(); !room.ok()) return room;
  const Timestamp unix_ns = UnixNow();
  const std::string name = absl::StrCat(
      absl::FormatTime("%Y%m%dT%H%M%S", absl::FromUnixNanos(unix_ns), absl::UTCTimeZone()),
      absl::StrFormat("%06dZ.mcap", unix_ns / kMicrosecond_ns % 1'000'000));
  auto opened = EventWriter::Create(options_.directory / name,
                                    {options_.version, options_.source, unix_ns - MonotonicNow()});
  if (!opened.ok()) return opened.status();
  if (writer_) {
    bytes_before_ += writer_->mcap().bytes();
    messages_before_ += writer_->mcap().messages();
    if (absl::Status closed = writer_->mcap().Close(); !closed.ok()) return closed;
  }
  writer_ = *std::move(opened);
  surface_.Restart();
  state_.file = writer_->mcap().file().string();
  opened_ = flushed_ = synced_ = looked_ = key_frame_ = Clock::now();
  return absl::OkStatus();
}

void Recorder::End(const absl::Status& why) {
  if (!writer_) return;
  for (const auto& stream : {flow_, state_stream_}) {
    hub_.Remove(stream.get());
    stream->Close(absl::OkStatus());
  }
  flow_ = state_stream_ = nullptr;
  absl::Status status = why;
  if (status.ok()) status.Update(Take(queue_->TakeAll(milliseconds(0))));
  status.Update(writer_->mcap().Close());
  Publish();
  bytes_before_ = state_.bytes;
  writer_ = nullptr;
  state_.on = false;
  state_.problem = std::string(status.message());
  Log(status.ok() ? absl::StrCat("recorded into ", state_.file)
                  : absl::StrCat("the recording has stopped: ", status.message()));
}

void Recorder::OpenState() {
  state_begun_ = Clock::now();
  state_stream_ = std::make_shared<RecordedStream>(
      hub_, state_session_,
      Listening({v1::TOPIC_MAP, v1::TOPIC_ANNOTATION, v1::TOPIC_PRESENCE, v1::TOPIC_PICTURE_PAUSE,
                 v1::TOPIC_SCENE}),
      /*state=*/true, queue_);
  hub_.Add(state_stream_);
}

void Recorder::OpenFlow() {
  // With the map, for the features of each picture; what it says of the map itself is passed over.
  flow_ = std::make_shared<RecordedStream>(
      hub_, flow_session_,
      Listening({v1::TOPIC_POSE, v1::TOPIC_VIDEO, v1::TOPIC_MAP, v1::TOPIC_GAZE,
                 v1::TOPIC_STATISTICS, v1::TOPIC_POINTER, v1::TOPIC_CHAT}),
      /*state=*/false, queue_);
  hub_.Add(flow_);
}

bool Recorder::WantsNewFile(Clock::time_point now) const {
  return writer_->mcap().bytes() >= options_.file_bytes || now - opened_ >= options_.file_length;
}

absl::Status Recorder::Take(std::deque<RecordedEvent> events) {
  for (const RecordedEvent& each : events) {
    std::string bytes = each.event.head;
    if (each.event.shared) bytes += *each.event.shared;
    bytes += each.event.tail;
    v1::Event event;
    if (!event.ParseFromString(bytes)) continue;  // our own bytes
    if (event.has_map() && !each.state) continue;
    const bool begins = event.has_access_unit() && event.access_unit().key_frame();
    if (begins && WantsNewFile(Clock::now())) {
      if (absl::Status opened = OpenFile(); !opened.ok()) return opened;
      OpenState();
    }
    if (absl::Status written = writer_->Write(event, each.came_ns); !written.ok()) return written;
  }
  return absl::OkStatus();
}

absl::Status Recorder::Attend(Clock::time_point now) {
  const auto due = [now](Clock::time_point& last, auto every) {
    if (now - last < every) return false;
    last = now;
    return true;
  };
  if (due(flushed_, kFlushEvery)) {
    if (absl::Status flushed = writer_->mcap().Flush(); !flushed.ok()) return flushed;
  }
  if (const auto surface = hub_.backend()->surface()) {
    if (const auto chunks = surface_.Due(*surface, MonotonicNow())) {
      if (absl::Status written = writer_->Write(*chunks, MonotonicNow()); !written.ok()) {
        return written;
      }
    }
  }
  if (due(synced_, kSyncEvery)) {
    if (absl::Status synced = writer_->mcap().Sync(); !synced.ok()) return synced;
  }
  if (due(looked_, kLookEvery)) {
    if (absl::Status room = CheckRoom(); !room.ok()) return room;
    if (now - opened_ >= options_.file_length + kLateFile) {  // nobody sends a picture
      if (absl::Status opened = OpenFile(); !opened.ok()) return opened;
      OpenState();
    }
  }
  if (due(key_frame_, WantsNewFile(now) ? kLookEvery : kKeyFrameEvery)) {
    hub_.AskForKeyFrame(VideoView::kRaw);
  }
  if (std::exchange(lost_seen_, queue_->lost()) !=
      queue_->lost()) {  // what follows hangs in the air
    Log("recording: the disk is too slow, events were lost");
    OpenState();
    OpenFlow();
  } else if (now - state_begun_ >= kStateEvery) {
    OpenState();
  }
  return absl::OkStatus();
}

}  // namespace saccade
