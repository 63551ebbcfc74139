#include "server/record/replayer.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "saccade/v1/video.pb.h"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr Timestamp kAhead_ns = 500'000'000;  // is read at a time
// Every two seconds there is a key frame, every ten the whole state; more where pictures stayed
// away.
constexpr Timestamp kKeyFrameBack_ns = 5'000'000'000, kStateBack_ns = 12'000'000'000;
constexpr std::chrono::milliseconds kTellAgain{500};
constexpr double kSlowest = 0.1, kFastest = 16.0;
constexpr char kPicture[] = "/saccade/picture", kVideo[] = "/camera/video",
               kPose[] = "/saccade/pose";

}  // namespace

absl::StatusOr<std::unique_ptr<Replayer>> Replayer::Open(const std::filesystem::path& file) {
  absl::StatusOr<std::unique_ptr<McapReader>> mcap = McapReader::Open(file);
  if (!mcap.ok()) return mcap.status();
  std::unique_ptr<Replayer> replayer(new Replayer(file, *std::move(mcap)));
  if (absl::Status sought = replayer->Seek(replayer->mcap_->first_ns()); !sought.ok()) {
    return sought;
  }
  while (replayer->state_.camera() == nullptr && !replayer->next_.empty()) replayer->TellNext();
  replayer->camera_ = replayer->state_.camera();
  if (replayer->camera_ == nullptr) {
    return absl::DataLossError(
        absl::StrCat(file.string(), ": begins without a picture of saccade's; nothing to show"));
  }
  replayer->Publish();
  return replayer;
}

void Replayer::Start(EventSink& sink) {
  sink_ = &sink;
  thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}

void Replayer::Stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
}

std::shared_ptr<const AnnotationList> Replayer::annotations() const {
  const std::lock_guard lock(mutex_);
  return annotations_;
}

std::shared_ptr<const GazeSnapshot> Replayer::gaze() const {
  const std::lock_guard lock(mutex_);
  return gaze_;
}

std::shared_ptr<const SurfaceSnapshot> Replayer::surface() const {
  const std::lock_guard lock(mutex_);
  return surface_;
}

ReplayState Replayer::replay() const {
  const std::lock_guard lock(mutex_);
  return published_;
}

void Replayer::Change(const ReplayChange& change, Done<ReplayState> done) {
  if (change.speed && !(*change.speed >= kSlowest && *change.speed <= kFastest)) {
    return done(absl::InvalidArgumentError(
        absl::StrCat("speed: ", *change.speed, "; give ", kSlowest, " to ", kFastest)));
  }
  if (change.position_s && !(std::isfinite(*change.position_s) && *change.position_s >= 0.0 &&
                             *change.position_s < 1e9)) {
    return done(absl::InvalidArgumentError("position_s: give seconds from 0"));
  }
  {
    const std::lock_guard lock(mutex_);
    if (!stopped_) {
      orders_.push_back({change, std::move(done)});
      changed_.notify_all();
      return;
    }
  }
  done(absl::UnavailableError("the server is shutting down"));
}

void Replayer::ShowAgain() {
  const std::lock_guard lock(mutex_);
  if (!stopped_) orders_.push_back({});
  changed_.notify_all();
}

void Replayer::Publish() {
  ReplayState state{.file = file_.string(),
                    .playing = playing_ && !ended_,
                    .position_s = 1e-9 * static_cast<double>(position_ns_ - mcap_->first_ns()),
                    .length_s = 1e-9 * static_cast<double>(mcap_->last_ns() - mcap_->first_ns()),
                    .speed = speed_};
  const std::lock_guard lock(mutex_);
  published_ = std::move(state);
  annotations_ = state_.annotations();
  gaze_ = state_.gaze();
  surface_ = state_.surface();
}

void Replayer::Anchor() {
  anchor_ = Clock::now();
  anchor_ns_ = position_ns_;
}

Replayer::Clock::time_point Replayer::DueAt(Timestamp time_ns) const {
  const double wait_ns = static_cast<double>(time_ns - anchor_ns_) / speed_;
  return anchor_ + std::chrono::nanoseconds(static_cast<std::int64_t>(wait_ns));
}

absl::StatusOr<std::vector<Replayer::Kept>> Replayer::Between(Timestamp from_ns,
                                                              Timestamp until_ns) {
  std::vector<Kept> kept;
  const absl::Status read =
      mcap_->Read(from_ns, until_ns, [&kept](const McapReader::Message& message) {
        kept.push_back({std::string(message.topic), std::string(message.data), message.time_ns});
      });
  if (!read.ok()) return read;
  std::stable_sort(kept.begin(), kept.end(),
                   [](const Kept& a, const Kept& b) { return a.time_ns < b.time_ns; });
  return kept;
}

