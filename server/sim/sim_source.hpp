#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "server/capture/frame_source.hpp"
#include "server/capture/source.hpp"
#include "server/gl/gl_context.hpp"
#include "server/mount/simulated_head.hpp"
#include "server/sim/ray_caster.hpp"
#include "server/sim/render_thread.hpp"
#include "server/sim/sim_camera.hpp"
#include "server/sim/sim_options.hpp"
#include "server/sim/sim_truth.hpp"
#include "server/sim/wearer.hpp"

namespace saccade {

/// The simulated wearable as a source of frames (`sim:desk`).
///
/// Frame k shows the moment k / fps and depends on the options and k alone. Pictures are drawn on a
/// thread of the source's own, one frame ahead. On a driven head (DriveHead) a picture is drawn
/// when it is asked for, since it depends on what the head was told until then. With `realtime` the
/// frames keep the wall clock and a late reader misses frames, as with a camera; without it every
/// frame comes, as fast as it can be drawn, stamped k / fps.
class SimSource final : public FrameSource {
 public:
  ~SimSource() override;

  static absl::StatusOr<std::unique_ptr<SimSource>> Open(const SimOptions& options,
                                                         const SourceOptions& source = {},
                                                         GlBackend backend = GlBackend::kOsmesa);
  /// For SourceRegistry::Add("sim", ...): `rest` is what follows "sim:".
  static absl::StatusOr<std::unique_ptr<SimSource>> OpenUri(absl::string_view rest,
                                                            const SourceOptions& source,
                                                            GlBackend backend = GlBackend::kOsmesa);

  const SourceInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Frame>> Next() override;
  std::uint64_t bad_frames() const override { return 0; }

  /// The head that turns the camera; its clock is that of the capture times. Before the first
  /// Next(). Frames then carry what its encoders said at mid-exposure.
  void DriveHead(std::shared_ptr<SimulatedHead> head);

  /// From now on the truth of each frame is written before Next() hands the frame out.
  absl::Status WriteTruthTo(const std::filesystem::path& file);

  /// The lens that the pictures are truly taken with (info().camera is off by `lens_error_px`).
  const CameraModel& true_camera() const { return true_camera_; }

  // Truth: for tests and evaluation only. Any thread, any frame id, whether handed out or not.

  SimTruth Truth(FrameId frame) const;
  Rigid3 WorldFromCamera(FrameId frame) const;
  /// At any moment that the head has been at: capture time [ns].
  Rigid3 WorldFromCameraAt(Timestamp time_ns) const;
  const Wearer& wearer() const { return wearer_; }
  /// Named objects of the room.
  const std::vector<NamedPoint>& objects() const { return objects_; }
  /// Distance to the first surface from `origin` along `direction` (unit) [m].
  std::optional<double> SurfaceAlong(const Eigen::Vector3d& origin_in_world,
                                     const Eigen::Vector3d& direction_in_world) const;
  /// The surface point that `pixel` (of the distorted picture) of `frame` shows, in world [m].
  std::optional<Eigen::Vector3d> PointAt(FrameId frame, const Eigen::Vector2d& pixel) const;
  /// Pixel of a world point in `frame`, as CameraModel::Project.
  std::optional<Eigen::Vector2d> PixelOf(FrameId frame,
                                         const Eigen::Vector3d& point_in_world) const;
  /// Whether a point on a surface can be seen: in the picture, nothing nearer on its ray than
  /// `tolerance_m` before it.
  bool Visible(FrameId frame, const Eigen::Vector3d& point_in_world,
               double tolerance_m = 0.006) const;
  /// The picture of `frame` without noise; blur (but of the head's turning), gain and vignetting as
  /// captured.
  absl::StatusOr<cv::Mat> RenderClean(FrameId frame);
  /// Depth along the optic axis by the drawn picture [m], CV_32FC1.
  absl::StatusOr<cv::Mat> RenderDepth(FrameId frame);

 private:
  SimSource(const SimOptions& options, const SourceOptions& source);
  absl::Status Start(GlBackend backend);
  Timestamp CaptureTime(FrameId frame) const;
  /// The frame to hand out next; waits for its time if the source keeps the clock.
  FrameId WaitForTurn();
  void Request(FrameId frame);
  /// What the head did during the exposure of `frame`; it has moved that far when this returns.
  HeadPath PathOf(FrameId frame);
  std::optional<MountAngles> TrueHead(FrameId frame) const;
  HeadPath StillHead(FrameId frame) const;  // as it was at mid-exposure

  SimOptions options_;
  SourceOptions source_;
  SourceInfo info_;
  Wearer wearer_;
  CameraModel true_camera_;  // that takes the pictures; info_.camera is what others are told
  std::vector<NamedPoint> objects_;
  std::unique_ptr<RayCaster> caster_;
  std::unique_ptr<SimTruthWriter> truth_writer_;
  std::unique_ptr<SimCamera> camera_;  // touched on thread_ alone
  FrameId next_ = 0;
  std::optional<Timestamp> clock_zero_ns_;  // capture time of frame 0, once the source runs
  std::shared_ptr<SimulatedHead> head_;
  mutable std::mutex heads_mutex_;
  std::map<FrameId, MountAngles> heads_;  // of the frames drawn so far
  FrameId requested_ = 0;
  std::future<absl::StatusOr<cv::Mat>> picture_;  // of requested_
  std::unique_ptr<RenderThread> thread_;
};

}  // namespace saccade
