#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "server/app/frame_clock.hpp"
#include "server/app/gaze_runner.hpp"
#include "server/app/map_keeper.hpp"
#include "server/app/picture_gallery.hpp"
#include "server/app/picture_switch.hpp"
#include "server/app/scene_keeper.hpp"
#include "server/app/scene_layer.hpp"
#include "server/app/surface_runner.hpp"
#include "server/app/view_encoder.hpp"
#include "server/capture/frame_source.hpp"
#include "server/overlay/overlay.hpp"
#include "server/pipeline/inbox.hpp"
#include "server/pipeline/rolling_statistics.hpp"
#include "server/rpc/backend.hpp"
#include "server/tracker/carried_squares.hpp"
#include "server/wearable/wearable.hpp"

namespace saccade {

class CalibrationDesk;

struct EngineOptions {
  std::string version;
  bool every_frame = false;      // --speed max: the source waits for the tracker, nothing dropped
  int video_bit_rate_bit_s = 0;  // per view; 0: by picture size
  std::size_t mailbox = 64;      // commands that may wait for the tracker thread
  AnchorOptions anchors;
  OverlayOptions overlay;
  std::shared_ptr<Mount> mount;  // null: the camera is fixed to the wearer
  /// Digital gaze: `mount` turns this crop of the picture, which the augmented view then shows, and
  /// the camera itself is fixed.
  std::optional<CameraIntrinsics> crop;
  GazeOptions gaze;
  std::shared_ptr<PictureSwitch> pictures;       // null: one that keeps nothing
  std::shared_ptr<SceneKeeper> scene;            // likewise
  std::shared_ptr<MapKeeper> maps;               // null: maps end with the run
  std::shared_ptr<SurfaceRunner> surfaces;       // null: none are made
  std::shared_ptr<CalibrationDesk> calibration;  // null: nobody calibrates the camera
  GlBackend gl = GlBackend::kOsmesa;
};

/// Capture to packets: owns the threads and what they share.
///
///   source thread   FrameSource::Next
///   tracker thread  the wearable: commands, frames; publishes to the sink
///   gaze thread     where there is a mount: steers it
///   view threads    one per view: draw, code
///   surface thread  where there are surfaces: SurfaceRunner
///   still thread    PNG for GetFrame
///   clock thread    statistics once a second
class Engine : public Backend {
 public:
  /// `journal` may be null: annotations are kept in memory alone. `sink` outlives the engine.
  static absl::StatusOr<std::unique_ptr<Engine>> Create(EngineOptions options,
                                                        std::unique_ptr<FrameSource> source,
                                                        std::unique_ptr<FrameTracker> tracker,
                                                        std::unique_ptr<AnnotationJournal> journal,
                                                        EventSink& sink);
  ~Engine() override;

  /// Told of each frame after it was published, on the tracker's thread: must not block. Before
  /// Start().
  using FrameListener =
      std::function<void(const std::shared_ptr<const Frame>&, const TrackedEvent&)>;
  void SetFrameListener(FrameListener listener) { on_frame_ = std::move(listener); }
  void Start();
  /// Ends the threads and answers every command. May be called twice.
  void Stop();
  /// Waits until every change that was accepted is on disk, at most `limit`. Any thread, also while
  /// Stop() waits for a frame.
  absl::Status FlushStore(std::chrono::milliseconds limit);

  absl::Status Submit(Command command) override;
  const ServerFacts& facts() const override { return facts_; }
  std::shared_ptr<const AnnotationList> annotations() const override;
  std::shared_ptr<const GazeSnapshot> gaze() const override;
  absl::Status SubmitGaze(GazeCommand command) override;
  void GetStill(std::optional<FrameId> frame_id, VideoView view, Done<Still> done) override;
  absl::StatusOr<std::vector<Eigen::Vector3d>> LocatePointer(
      absl::Span<const AnnotationTarget> points, std::optional<StrokeSurface>* surface) override;
  void SetPointers(std::shared_ptr<const PointerList> pointers) override;
  void ReadPicture(std::string bytes, Done<PicturePtr> done) override;
  void SetPresence(std::shared_ptr<const ParticipantSet> present) override;
  void SetVideoDemand(VideoView view, bool wanted) override;
  void RequestKeyFrame(VideoView view) override;
  void PausePicture(bool paused, std::string by, Done<PicturePause> done) override;
  std::shared_ptr<const PicturePause> picture_pause() const override;
  std::shared_ptr<const Scene> scene() const override;
  SceneLight light() const override { return scene_layer_.light(); }
  std::shared_ptr<const SurfaceSnapshot> surface() const override {
    return options_.surfaces ? options_.surfaces->newest() : nullptr;
  }
  absl::Status SubmitScene(SceneCommand command) override;
  KeptMaps* maps() override { return options_.maps.get(); }
  /// Before Start(): the first frames are looked at for it. Errors as FrameTracker::Resume.
  absl::Status Resume(const StoredWorld& stored) { return wearable_->Resume(stored); }

 private:
  // What the tracker thread waits for: a frame, the end of the source, or (neither) a second
  // without frames, in which commits still have to be settled.
  struct Input {
    std::optional<Frame> frame;
    bool end_of_source = false;
  };
  struct StillRequest {
    PastFrame past;
    VideoView view;
    Done<Still> done;
  };

  Engine(EngineOptions options, std::unique_ptr<FrameSource> source, EventSink& sink);

  void OnPicturePause(const std::shared_ptr<const PicturePause>& state);
  void RunSource(std::stop_token stop);
  void RunTracker(std::stop_token stop);
  void RunClock(std::stop_token stop);
  void Track(Frame frame);
  /// Says on stderr, at most every five seconds, that two frames in a row are too far apart in
  /// time.
  void TellGap(const Frame& before, const Frame& frame);
  void Settle();
  void Publish(bool new_frame);
  void MakeStill(StillRequest request);
  EngineStatistics Statistics() const;
  /// `waits`: for pinned pictures that are not decoded yet; else they come with a later frame.
  cv::Mat DrawAugmented(const TrackedFrame& frame, bool waits) const;

  const EngineOptions options_;
  ServerFacts facts_;
  EventSink& sink_;
  const std::shared_ptr<PictureSwitch> pictures_;
  const std::shared_ptr<SceneKeeper> scene_;
  std::unique_ptr<FrameSource> source_;  // source thread
  std::unique_ptr<Wearable> wearable_;   // tracker thread, but for what says otherwise
  Inbox<Input, Command> inbox_;
  std::array<std::unique_ptr<ViewEncoder>, kVideoViews> views_;

  // Tracker thread.
  FrameClock clock_;
  std::optional<TrackedFrame> last_;
  std::shared_ptr<const MapSnapshot> published_snapshot_;
  Timestamp gap_told_ns_ = 0;  // MonotonicNow() of the last word on a gap
  CarriedSquares carried_;

  RollingStatistics captured_, track_ms_;
  std::atomic<std::uint64_t> frames_ = 0, dropped_ = 0, source_dropped_ = 0, bad_frames_ = 0;
  std::atomic<Timestamp> tracked_ns_ = 0;  // when a frame last came

  std::unique_ptr<GazeRunner> gaze_;  // null: no mount

  mutable PictureGallery gallery_;
  mutable SceneLayer scene_layer_;
  mutable std::mutex pointers_mutex_;
  std::shared_ptr<const PointerList> pointers_;  // null: none so far

  FrameListener on_frame_;  // null: nobody listens

  Runner<StillRequest> stills_;
  std::jthread source_thread_, tracker_thread_, clock_thread_;
  bool stopped_ = false;
};

}  // namespace saccade
