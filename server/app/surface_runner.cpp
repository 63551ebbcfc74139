#include "server/app/surface_runner.hpp"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "server/pipeline/frame_cost.hpp"

namespace saccade {
namespace {

constexpr std::size_t kKeyframesWaiting = 8;  // each holds a picture
constexpr int kLowPriority = 10;              // as nice
constexpr std::chrono::milliseconds kPlacesEvery{500};

}  // namespace

absl::StatusOr<std::unique_ptr<SurfaceRunner>> SurfaceRunner::Create(
    const SurfaceRunnerOptions& options) {
  if (!(options.most_cores > 0.0 && options.most_cores <= 1.0)) {
    return absl::InvalidArgumentError("surface.most_cores: give more than 0, at most 1");
  }
  auto map = SurfaceMap::Create(options.surface);
  if (!map.ok()) return map.status();
  return std::unique_ptr<SurfaceRunner>(new SurfaceRunner(options, *std::move(map)));
}

SurfaceRunner::SurfaceRunner(const SurfaceRunnerOptions& options, std::unique_ptr<SurfaceMap> map)
    : options_(options), first_edition_(FirstSurfaceEdition()), map_(std::move(map)) {
  auto none = std::make_shared<SurfaceSnapshot>();
  none->edition = first_edition_;
  newest_ = std::move(none);
}

void SurfaceRunner::Start(Published published) {
  published_ = std::move(published);
  thread_ = std::jthread([this](std::stop_token stop) {
    pthread_setname_np(pthread_self(), "surfaces");
    // Of this thread alone, as Linux has it; where it is not allowed it works as others do.
    (void)setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kLowPriority);
    Run(stop);
  });
}

void SurfaceRunner::Stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void SurfaceRunner::OnFrame(const std::shared_ptr<const Frame>& frame,
                            std::shared_ptr<const KeyframePlaces> places) {
  if (!places || places == last_places_ || places->keyframes.empty()) return;
  last_places_ = places;
  {
    const std::lock_guard lock(mutex_);
    if (places->keyframes.back().frame == frame->id) {
      seen_.push_back({frame, places});
      if (seen_.size() > kKeyframesWaiting) seen_.pop_front();
    }
    places_ = std::move(places);
  }
  changed_.notify_one();
}

void SurfaceRunner::Restore(std::shared_ptr<const SurfaceSnapshot> before) {
  last_generation_ = before->generation;
  {
    const std::lock_guard lock(mutex_);
    seen_.clear();
    places_.reset();
    restored_ = std::move(before);
  }
  changed_.notify_one();
}

void SurfaceRunner::OnMap(std::uint64_t generation) {
  if (std::exchange(last_generation_, generation) == generation) return;
  auto none = std::make_shared<KeyframePlaces>();
  none->generation = generation;
  {
    const std::lock_guard lock(mutex_);
    seen_.clear();
    restored_.reset();
    places_ = std::move(none);
  }
  changed_.notify_one();
}

std::shared_ptr<const SurfaceSnapshot> SurfaceRunner::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void SurfaceRunner::TakeNews() {
  std::deque<KeyframeSeen> seen;
  std::shared_ptr<const KeyframePlaces> places;
  std::shared_ptr<const SurfaceSnapshot> restored;
  {
    const std::lock_guard lock(mutex_);
    seen.swap(seen_);
    places.swap(places_);
    restored.swap(restored_);
  }
  if (restored) map_->Restore(*restored);
  for (const KeyframeSeen& one : seen) {
    if (map_->Wants(one.frame->id, *one.places)) map_->Add(*one.frame, *one.places);
  }
  if (places) map_->SetPlaces(*places);
}

void SurfaceRunner::Publish() {
  auto surface = std::make_shared<SurfaceSnapshot>(map_->Snapshot());
  surface->edition += first_edition_;
  {
    const std::lock_guard lock(mutex_);
    if (surface->edition == newest_->edition && surface->version == newest_->version) return;
    newest_ = surface;
  }
  published_(std::move(surface));
}

void SurfaceRunner::Rest(const std::stop_token& stop, double worked_ms) {
  const double rest_ms = worked_ms * (1.0 / options_.most_cores - 1.0);
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, std::chrono::duration<double, std::milli>(rest_ms),
                    [] { return false; });
}

void SurfaceRunner::Run(std::stop_token stop) {
  auto published = std::chrono::steady_clock::now();
  auto looked = published - kPlacesEvery;
  double owed_ms = 0.0;
  while (!stop.stop_requested()) {
    const double begin_ms = ThreadCpuMs();
    const auto now = std::chrono::steady_clock::now();
    if (now - looked >= kPlacesEvery) {
      looked = now;
      TakeNews();
    }
    const bool worked = map_->Work();
    if (now - published >= options_.publish_every || !worked) {
      published = now;
      Publish();
    }
    owed_ms += ThreadCpuMs() - begin_ms;
    constexpr double kWorthResting_ms = 10.0;
    if (owed_ms >= kWorthResting_ms) Rest(stop, std::exchange(owed_ms, 0.0));
    if (worked) continue;
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, stop, looked + kPlacesEvery, [] { return false; });
    changed_.wait(lock, stop, [this] { return !seen_.empty() || places_ || restored_; });
  }
}

}  // namespace saccade
