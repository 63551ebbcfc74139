#include "client/session/threads.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "shared/models/gltf_reader.hpp"

namespace saccade::session {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstWait(250), kLongestWait(2000), kLook(2000), kTick(50);
constexpr Timestamp kSilenceNs = 4'000'000'000;  // statistics come every second
constexpr Timestamp kPingNs = 1'000'000'000;
constexpr std::size_t kMaxInbox = 512, kMaxRequests = 64;

bool IsRefusal(const absl::Status& status) {
  return absl::IsPermissionDenied(status) || absl::IsUnauthenticated(status) ||
         absl::IsInvalidArgument(status);
}

}  // namespace

Session::Threads::Threads(SessionOptions options, PictureSink& pictures, std::function<void()> wake)
    : options_(std::move(options)),
      pictures_(pictures),
      wake_(std::move(wake)),
      surfaces_([this](net::SurfacePiece piece) {
        Post([piece = std::move(piece)](State& state) { state.surface.Take(piece); });
      }) {
  streaming_ = std::jthread([this](std::stop_token stop) { RunStream(stop); });
  keeping_ = std::jthread([this](std::stop_token stop) { RunKeeper(stop); });
  editing_ = std::jthread([this](std::stop_token stop) { RunEdits(stop); });
}

Session::Threads::~Threads() {
  for (std::jthread* thread : {&streaming_, &keeping_, &editing_}) thread->request_stop();
  const std::lock_guard lock(mutex_);
  if (stream_ != nullptr) stream_->Cancel();
}

void Session::Threads::Post(Answer answer) {
  {
    const std::lock_guard lock(mutex_);
    inbox_.push_back(std::move(answer));
  }
  wake_();
}

std::vector<Session::Answer> Session::Threads::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(inbox_, {});
}

std::optional<net::ConnectionOptions> Session::Threads::current() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

void Session::Threads::SetLink(Link::Kind kind, std::string reason) {
  Post([kind, reason = std::move(reason), now_ns = MonotonicNow()](State& state) {
    const bool again = kind == Link::Kind::kReconnecting && state.link.kind == kind;
    state.link = {kind, reason, again ? state.link.since_ns : now_ns};
  });
}

bool Session::Threads::SleepFor(std::stop_token stop, milliseconds time) {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, stop, time, [&stop] { return stop.stop_requested(); });
}

void Session::Threads::RunStream(std::stop_token stop) {
  milliseconds wait = kFirstWait;
  while (!stop.stop_requested()) {
    bool was_live = false;
    const absl::Status status = RunOnce(stop, was_live);
    if (stop.stop_requested()) return;
    if (Renewed()) continue;
    std::string why(status.ok() ? "the server ended the stream" : status.message());
    {
      const std::lock_guard lock(mutex_);
      stream_.reset();
      if (!ended_.empty()) why = std::exchange(ended_, "");
      // Another one goes on with this session: leave it to that one, or both would never end it.
      if (absl::IsAborted(status)) current_.reset();
    }
    if (IsRefusal(status) && !was_live) return SetLink(Link::Kind::kRefused, why);
    SetLink(Link::Kind::kReconnecting, why);
    if (was_live) wait = kFirstWait;
    if (!SleepFor(stop, wait)) return;
    wait = std::min(2 * wait, kLongestWait);
  }
}

bool Session::Threads::Renewed() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(renewed_, false)) return false;
  stream_.reset();
  return true;
}

void Session::Threads::Listen(bool listens) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(listens_, listens) == listens || stream_ == nullptr) return;
  renewed_ = true;
  stream_->Cancel();
}

absl::Status Session::Threads::Speak(const std::vector<VoicePacket>& packets) {
  std::shared_ptr<net::Stream> stream;
  {
    const std::lock_guard lock(mutex_);
    stream = stream_;
  }
  if (stream == nullptr) return absl::UnavailableError("no connection to the server");
  return stream->Speak(packets);
}

absl::Status Session::Threads::Enter(std::stop_token stop, net::ConnectionOptions& connection) {
  while (options_.enter) {
    const absl::StatusOr<bool> waits = options_.enter(connection);
    if (!waits.ok()) return waits.status();
    if (!*waits) break;
    SetLink(Link::Kind::kWaiting);
    if (!SleepFor(stop, kLook)) return absl::CancelledError();
  }
  return absl::OkStatus();
}

