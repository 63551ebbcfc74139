#pragma once

#include <Eigen/Dense>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <vector>

#include "server/capture/frame_source.hpp"

namespace saccade {

struct CorridorOptions {
  std::uint64_t seed = 1;  // textures, sway, noise
  double way_m = 24.0;     // that the wearer walks; once round is about 20 m
  double speed_m_s = 0.8;
  /// After the way he comes to rest within 1.5 s (0.6 m at that speed) and stands there so long,
  /// swaying as he walked. 0: the frames end with the way.
  double stand_s = 0.0;
  int width = 640, height = 480;
  /// Focal length that the tracker is told, too short by this share: what nobody calibrated well.
  /// 0.01: 3 px at the picture's rim.
  double lens_error = 0.0;
  double noise = 1.5;  // sigma [grey levels]
  /// Once round he looks ahead, once up, once down, and so on: more landmarks than in one look.
  bool look_round = false;
  bool posters = true;  // the same poster on every side, at the same place
};

/// A corridor that leads round a square block, once round is about 20 m: what no room of the
/// simulated wearable can hold, for loops and large maps. Pinhole, grey, drawn by casting a ray for
/// every pixel; one thread; frame k depends on the options and k alone.
///
/// World: the plane z = 0 of a chessboard (9 x 6 inner corners, 120 mm) on the wall that the wearer
/// faces at the start, 3 m away; x right, y down. He rests for 1.2 s, then walks clockwise, looking
/// a little to the outer wall, and sways. On every side hangs the same poster: who takes one for
/// another is 5 m and a quarter turn off.
class CorridorSource final : public FrameSource {
 public:
  explicit CorridorSource(const CorridorOptions& options);

  const SourceInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Frame>> Next() override;
  std::uint64_t bad_frames() const override { return 0; }

  // Truth.
  Rigid3 WorldFromCamera(FrameId frame) const;
  double Way_m(FrameId frame) const;  // walked so far
  /// The first frame after the way: he slows down. The last frame's id + 1 if he does not stand.
  FrameId StopFrame() const;
  /// The surface point that a pixel of `frame` shows [m, world].
  Eigen::Vector3d PointAt(FrameId frame, const Eigen::Vector2d& pixel) const;
  /// Length of once round [m].
  static double Round_m();

 private:
  enum Surface { kFloor, kCeiling, kOuter0, kInner0 = kOuter0 + 4, kSurfaces = kInner0 + 4 };
  struct Hit {
    int surface = 0;
    double range = 0.0;       // along the direction as given
    double cosine = 1.0;      // of the direction (not unit) to the normal
    double u = 0.0, v = 0.0;  // [m] on the surface
  };
  static Hit Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);
  double WalkEnd_s() const;
  double GazePitch(double way) const;
  void Paint();
  cv::Mat PaintWall(std::mt19937_64& random, int width, int height) const;
  double Look(const Hit& hit, double length) const;
  Rigid3 RoomFromCamera(FrameId frame) const;
  cv::Mat Draw(const Rigid3& room_from_camera) const;

  CorridorOptions options_;
  SourceInfo info_;
  std::array<std::vector<cv::Mat>, kSurfaces> looks_;  // each with its smaller copies
  std::array<double, 6> phases_{};
  FrameId next_ = 0;
};

}  // namespace saccade
