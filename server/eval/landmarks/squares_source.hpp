#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "server/capture/frame_source.hpp"
#include "server/eval/landmarks/hall_thing.hpp"
#include "server/markers/square_map.hpp"

namespace saccade {

struct HallOptions {
  std::uint64_t seed = 1;
  HallMotion motion = HallMotion::kSquares;
  double duration_s = 20;
  double noise = 2.0;  // sigma [grey levels]
  int width = 768, height = 576;
  double fps = 25;
};

/// A hall with square markers on its walls, drawn exactly: a pinhole camera, one ray a pixel into
/// painted walls that are smoothed to the pixel's size, the lens's blur, noise. Frame k depends on
/// the options and k alone. World: x right along the front wall, y down, z towards it.
class SquaresSource final : public FrameSource {
 public:
  static absl::StatusOr<std::unique_ptr<SquaresSource>> Create(const HallOptions& options);

  const SourceInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Frame>> Next() override;
  std::uint64_t bad_frames() const override { return 0; }

  // Truth.
  Rigid3 WorldFromCamera(FrameId frame) const;
  const SquareMap& squares() const { return map_; }
  /// Whether something is held before square `k` of the map, or stands before all of it.
  bool Covered(FrameId frame, std::size_t k) const;
  /// Whether something is between the camera and corner `c` of square `k`.
  bool Hidden(FrameId frame, std::size_t k, int c) const;
  /// What stands in the hall, or walks there, in this frame.
  Eigen::AlignedBox3d ThingAt(FrameId frame) const;
  /// When half of the squares, and all of them, are covered: [from, until) in seconds.
  struct Span {
    double from_s, until_s;
    bool Holds(double time_s) const { return time_s >= from_s && time_s < until_s; }
  };
  static constexpr Span kHalf{4.0, 7.0}, kAll{10.0, 12.0};

 private:
  enum Wall { kFront, kRight, kBack, kLeft, kFloor, kCeiling, kWalls };
  explicit SquaresSource(const HallOptions& options);
  absl::Status HangSquares();
  void Paint();
  double TimeOf(FrameId frame) const { return static_cast<double>(frame) / options_.fps; }
  Rigid3 PoseAt(double time_s) const;
  double Look(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
              const Eigen::AlignedBox3d& thing) const;
  cv::Mat Draw(FrameId frame) const;
  void Cover(FrameId frame, cv::Mat& picture) const;

  HallOptions options_;
  SourceInfo info_;
  SquareMap map_;
  std::vector<cv::Mat> codes_;                      // cells of each square, 0 or 1
  std::array<std::vector<cv::Mat>, kWalls> looks_;  // each with its smaller copies
  std::array<double, 16> phases_{};
  FrameId next_ = 0;
};

}  // namespace saccade
