#include "server/app/engine.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <bit>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "server/app/memory.hpp"
#include "server/calibrate/calibration_desk.hpp"
#include "server/capture/gap.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::size_t kStillsWaiting = 8;
constexpr Timestamp kSourceQuiet = 500'000'000;
constexpr Timestamp kGapAgain = 5'000'000'000;

/// As status and page show it.
std::string NameOf(const SourceInfo& info) {
  return info.remark.empty() ? info.uri : absl::StrCat(info.uri, " (", info.remark, ")");
}

// Of the pixels that it is about.
std::vector<const PixelTarget*> ClicksOf(const Command& command) {
  std::vector<const PixelTarget*> clicks;
  const auto add = [&](const AnnotationTarget& target) {
    if (const auto* click = std::get_if<PixelTarget>(&target)) clicks.push_back(click);
  };
  if (const auto* create = std::get_if<CreateAnnotation>(&command)) {
    add(create->draft.target);
    if (create->draft.end_target) add(*create->draft.end_target);
  }
  if (const auto* update = std::get_if<UpdateAnnotation>(&command)) {
    if (update->patch.target) add(*update->patch.target);
    if (update->patch.end_target) add(*update->patch.end_target);
  }
  return clicks;
}

constexpr int kTrimEveryS = 2;
constexpr int kCodeEveryS = 60;  // and after 1, 2, 4 ... seconds, while the start comes to its end

}  // namespace

Engine::Engine(EngineOptions options, std::unique_ptr<FrameSource> source, EventSink& sink)
    : options_(std::move(options)),
      facts_{options_.version, NameOf(source->info()), source->info().camera},
      sink_(sink),
      pictures_(options_.pictures ? options_.pictures : *PictureSwitch::Open("")),
      scene_(options_.scene ? options_.scene : *SceneKeeper::Open("")),
      source_(std::move(source)),
      inbox_(options_.mailbox),
      clock_(/*paced=*/!options_.every_frame),
      carried_(/*waits=*/options_.every_frame),
      scene_layer_(options_.gl),
      stills_({.capacity = kStillsWaiting, .when_full = WhenFull::kRefuse},
              [this](StillRequest request) { MakeStill(std::move(request)); }) {
  if (options_.mount) {
    gaze_ = std::make_unique<GazeRunner>(
        options_.mount, options_.gaze, options_.mailbox,
        [this](const std::shared_ptr<const GazeSnapshot>& state) { sink_.OnGaze(state); });
  }
  const MayShow may_show = [pictures = pictures_](FrameId id) {
    return pictures->MayShow(id).ok();
  };
  views_[static_cast<std::size_t>(VideoView::kRaw)] = std::make_unique<ViewEncoder>(
      VideoView::kRaw, options_.video_bit_rate_bit_s,
      [](const TrackedFrame& frame) { return PictureOf(*frame.frame); }, may_show, sink_);
  views_[static_cast<std::size_t>(VideoView::kAugmented)] = std::make_unique<ViewEncoder>(
      VideoView::kAugmented, options_.video_bit_rate_bit_s,
      [this](const TrackedFrame& frame) { return DrawAugmented(frame, /*waits=*/false); }, may_show,
      sink_);
  scene_->SetAnnotations([this] { return annotations(); });
  scene_->SetOnChange([this](const std::shared_ptr<const Scene>& scene) {
    sink_.OnScene(scene);
    views_[static_cast<std::size_t>(VideoView::kAugmented)]->RedrawNewest();
  });
  pictures_->SetOnChange(
      [this](const std::shared_ptr<const PicturePause>& state) { OnPicturePause(state); });
}

Engine::~Engine() { Stop(); }

absl::StatusOr<std::unique_ptr<Engine>> Engine::Create(EngineOptions options,
                                                       std::unique_ptr<FrameSource> source,
                                                       std::unique_ptr<FrameTracker> tracker,
                                                       std::unique_ptr<AnnotationJournal> journal,
                                                       EventSink& sink) {
  auto engine = std::unique_ptr<Engine>(new Engine(std::move(options), std::move(source), sink));
  absl::StatusOr<std::unique_ptr<Wearable>> wearable = Wearable::Create(
      engine->source_->info(), std::move(tracker), engine->options_.anchors, std::move(journal),
      [self = engine.get()] { self->inbox_.PutNewestIfEmpty({}); });
  if (!wearable.ok()) return wearable.status();
  engine->wearable_ = *std::move(wearable);
  if (engine->options_.maps) engine->options_.maps->Connect(*engine);
  return engine;
}

