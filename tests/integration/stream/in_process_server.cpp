#include "tests/integration/stream/in_process_server.hpp"

#include <cstdio>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "server/store/annotation_store.hpp"

namespace saccade::testing {
namespace {

constexpr int kTextureRange_px = 300, kTextureStep_px = 2;
constexpr FrameId kKeyframeEvery = 8;

int TextureShift(FrameId frame) {
  return static_cast<int>(kTextureStep_px * frame % kTextureRange_px);
}

class MovingTexture final : public FrameSource {
 public:
  explicit MovingTexture(const InProcessOptions& options) : options_(options) {
    CameraIntrinsics intrinsics;
    intrinsics.width = options.width;
    intrinsics.height = options.height;
    intrinsics.fx = intrinsics.fy = 0.8 * options.width;
    intrinsics.cx = 0.5 * (options.width - 1);
    intrinsics.cy = 0.5 * (options.height - 1);
    info_.uri = "test:texture";
    info_.camera = std::make_shared<CameraModel>(intrinsics);
    texture_.create(options.height, options.width + kTextureRange_px, CV_8UC1);
    cv::randu(texture_, 0, 255);
    cv::GaussianBlur(texture_, texture_, cv::Size(0, 0), 4.0);
  }

  const SourceInfo& info() const override { return info_; }
  std::uint64_t bad_frames() const override { return 0; }

  absl::StatusOr<std::optional<Frame>> Next() override {
    if (options_.frames && next_ >= *options_.frames) return std::nullopt;
    std::this_thread::sleep_until(start_ + next_ * std::chrono::nanoseconds(33'333'333));
    Frame frame;
    frame.id = next_++;
    frame.capture_time_ns = frame.received_time_ns = MonotonicNow();
    frame.grey =
        texture_(cv::Rect(TextureShift(frame.id), 0, options_.width, options_.height)).clone();
    frame.camera = info_.camera;
    return frame;
  }

 private:
  const InProcessOptions options_;
  SourceInfo info_;
  cv::Mat texture_;
  std::uint64_t next_ = 0;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class ScriptedTracker final : public FrameTracker {
 public:
  explicit ScriptedTracker(const InProcessOptions& options)
      : before_frame_(options.before_frame),
        lively_(options.lively_features),
        moves_aside_(options.moves_aside) {}

  std::shared_ptr<const MapSnapshot> Track(const Frame& frame) override {
    before_frame_();
    auto snapshot = std::make_shared<MapSnapshot>();
    snapshot->frame_id = frame.id;
    snapshot->capture_time_ns = frame.capture_time_ns;
    snapshot->status = TrackingStatus::kTracking;
    snapshot->quality = TrackingQuality::kGood;
    snapshot->metric = true;
    if (frame.mount) snapshot->world_from_camera = MountModel().MountFromCamera(*frame.mount);
    if (moves_aside_) MoveAside(frame, *snapshot);
    snapshot->map_generation = generation_;
    snapshot->attempted = snapshot->matched = 20;
    const Rigid3 camera_from_world = snapshot->world_from_camera.Inverse();
    for (int i = 0; i < 20; ++i) {
      FeatureSnapshot feature;
      feature.id = static_cast<FeatureId>(i + 1);
      feature.state = FeatureState::kMeasured;
      feature.point_in_world = Eigen::Vector3d(0.25 * (i % 5 - 2), 0.25 * (i / 5 - 1.5), 2.0);
      feature.covariance_in_world = feature.covariance_in_camera =
          1e-6 * Eigen::Matrix3d::Identity();
      feature.depth_known = true;
      feature.pixel = frame.camera->Project(camera_from_world * feature.point_in_world);
      feature.matched_count = 50;
      snapshot->features.push_back(feature);
    }
    for (int i = 0; i < lively_; ++i) {
      FeatureSnapshot feature = snapshot->features[static_cast<std::size_t>(i) % 20];
      feature.id = static_cast<FeatureId>(1000 + i);
      feature.point_in_world.x() += 0.002 * static_cast<double>(frame.id % 10) + 0.01 * i;
      snapshot->features.push_back(feature);
    }
    return snapshot;
  }
  std::shared_ptr<const KeyframePlaces> keyframes() const override { return keyframes_; }
  void Reset() override { ++generation_; }
  absl::StatusOr<FeatureId> SeedFeature(const Frame&, const Rigid3&, const Eigen::Vector2d&, double,
                                        double) override {
    return absl::NotFoundError("scripted: no new features");
  }

 private:
  void MoveAside(const Frame& frame, MapSnapshot& snapshot) {
    constexpr double kTexture_m = 2.0;
    Rigid3& pose = snapshot.world_from_camera;
    pose.translation.x() = TextureShift(frame.id) * kTexture_m / frame.camera->intrinsics().fx;
    if (frame.id % kKeyframeEvery != 0 || kTextureStep_px * frame.id >= kTextureRange_px) return;
    KeyframePlaces places;
    if (keyframes_) places = *keyframes_;
    places.generation = generation_;
    places.metric = true;
    places.keyframes.push_back({static_cast<std::int64_t>(frame.id), frame.id, pose, kTexture_m});
    keyframes_ = std::make_shared<const KeyframePlaces>(std::move(places));
  }

  const std::function<void()> before_frame_;
  const int lively_;
  const bool moves_aside_;
  std::shared_ptr<const KeyframePlaces> keyframes_;
  std::uint64_t generation_ = 0;
};

template <typename T>
T Must(absl::StatusOr<T> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "%s\n", value.status().ToString().c_str());
  std::abort();
}

}  // namespace

InProcessServer::InProcessServer(const InProcessOptions& options) {
  std::unique_ptr<AnnotationStore> store;
  if (!options.data_dir.empty()) store = Must(AnnotationStore::Open(options.data_dir));
  EngineOptions engine_options;
  engine_options.pictures = Must(PictureSwitch::Open(options.data_dir));
  engine_options.version = "test";
  engine_options.mailbox = options.mailbox;
  engine_options.mount = options.mount;
  engine_options.surfaces = options.surfaces;
  engine_ =
      Must(Engine::Create(engine_options, std::make_unique<MovingTexture>(options),
                          std::make_unique<ScriptedTracker>(options), std::move(store), hub_));
  hub_.Connect(engine_.get());
  RpcServerOptions rpc_options;
  rpc_options.port = 0;
  rpc_options.sessions = options.sessions;
  rpc_ = Must(RpcServer::Start(rpc_options, *engine_, hub_));
  engine_->Start();
}

InProcessServer::~InProcessServer() { Stop(); }

void InProcessServer::Stop() {
  hub_.CloseAll(absl::UnavailableError("the server is shutting down"));
  engine_->Stop();
  rpc_->Stop(std::chrono::milliseconds(500));
}

}  // namespace saccade::testing
