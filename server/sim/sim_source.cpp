#include "server/sim/sim_source.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "server/sim/room.hpp"

namespace saccade {

namespace {

constexpr int kHeadSamples = 9;  // of the head's motion in one exposure

}  // namespace

SimSource::SimSource(const SimOptions& options, const SourceOptions& source)
    : options_(options),
      source_(source),
      wearer_(options.motion, options.seed, options.start),
      true_camera_(options.TrueIntrinsics()) {
  info_.uri = "sim:desk";
  info_.camera = std::make_shared<CameraModel>(options.Intrinsics());
  info_.target = SimChessboard();
  next_ = source.first_frame;
  if (options.duration_s) {
    info_.frame_count = static_cast<std::uint64_t>(std::floor(*options.duration_s * options.fps));
  }
  if (source.end_frame) {
    info_.frame_count = std::min(info_.frame_count.value_or(*source.end_frame), *source.end_frame);
  }
}

absl::StatusOr<std::unique_ptr<SimSource>> SimSource::Open(const SimOptions& options,
                                                           const SourceOptions& source,
                                                           GlBackend backend) {
  if (const absl::Status valid = options.Validate(); !valid.ok()) return valid;
  if (!source.camera_file.empty()) {
    return absl::InvalidArgumentError(
        "source sim: the simulated camera knows its lens; leave --camera out");
  }
  auto made = std::unique_ptr<SimSource>(new SimSource(options, source));
  if (const absl::Status started = made->Start(backend); !started.ok()) return started;
  return made;
}

absl::StatusOr<std::unique_ptr<SimSource>> SimSource::OpenUri(absl::string_view rest,
                                                              const SourceOptions& source,
                                                              GlBackend backend) {
  const std::string uri = absl::StrCat("sim:", rest);
  const absl::StatusOr<SimOptions> options = SimOptions::FromUri(uri);
  if (!options.ok()) return options.status();
  absl::StatusOr<std::unique_ptr<SimSource>> made = Open(*options, source, backend);
  if (made.ok()) (*made)->info_.uri = uri;
  return made;
}

absl::Status SimSource::Start(GlBackend backend) {
  auto scene = std::make_shared<RoomScene>(BuildRoom(options_.seed));
  caster_ = std::make_unique<RayCaster>(*scene);
  objects_ = scene->objects;
  thread_ = std::make_unique<RenderThread>();
  return thread_
      ->Submit([this, scene, backend]() -> absl::Status {
        absl::StatusOr<std::unique_ptr<SimCamera>> camera =
            SimCamera::Create(*scene, true_camera_, options_, wearer_, backend);
        if (!camera.ok()) return camera.status();
        camera_ = *std::move(camera);
        return absl::OkStatus();
      })
      .get();
}

SimSource::~SimSource() {
  // The context dies on the thread that it belongs to.
  thread_->Submit([this] { camera_.reset(); }).wait();
}

Timestamp SimSource::CaptureTime(FrameId frame) const {
  // Even times are counted in nanoseconds, as ever.
  const double time_ns = options_.jitter_s > 0.0 ? 1e9 * options_.TimeOf(frame)
                                                 : static_cast<double>(frame) * 1e9 / options_.fps;
  return clock_zero_ns_.value_or(0) + static_cast<Timestamp>(std::llround(time_ns));
}

void SimSource::Request(FrameId frame) {
  requested_ = frame;
  picture_ = thread_->Submit([this, frame, path = PathOf(frame)] {
    return camera_->Take(frame, path, /*with_noise=*/true);
  });
}

void SimSource::DriveHead(std::shared_ptr<SimulatedHead> head) {
  head_ = std::move(head);
  info_.mount = std::make_shared<const MountModel>(head_->model());
}

HeadPath SimSource::PathOf(FrameId frame) {
  HeadPath path;
  if (head_ == nullptr) return path;
  const Timestamp middle = CaptureTime(frame);
  const auto half = static_cast<Timestamp>(std::llround(0.5e9 * options_.exposure_s));
  head_->AdvanceTo(middle + half);
  for (int k = 0; k < kHeadSamples; ++k) {
    const Timestamp at = middle - half + 2 * half * k / (kHeadSamples - 1);
    path.shoulder_from_camera.push_back(head_->true_model().MountFromCamera(head_->TrueAngles(at)));
  }
  const std::lock_guard lock(heads_mutex_);
  heads_[frame] = head_->TrueAngles(middle);
  return path;
}

std::optional<MountAngles> SimSource::TrueHead(FrameId frame) const {
  const std::lock_guard lock(heads_mutex_);
  const auto drawn = heads_.find(frame);
  if (drawn == heads_.end()) return std::nullopt;
  return drawn->second;
}

FrameId SimSource::WaitForTurn() {
  if (!source_.realtime) {
    clock_zero_ns_ = 0;
    return next_;
  }
  const auto ready_after =
      static_cast<Timestamp>(std::llround(0.5 * options_.exposure_s * 1e9));  // shutter closes
  const Timestamp now = MonotonicNow();
  if (!clock_zero_ns_) {
    clock_zero_ns_ = 0;
    clock_zero_ns_ = now - CaptureTime(next_);
  }
  // The newest picture whose exposure has ended; those before it are lost on a late reader.
  const double elapsed_s = Seconds(now - ready_after - *clock_zero_ns_);
  const auto newest = static_cast<std::int64_t>(std::floor(elapsed_s * options_.fps));
  const FrameId frame = std::max(next_, static_cast<FrameId>(std::max<std::int64_t>(newest, 0)));
  const std::chrono::steady_clock::time_point due{
      std::chrono::nanoseconds(CaptureTime(frame) + ready_after)};
  std::this_thread::sleep_until(due);
  return frame;
}

absl::StatusOr<std::optional<Frame>> SimSource::Next() {
  if (info_.frame_count && next_ >= *info_.frame_count) return std::nullopt;
  if (!picture_.valid() && head_ == nullptr) Request(next_);
  const FrameId id = WaitForTurn();
  if (info_.frame_count && id >= *info_.frame_count) return std::nullopt;
  if (requested_ != id || !picture_.valid()) Request(id);
  absl::StatusOr<cv::Mat> picture = picture_.get();
  if (!picture.ok()) return picture.status();
  next_ = id + 1;
  if (head_ == nullptr && (!info_.frame_count || next_ < *info_.frame_count)) Request(next_);
  Frame frame;
  frame.id = id;
  frame.capture_time_ns = CaptureTime(id);
  frame.color = *std::move(picture);
  cv::cvtColor(frame.color, frame.grey, cv::COLOR_BGR2GRAY);
  frame.camera = info_.camera;
  if (head_ != nullptr) frame.mount = head_->ReadAngles(frame.capture_time_ns);
  frame.received_time_ns = MonotonicNow();
  if (truth_writer_) {
    if (const absl::Status written = truth_writer_->Write(Truth(id)); !written.ok()) return written;
  }
  return frame;
}

absl::Status SimSource::WriteTruthTo(const std::filesystem::path& file) {
  absl::StatusOr<std::unique_ptr<SimTruthWriter>> writer = SimTruthWriter::Open(file);
  if (!writer.ok()) return writer.status();
  truth_writer_ = *std::move(writer);
  return absl::OkStatus();
}

Rigid3 SimSource::WorldFromCamera(FrameId frame) const {
  const Rigid3 shoulder = wearer_.WorldFromShoulder(options_.TimeOf(frame));
  if (head_ == nullptr) return shoulder;
  return shoulder * head_->model().MountFromCamera(TrueHead(frame).value_or(MountAngles{}));
}

Rigid3 SimSource::WorldFromCameraAt(Timestamp time_ns) const {
  const Rigid3 shoulder =
      wearer_.WorldFromShoulder(std::max(0.0, Seconds(time_ns - clock_zero_ns_.value_or(0))));
  if (head_ == nullptr) return shoulder;
  return shoulder * head_->model().MountFromCamera(head_->TrueAngles(time_ns));
}

std::optional<double> SimSource::SurfaceAlong(const Eigen::Vector3d& origin_in_world,
                                              const Eigen::Vector3d& direction_in_world) const {
  const std::optional<RayHit> hit =
      caster_->Closest(origin_in_world.cast<float>(), direction_in_world.cast<float>());
  if (!hit) return std::nullopt;
  return static_cast<double>(hit->distance);
}

SimTruth SimSource::Truth(FrameId frame) const {
  SimTruth truth;
  truth.frame = frame;
  truth.capture_time_ns = CaptureTime(frame);
  truth.world_from_camera = WorldFromCamera(frame);
  truth.head = TrueHead(frame).value_or(MountAngles{});
  for (const NamedPoint& object : objects_) {
    truth.objects.push_back({object.name, object.point_in_world,
                             PixelOf(frame, object.point_in_world),
                             Visible(frame, object.point_in_world)});
  }
  return truth;
}

std::optional<Eigen::Vector2d> SimSource::PixelOf(FrameId frame,
                                                  const Eigen::Vector3d& point_in_world) const {
  return true_camera_.Project(WorldFromCamera(frame).Inverse() * point_in_world);
}

std::optional<Eigen::Vector3d> SimSource::PointAt(FrameId frame,
                                                  const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> bearing = true_camera_.Unproject(pixel);
  if (!bearing) return std::nullopt;
  const Rigid3 world_from_camera = WorldFromCamera(frame);
  const Eigen::Vector3d direction = world_from_camera.rotation * *bearing;
  const std::optional<RayHit> hit =
      caster_->Closest(world_from_camera.translation.cast<float>(), direction.cast<float>());
  if (!hit) return std::nullopt;
  return world_from_camera.translation + static_cast<double>(hit->distance) * direction;
}

bool SimSource::Visible(FrameId frame, const Eigen::Vector3d& point_in_world,
                        double tolerance_m) const {
  const std::optional<Eigen::Vector2d> pixel = PixelOf(frame, point_in_world);
  if (!pixel || !true_camera_.InImage(*pixel)) return false;
  const Eigen::Vector3d eye = WorldFromCamera(frame).translation;
  const Eigen::Vector3d line = point_in_world - eye;
  const double distance = line.norm();
  const std::optional<RayHit> hit =
      caster_->Closest(eye.cast<float>(), (line / distance).cast<float>());
  return !hit || static_cast<double>(hit->distance) > distance - tolerance_m;
}

HeadPath SimSource::StillHead(FrameId frame) const {
  const std::optional<MountAngles> angles = TrueHead(frame);
  if (head_ == nullptr || !angles) return {};
  return {{head_->model().MountFromCamera(*angles)}};
}

absl::StatusOr<cv::Mat> SimSource::RenderClean(FrameId frame) {
  return thread_
      ->Submit(
          [this, frame] { return camera_->Take(frame, StillHead(frame), /*with_noise=*/false); })
      .get();
}

absl::StatusOr<cv::Mat> SimSource::RenderDepth(FrameId frame) {
  return thread_
      ->Submit([this, frame] { return camera_->Depth(options_.TimeOf(frame), StillHead(frame)); })
      .get();
}

}  // namespace saccade