void Engine::Start() {
  if (gaze_) gaze_->Start();
  tracker_thread_ = std::jthread([this](std::stop_token stop) {
    pthread_setname_np(pthread_self(), "tracker");  // for debuggers, and the test that stops it
    RunTracker(stop);
  });
  source_thread_ = std::jthread([this](std::stop_token stop) { RunSource(stop); });
  clock_thread_ = std::jthread([this](std::stop_token stop) { RunClock(stop); });
  if (options_.surfaces) {
    options_.surfaces->Start(
        [this](const std::shared_ptr<const SurfaceSnapshot>& now) { sink_.OnSurface(now); });
  }
}

void Engine::Stop() {
  if (std::exchange(stopped_, true)) return;
  for (std::jthread* thread : {&source_thread_, &tracker_thread_, &clock_thread_}) {
    thread->request_stop();
  }
  if (options_.calibration) options_.calibration->Stop();
  pictures_->Stop();
  scene_->Stop();
  if (options_.surfaces) options_.surfaces->Stop();
  source_->Stop();           // its next frame may not be due for long
  if (gaze_) gaze_->Stop();  // the head stops now, however long the frame takes that is tracked
  for (const Command& command : inbox_.Close()) {
    Fail(command, absl::UnavailableError("the server is shutting down"));
  }
  for (std::jthread* thread : {&source_thread_, &tracker_thread_, &clock_thread_}) {
    if (thread->joinable()) thread->join();
  }
  if (options_.maps) {
    options_.maps->Stop();
    if (const auto stored = wearable_->Store(); stored.ok()) options_.maps->KeepLast(*stored);
  }
  stills_.Stop();
  gallery_.Stop();
  for (const auto& view : views_) view->Stop();
  wearable_->Close();  // commits what is queued and answers it
}

absl::Status Engine::FlushStore(std::chrono::milliseconds limit) { return wearable_->Flush(limit); }

void Engine::RunSource(std::stop_token stop) {
  while (!stop.stop_requested()) {
    absl::StatusOr<std::optional<Frame>> frame = source_->Next();
    bad_frames_ = source_->bad_frames();
    source_dropped_ = source_->dropped_frames();
    if (!frame.ok()) Log(absl::StrCat("source: ", frame.status().ToString()));
    if (!frame.ok() || !frame->has_value()) break;
    captured_.Add(MonotonicNow(), 1.0);
    ++frames_;
    if (options_.every_frame) {
      inbox_.PutWait({.frame = **std::move(frame), .end_of_source = false}, stop);
    } else if (inbox_.PutNewest({.frame = **std::move(frame), .end_of_source = false})) {
      ++dropped_;
    }
  }
  inbox_.PutWait({.frame = std::nullopt, .end_of_source = true}, stop);
}

void Engine::RunTracker(std::stop_token stop) {
  while (auto batch = inbox_.Wait(stop)) {
    for (Command& command : batch->commands) wearable_->Execute(std::move(command));
    const bool frame = batch->item && batch->item->frame;
    if (frame) {
      Track(*std::move(batch->item->frame));
    } else {
      Settle();
    }
    if (batch->item && batch->item->end_of_source) sink_.OnEndOfSource(frames_);
  }
}