absl::Status Session::Threads::RunOnce(std::stop_token stop, bool& was_live) {
  net::ConnectionOptions connection = options_.connection;
  if (absl::Status entered = Enter(stop, connection); !entered.ok()) return entered;
  if (const auto before = current()) connection.session_id = before->session_id;
  const auto joining = net::Connection::Create(connection);
  if (!joining.ok()) return joining.status();
  const absl::StatusOr<std::string> id = (*joining)->JoinAnew();
  if (!id.ok()) return id.status();
  connection.session_id = *id;
  std::shared_ptr<net::Stream> stream;
  {
    const std::lock_guard lock(mutex_);
    if (stop.stop_requested()) return absl::CancelledError();
    stream = std::make_shared<net::Stream>(connection, *id, listens_);
    renewed_ = false;
    current_ = connection;
    stream_ = stream;
    acknowledger_.emplace(net::Stream::kWindow / 4, MonotonicNow());
    heard_ns_ = MonotonicNow();
    pinged_ns_ = 0;
  }
  pictures_.Reset();
  surfaces_.Connect(connection);
  Post([id = *id, joined = (*joining)->joined()](State& state) { state.Begin(id, joined); });
  return stream->Read([&](std::uint64_t sequence, std::optional<net::StreamEvent> event) {
    // Once the stream is open: between its first word and this answer nothing falls.
    if (!std::exchange(was_live, true)) AskForHistory();
    const Timestamp now_ns = MonotonicNow();
    if (event && std::holds_alternative<net::CodedPicture>(*event)) {
      pictures_.Push(std::get<net::CodedPicture>(*std::move(event)));
    } else if (event && std::holds_alternative<net::VoiceNews>(*event)) {
      if (options_.on_voice) options_.on_voice(std::get<net::VoiceNews>(*event));
    } else if (event && std::holds_alternative<net::SurfaceNews>(*event)) {
      surfaces_.Tell(std::get<net::SurfaceNews>(*event));
    } else if (event) {
      if (const auto* scene = std::get_if<net::SceneChange>(&*event)) {
        AskForModels(scene->added_models);
      }
      Post([event = *std::move(event), now_ns](State& state) { state.Apply(event, now_ns); });
    }
    const std::lock_guard lock(mutex_);
    heard_ns_ = now_ns;
    acknowledger_->Arrived(sequence);
    if (sequence % (net::Stream::kWindow / 4) == 0) changed_.notify_all();
  });
}

void Session::Threads::RunKeeper(std::stop_token stop) {
  while (SleepFor(stop, milliseconds(0))) {
    Tick();
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, kTick, [this, &stop] {
      return stop.stop_requested() || (stream_ != nullptr && pinged_ns_ == 0);
    });
  }
}

void Session::Threads::Tick() {
  const Timestamp now_ns = MonotonicNow();
  std::shared_ptr<net::Stream> stream;
  std::optional<Acknowledger::Message> message;
  bool ping = false;
  {
    const std::lock_guard lock(mutex_);
    if (stream_ == nullptr) return;
    stream = stream_;
    if (now_ns - heard_ns_ > kSilenceNs && ended_.empty()) {
      ended_ = absl::StrFormat("nothing heard for %.0f s", Seconds(now_ns - heard_ns_));
      stream->Cancel();
      return;
    }
    if (pictures_.TakeKeyFrameRequest()) acknowledger_->RequestKeyFrame();
    message = acknowledger_->Due(now_ns, pictures_.Behind() || inbox_.size() > kMaxInbox);
    ping = now_ns - pinged_ns_ > kPingNs;
    if (ping) pinged_ns_ = now_ns;
  }
  if (message) {
    const bool arrived = stream->Acknowledge(message->sequence, message->request_key_frame).ok();
    const std::lock_guard lock(mutex_);
    if (stream == stream_) acknowledger_->Sent(*message, arrived);
  }
  if (!ping) return;
  const absl::StatusOr<net::PingTimes> times = stream->Ping();
  if (times.ok()) Post([times = *times](State& state) { state.clock.Add(times); });
}

absl::Status Session::Threads::Ask(Request request) {
  const std::lock_guard lock(mutex_);
  if (!current_) return absl::UnavailableError("no connection to the server");
  if (requests_.size() >= kMaxRequests) {
    return absl::ResourceExhaustedError("too many changes wait for the server: try again");
  }
  requests_.push_back(std::move(request));
  changed_.notify_all();
  return absl::OkStatus();
}

void Session::Threads::AskForHistory() {
  Ask([](net::Connection& connection) -> Answer {
    return [kept = connection.Messages()](State& state) {
      if (kept.ok()) state.chat.History(*kept);  // what breaks it breaks the stream as well
    };
  }).IgnoreError();
}

void Session::Threads::AskForModels(const std::vector<net::ModelFacts>& models) {
  if (models.empty()) return;
  Ask([this, models](net::Connection& connection) -> Answer {
    std::vector<std::shared_ptr<const SceneModel>> read;
    for (const net::ModelFacts& facts : models) {
      if (models_.contains(facts.id)) continue;
      absl::StatusOr<std::string> file = connection.GetModel(facts.id, facts.bytes);
      if (!file.ok()) break;  // what breaks it breaks the stream as well, which then tells anew
      absl::StatusOr<TriangleMesh> mesh = ReadGlb(*file);
      if (!mesh.ok()) continue;  // the server has read it: another version's file, not drawn
      models_.insert(facts.id);
      read.push_back(std::make_shared<const SceneModel>(
          SceneModel{facts.id, facts.name, *std::move(mesh),
                     std::make_shared<const std::string>(*std::move(file))}));
    }
    return [read](State& state) {
      for (const auto& model : read) state.scene.Add(model);
    };
  }).IgnoreError();
}

void Session::Threads::RunEdits(std::stop_token stop) {
  std::unique_ptr<net::Connection> connection;
  std::string made_for;
  for (;;) {
    Request request;
    net::ConnectionOptions options;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return !requests_.empty() && current_; });
      if (stop.stop_requested()) return;
      request = std::move(requests_.front());
      requests_.pop_front();
      options = *current_;
    }
    if (connection == nullptr || made_for != options.session_id) {
      auto made = net::Connection::Create(options);
      if (!made.ok()) continue;  // was valid when the session joined with it
      connection = *std::move(made);
      made_for = options.session_id;
    }
    if (Answer answer = request(*connection)) Post(std::move(answer));
  }
}

}  // namespace saccade::session