absl::StatusOr<Timestamp> Replayer::KeyFrameBefore(Timestamp wanted_ns) {
  // At its beginning there is nothing before: the first there is.
  std::optional<Timestamp> before, after;
  const auto look = [&](const McapReader::Message& message) {
    if (message.topic != kPicture || (message.time_ns > wanted_ns && after)) return;
    v1::AccessUnit facts;
    if (!facts.ParseFromArray(message.data.data(), static_cast<int>(message.data.size())) ||
        !facts.key_frame()) {
      return;
    }
    std::optional<Timestamp>& found = message.time_ns <= wanted_ns ? before : after;
    found = std::max(found.value_or(0), message.time_ns);
  };
  for (Timestamp back_ns = kKeyFrameBack_ns; !before; back_ns *= 2) {
    const Timestamp from_ns = std::max(mcap_->first_ns(), wanted_ns - back_ns);
    after.reset();
    if (absl::Status read = mcap_->Read(from_ns, wanted_ns + kKeyFrameBack_ns, look); !read.ok()) {
      return read;
    }
    if (from_ns == mcap_->first_ns()) break;
  }
  return before ? *before : after.value_or(wanted_ns);
}

absl::Status Replayer::Seek(Timestamp wanted_ns) {
  wanted_ns = std::clamp(wanted_ns, mcap_->first_ns(), mcap_->last_ns());
  const absl::StatusOr<Timestamp> at_ns = KeyFrameBefore(wanted_ns);
  if (!at_ns.ok()) return at_ns.status();
  const auto before = Between(std::max(mcap_->first_ns(), *at_ns - kStateBack_ns), *at_ns - 1);
  if (!before.ok()) return before.status();
  state_.Restart();
  for (const Kept& each : *before) {
    if (each.topic == kPicture || each.topic == kVideo || each.topic == kPose) continue;
    const absl::Status taken = state_.Take({each.topic, each.time_ns, each.data}, nullptr);
    if (!taken.ok()) return taken;
  }
  next_.clear();
  position_ns_ = *at_ns;
  read_until_ns_ = *at_ns - 1;
  ended_ = false;
  Anchor();
  return Fill();
}

absl::Status Replayer::Fill() {
  while (next_.empty() && read_until_ns_ < mcap_->last_ns()) {
    const Timestamp until_ns = std::min(mcap_->last_ns(), read_until_ns_ + kAhead_ns);
    auto more = Between(read_until_ns_ + 1, until_ns);
    if (!more.ok()) return more.status();
    read_until_ns_ = until_ns;
    next_.assign(std::make_move_iterator(more->begin()), std::make_move_iterator(more->end()));
  }
  return absl::OkStatus();
}

void Replayer::SetTime(Clock::time_point now) {
  state_.SetTime(
      std::chrono::duration_cast<std::chrono::nanoseconds>(now.time_since_epoch()).count());
}

void Replayer::TellNext() {
  const Kept next = std::move(next_.front());
  next_.pop_front();
  position_ns_ = std::max(position_ns_, next.time_ns);
  SetTime(DueAt(next.time_ns));
  absl::Status told = state_.Take({next.topic, next.time_ns, next.data}, sink_);
  if (told.ok()) told = Fill();
  if (told.ok()) return;
  Log(absl::StrCat("replay: ", told.message()));
  next_.clear();
  read_until_ns_ = mcap_->last_ns();
}

void Replayer::Carry(const Order& order) {
  absl::Status status;
  const bool again = order.done == nullptr;
  if (again && playing_ && !ended_) return;  // the next key frame is near
  if (order.change.speed) speed_ = *order.change.speed;
  if (order.change.playing) playing_ = *order.change.playing;
  const bool from_start = order.change.playing.value_or(false) && ended_;
  if (order.change.position_s) {
    status = Seek(mcap_->first_ns() + static_cast<Timestamp>(*order.change.position_s * 1e9));
  } else if (from_start) {
    status = Seek(mcap_->first_ns());
  } else if (again) {
    status = Seek(position_ns_);
  }
  Anchor();
  // Where it stands still, the picture of that moment is shown all the same.
  if (status.ok() && (again || order.change.position_s) && !playing_) {
    for (const std::uint64_t shown = state_.pictures();
         !next_.empty() && (state_.pictures() == shown || !state_.newest());) {
      TellNext();
    }
  }
  Publish();
  if (order.change.position_s || from_start) sink_->OnSurface(state_.surface());
  if (!again) status.ok() ? order.done(replay()) : order.done(status);
}

void Replayer::Run(std::stop_token stop) {
  Seek(mcap_->first_ns()).IgnoreError();  // it was read by Open
  sink_->OnSurface(state_.surface());
  while (!stop.stop_requested()) {
    std::deque<Order> orders;
    bool still = false;  // and so long that it is told again
    {
      std::unique_lock lock(mutex_);
      const auto ordered = [this] { return !orders_.empty(); };
      if (playing_ && !next_.empty()) {
        changed_.wait_until(lock, stop, DueAt(next_.front().time_ns), ordered);
      } else {
        still = !changed_.wait_for(lock, stop, kTellAgain, ordered);
      }
      orders.swap(orders_);
    }
    for (const Order& order : orders) Carry(order);
    if (stop.stop_requested()) continue;
    if (still) {
      SetTime(Clock::now());
      state_.TellAgain(*sink_);
    }
    if (!playing_) continue;
    while (!next_.empty() && DueAt(next_.front().time_ns) <= Clock::now()) TellNext();
    ended_ = next_.empty();
    Publish();
  }
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (const Order& order : orders_) {
    if (order.done) order.done(absl::UnavailableError("the server is shutting down"));
  }
  orders_.clear();
}

}  // namespace saccade