void Engine::Track(Frame frame) {
  const Timestamp begin_ns = MonotonicNow();
  if (last_) TellGap(*last_->frame, frame);
  if (options_.mount && !options_.crop && !frame.mount) {
    frame.mount = options_.mount->AnglesAt(frame.capture_time_ns);
  }
  if (gaze_) {  // what the joints do to the camera is what calibration has to find out
    const std::shared_ptr<const GazeSnapshot> state = gaze_->snapshot();
    if (state->calibration && state->calibration->running) frame.mount.reset();
  }
  const Timestamp captured_ns = clock_.ToMonotonic(frame.capture_time_ns, frame.received_time_ns);
  pictures_->Note(frame.id, captured_ns);  // before the ring has it, and with it anybody
  wearable_->tracker().SetSight(scene_->sight());
  wearable_->tracker().SetCarried(scene_->carried());
  carried_.SetWanted(scene_->carried());
  wearable_->SetSurface(surface());
  const WearableStep& step = wearable_->Step(std::move(frame));
  TrackedFrame next{.frame = step.frame, .tracked = {}};
  TrackedEvent& tracked = next.tracked;
  tracked.camera = step.frame->camera;
  tracked.stages.captured_ns = captured_ns;
  tracked.stages.received_ns = step.frame->received_time_ns;
  tracked.light = wearable_->tracker().light();
  tracked.markers = carried_.Step(*step.frame, captured_ns, *step.snapshot);
  scene_->SetMarkers(tracked.markers);
  scene_layer_.SetLight(tracked.light);
  last_ = std::move(next);
  if (options_.calibration) options_.calibration->OnFrame(step.frame);
  // What nobody may see is in no surface either.
  if (options_.surfaces) {
    if (step.restored) options_.surfaces->Restore(step.restored);
    options_.surfaces->OnMap(step.snapshot->map_generation);
    if (pictures_->MayShow(step.frame->id).ok()) {
      options_.surfaces->OnFrame(step.frame, wearable_->tracker().keyframes());
    }
  }
  for (const AnchorMoved& moved : step.moved) {
    Log(absl::StrFormat("anchor %s moved %.1f mm: %s", moved.id, 1e3 * moved.delta_in_world.norm(),
                        moved.cause));
  }
  if (gaze_) gaze_->OnView(wearable_->View(options_.crop ? MountAngles{} : step.frame->mount));
  const Timestamp end_ns = MonotonicNow();
  last_->tracked.stages.tracked_ns = end_ns;
  tracked_ns_ = end_ns;
  track_ms_.Add(end_ns, 1e-6 * static_cast<double>(end_ns - begin_ns));
  Publish(/*new_frame=*/true);
}

void Engine::TellGap(const Frame& before, const Frame& frame) {
  if (!IsGap(before.capture_time_ns, frame.capture_time_ns)) return;
  if (gap_told_ns_ != 0 && MonotonicNow() - gap_told_ns_ < kGapAgain) return;
  gap_told_ns_ = MonotonicNow();
  const Timestamp gap_ns = frame.capture_time_ns - before.capture_time_ns;
  const auto passed_over = static_cast<std::int64_t>(frame.id - before.id) - 1;
  // Pictures that came and could not be taken are no fault of the stamps.
  if (passed_over > 0 && gap_ns > 0 && !IsGap(0, gap_ns / (passed_over + 1))) {
    Log(
        absl::StrFormat("source %s: %d pictures (%.1f s) were passed over before frame %d: this "
                        "machine is too busy; tracking starts anew",
                        facts_.source, passed_over, Seconds(gap_ns), frame.id));
    return;
  }
  Log(
      absl::StrFormat("source %s: frame %d is stamped %.6g s after frame %d (stamps count "
                      "nanoseconds; was the clock set?): tracking starts anew",
                      facts_.source, frame.id, Seconds(gap_ns), before.id));
}

std::shared_ptr<const GazeSnapshot> Engine::gaze() const {
  static const auto kNoMount = std::make_shared<const GazeSnapshot>();
  return gaze_ ? gaze_->snapshot() : kNoMount;
}

absl::Status Engine::SubmitGaze(GazeCommand command) {
  const auto* steer = std::get_if<SteerGaze>(&command);
  if (options_.crop && steer != nullptr && steer->what == SteerGaze::What::kCalibrate) {
    return absl::FailedPreconditionError(
        "calibrate-mount: crop: turns nothing, so there is nothing to calibrate");
  }
  if (gaze_) return gaze_->Submit(std::move(command));
  return absl::FailedPreconditionError(
      "gaze: no mount: the camera is fixed to the wearer, so ask them to turn (or start the "
      "server with --mount)");
}

