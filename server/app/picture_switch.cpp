#include "server/app/picture_switch.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/time/clock.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr char kFile[] = "picture_pause.json";
constexpr std::size_t kMaxFileBytes = 4096, kOrdersWaiting = 16;
constexpr std::size_t kMaxRanges = 4096;     // pauses that are told apart
constexpr Timestamp kExposure = 50'000'000;  // half of it, and what the clocks differ by, at most

absl::Status Stopped(const PicturePause& state) {
  return absl::FailedPreconditionError(
      absl::StrCat("picture: ", state.by.empty() ? "the wearer" : state.by,
                   " has paused it; wait until it is lifted"));
}

absl::StatusOr<PicturePause> Read(const std::filesystem::path& file) {
  absl::StatusOr<std::string> text = ReadRegularFile(file, kMaxFileBytes, "a pause of the picture");
  if (absl::IsNotFound(text.status())) return PicturePause();
  if (!text.ok()) return text.status();
  const auto json = nlohmann::json::parse(*text, nullptr, /*allow_exceptions=*/false);
  if (json.is_object() && json.contains("paused") && json["paused"].is_boolean()) {
    PicturePause state;
    state.paused = json["paused"];
    if (json.contains("by") && json["by"].is_string()) state.by = json["by"];
    if (json.contains("since_unix_ns") && json["since_unix_ns"].is_number_integer()) {
      state.since_unix_ns = json["since_unix_ns"];
    }
    return state;
  }
  return absl::DataLossError(absl::StrCat(
      file.string(),
      ": does not say whether the wearer paused the picture; delete it to show pictures"));
}

}  // namespace

/// Given once, also where the switch is stopped before the order's turn.
class PictureSwitch::Answer {
 public:
  explicit Answer(Done<PicturePause> done) : done_(std::move(done)) {}
  ~Answer() { Give(absl::UnavailableError("the server is shutting down")); }
  void Give(const absl::StatusOr<PicturePause>& result) {
    if (const Done<PicturePause> done = std::exchange(done_, nullptr)) done(result);
  }

 private:
  Done<PicturePause> done_;
};

PictureSwitch::PictureSwitch(std::filesystem::path file, PicturePause state)
    : file_(std::move(file)),
      state_(std::make_shared<const PicturePause>(std::move(state))),
      runner_({.capacity = kOrdersWaiting, .when_full = WhenFull::kRefuse},
              [this](const Order& order) { order.answer->Give(Carry(order)); }) {}

absl::StatusOr<std::unique_ptr<PictureSwitch>> PictureSwitch::Open(
    const std::filesystem::path& directory) {
  const std::filesystem::path file = directory.empty() ? directory : directory / kFile;
  absl::StatusOr<PicturePause> state = file.empty() ? PicturePause() : Read(file);
  if (!state.ok()) return state.status();
  return std::unique_ptr<PictureSwitch>(new PictureSwitch(file, *std::move(state)));
}

void PictureSwitch::Stop() { runner_.Stop(); }

void PictureSwitch::Set(bool paused, std::string by, Done<PicturePause> done) {
  const auto answer = std::make_shared<Answer>(std::move(done));
  const absl::Status queued = runner_.Post({paused, std::move(by), answer});
  if (!queued.ok()) answer->Give(queued);
}

absl::StatusOr<PicturePause> PictureSwitch::Carry(const Order& order) {
  const std::shared_ptr<const PicturePause> before = state();
  // Who pauses what is paused changes nothing, nor the name of who did.
  if (before->paused == order.paused && kept_) return *before;
  const PicturePause next{order.paused, order.by, absl::GetCurrentTimeNanos()};
  if (next.paused) Change(next);
  absl::Status kept = Keep(next);
  kept_ = kept.ok();
  if (!kept_) return kept;
  if (!next.paused) Change(next);
  return next;
}

void PictureSwitch::Change(const PicturePause& state) {
  const auto shared = std::make_shared<const PicturePause>(state);
  {
    const std::lock_guard lock(mutex_);
    state_ = shared;
    if (!state.paused) lifted_ns_ = MonotonicNow();
  }
  on_change_(shared);
}

absl::Status PictureSwitch::Keep(const PicturePause& state) const {
  if (file_.empty()) return absl::OkStatus();
  const nlohmann::ordered_json json = {
      {"paused", state.paused}, {"by", state.by}, {"since_unix_ns", state.since_unix_ns}};
  const int error = WritePrivateFile(file_, json.dump() + "\n");
  if (error == 0) return absl::OkStatus();
  return absl::InternalError(
      absl::StrCat("picture: is paused, but that cannot be kept over a restart: ", file_.string(),
                   ": ", std::strerror(error), "; see to the disk and say it again"));
}

std::shared_ptr<const PicturePause> PictureSwitch::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

absl::Status PictureSwitch::MayShow() const {
  const std::shared_ptr<const PicturePause> now = state();
  return now->paused ? Stopped(*now) : absl::OkStatus();
}

absl::Status PictureSwitch::MayShow(FrameId id) const {
  if (absl::Status now = MayShow(); !now.ok()) return now;
  return MayClick(id);
}

absl::Status PictureSwitch::MayClick(FrameId id) const {
  const std::lock_guard lock(mutex_);
  if (!Withheld(id)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrFormat("frame %d was taken while the picture was paused, so nobody is shown it; use "
                      "a newer picture, "
                      "or the map",
                      id));
}

bool PictureSwitch::Withheld(FrameId id) const {
  const auto after =
      std::upper_bound(withheld_.begin(), withheld_.end(), id,
                       [](FrameId wanted, const Range& r) { return wanted < r.first; });
  return after != withheld_.begin() && id <= std::prev(after)->last;
}

void PictureSwitch::Note(FrameId id, Timestamp captured_ns) {
  const std::lock_guard lock(mutex_);
  if (id <= newest_) {  // a source that started again: its ids mean other frames
    withheld_.clear();
    newest_withheld_ = false;
  }
  newest_ = id;
  const bool withheld =
      state_->paused || (lifted_ns_ != 0 && captured_ns - kExposure <= lifted_ns_);
  if (withheld && newest_withheld_) {
    withheld_.back().last = id;
  } else if (withheld) {
    withheld_.push_back({id, id});
  }
  newest_withheld_ = withheld;
  if (withheld_.size() <= kMaxRanges) return;
  withheld_[1].first = withheld_[0].first;  // what lay between is long gone
  withheld_.erase(withheld_.begin());
}

}  // namespace saccade
