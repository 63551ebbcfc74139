#include "server/sim/sim_source.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "server/sim/room.hpp"

namespace saccade {

SimSource::SimSource(const SimOptions& options, const SourceOptions& source)
    : options_(options), source_(source), wearer_(options.motion, options.seed) {
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
            SimCamera::Create(*scene, *info_.camera, options_, wearer_, backend);
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
  return clock_zero_ns_.value_or(0) +
         static_cast<Timestamp>(std::llround(static_cast<double>(frame) * 1e9 / options_.fps));
}

void SimSource::Request(FrameId frame) {
  requested_ = frame;
  picture_ = thread_->Submit([this, frame] { return camera_->Take(frame, /*with_noise=*/true); });
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
  if (!picture_.valid()) Request(next_);
  const FrameId id = WaitForTurn();
  if (info_.frame_count && id >= *info_.frame_count) return std::nullopt;
  if (requested_ != id) Request(id);
  absl::StatusOr<cv::Mat> picture = picture_.get();
  if (!picture.ok()) return picture.status();
  next_ = id + 1;
  if (!info_.frame_count || next_ < *info_.frame_count) Request(next_);
  Frame frame;
  frame.id = id;
  frame.capture_time_ns = CaptureTime(id);
  frame.color = *std::move(picture);
  cv::cvtColor(frame.color, frame.grey, cv::COLOR_BGR2GRAY);
  frame.camera = info_.camera;
  frame.mount = MountAngles{};
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
  return wearer_.WorldFromCamera(static_cast<double>(frame) / options_.fps, {});
}

SimTruth SimSource::Truth(FrameId frame) const {
  SimTruth truth;
  truth.frame = frame;
  truth.capture_time_ns = CaptureTime(frame);
  truth.world_from_camera = WorldFromCamera(frame);
  for (const NamedPoint& object : objects_) {
    truth.objects.push_back({object.name, object.point_in_world,
                             PixelOf(frame, object.point_in_world),
                             Visible(frame, object.point_in_world)});
  }
  return truth;
}

std::optional<Eigen::Vector2d> SimSource::PixelOf(FrameId frame,
                                                  const Eigen::Vector3d& point_in_world) const {
  return info_.camera->Project(WorldFromCamera(frame).Inverse() * point_in_world);
}

std::optional<Eigen::Vector3d> SimSource::PointAt(FrameId frame,
                                                  const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> bearing = info_.camera->Unproject(pixel);
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
  if (!pixel || !info_.camera->InImage(*pixel)) return false;
  const Eigen::Vector3d eye = WorldFromCamera(frame).translation;
  const Eigen::Vector3d line = point_in_world - eye;
  const double distance = line.norm();
  const std::optional<RayHit> hit =
      caster_->Closest(eye.cast<float>(), (line / distance).cast<float>());
  return !hit || static_cast<double>(hit->distance) > distance - tolerance_m;
}

absl::StatusOr<cv::Mat> SimSource::RenderClean(FrameId frame) {
  return thread_->Submit([this, frame] { return camera_->Take(frame, /*with_noise=*/false); })
      .get();
}

absl::StatusOr<cv::Mat> SimSource::RenderDepth(FrameId frame) {
  return thread_
      ->Submit([this, frame] { return camera_->Depth(static_cast<double>(frame) / options_.fps); })
      .get();
}

}  // namespace saccade