// Without a new frame: commands may have changed annotations or map, the store may have answered.
void Engine::Settle() {
  wearable_->Settle();
  if (!last_) return;
  const bool same = last_->tracked.annotations == wearable_->annotations() &&
                    wearable_->newest()->snapshot == published_snapshot_;
  if (!same) Publish(/*new_frame=*/false);
}

void Engine::Publish(bool new_frame) {
  published_snapshot_ = wearable_->newest()->snapshot;
  last_->tracked.snapshot = published_snapshot_;
  last_->tracked.annotations = wearable_->annotations();
  sink_.OnTracked(last_->tracked);
  if (new_frame && on_frame_) on_frame_(last_->frame, last_->tracked);
  if (!pictures_->MayShow(last_->frame->id).ok()) return;
  for (const auto& view : views_) new_frame ? view->Post(*last_) : view->Redraw(*last_);
}

void Engine::RunClock(std::stop_token stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  int seconds = 0;
  while (!never.wait_for(lock, stop, std::chrono::seconds(1), [] { return false; })) {
    if (stop.stop_requested()) return;
    sink_.OnStatistics(Statistics());
    for (const auto& view : views_) view->Tick();
    if (options_.maps) options_.maps->Tick();
    if (++seconds % kTrimEveryS == 0) GiveBackFreedMemory();
    if (seconds % kCodeEveryS == 0 || std::has_single_bit(static_cast<unsigned>(seconds))) {
      GiveBackUnusedCode();
    }
    if (MonotonicNow() - tracked_ns_ > kSourceQuiet) inbox_.PutNewestIfEmpty({});
  }
}

absl::Status Engine::Submit(Command command) {
  for (const PixelTarget* click : ClicksOf(command)) {
    if (absl::Status may = pictures_->MayClick(click->frame_id); !may.ok()) return may;
  }
  return inbox_.Submit(std::move(command));
}

std::shared_ptr<const AnnotationList> Engine::annotations() const {
  return wearable_->annotations();
}

absl::StatusOr<std::vector<Eigen::Vector3d>> Engine::LocatePointer(
    absl::Span<const AnnotationTarget> points, std::optional<StrokeSurface>* surface) {
  const PointerPlacer& placer = wearable_->pointers();
  return surface == nullptr ? placer.Locate(points) : placer.Trace(points, *surface);
}

void Engine::SetPointers(std::shared_ptr<const PointerList> pointers) {
  {
    const std::lock_guard lock(pointers_mutex_);
    pointers_ = std::move(pointers);
  }
  views_[static_cast<std::size_t>(VideoView::kAugmented)]->RedrawNewest();
}

void Engine::ReadPicture(std::string bytes, Done<PicturePtr> done) {
  gallery_.Read(std::move(bytes), std::move(done));
}

void Engine::SetPresence(std::shared_ptr<const ParticipantSet> present) {
  if (gaze_) gaze_->SetPresence(std::move(present));
}

void Engine::SetVideoDemand(VideoView view, bool wanted) {
  views_[static_cast<std::size_t>(view)]->SetDemand(wanted);
}

void Engine::RequestKeyFrame(VideoView view) {
  views_[static_cast<std::size_t>(view)]->RequestKeyFrame();
}

EngineStatistics Engine::Statistics() const {
  const Timestamp now_ns = MonotonicNow();
  const RollingStatistics::Summary track = track_ms_.At(now_ns);
  EngineStatistics statistics;
  statistics.captured_fps = captured_.At(now_ns).rate_hz;
  statistics.tracked_fps = track.rate_hz;
  statistics.track_ms_p50 = track.p50;
  statistics.track_ms_p95 = track.p95;
  statistics.frames_dropped = dropped_ + source_dropped_;
  statistics.bad_frames = bad_frames_;
  for (const auto& view : views_) {
    const RollingStatistics::Summary coded = view->milliseconds();
    statistics.video_bit_rate_bit_s += view->bit_rate_bit_s();
    if (coded.rate_hz < statistics.encoded_fps) continue;
    statistics.encoded_fps = coded.rate_hz;
    statistics.encode_ms_p50 = coded.p50;
    statistics.encode_ms_p95 = coded.p95;
  }
  return statistics;
}

}  // namespace saccade
