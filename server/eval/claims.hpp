#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// Where and when an anchor was placed; truth beside it.
struct PlacedAnchor {
  std::string id;
  int number = 0;
  double time_s = 0;                                // of the newest frame then
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // clicked
  double range_m = 0;                               // true
  bool outline = false;  // a few pixels beside the click another surface is seen
  Eigen::Vector3d true_point = Eigen::Vector3d::Zero();
};

/// A frame in which anchors are compared with truth.
struct ClaimFrame {
  double time_s = 0;
  bool posed = false;   // the frame has a pose that is meant to be believed
  bool metric = false;  // the map has metres
  const CameraModel* camera = nullptr;
  Rigid3 world_from_camera;  // estimated
  Rigid3 true_world_from_camera;
};

/// What one anchor said in one frame, and what was true.
struct Claim {
  PlacedAnchor placed;
  double time_s = 0;
  bool posed = false, metric = false;
  AnchorState state = AnchorState::kStopped;
  AnchorMethod method = AnchorMethod::kPoint;
  double claimed = 0;                // error_m: [m], or map units where the map has no metres
  std::optional<double> claimed_px;  // nothing while the anchor is out of view
  std::optional<double> error_px;    // nothing while the true point is out of view or hidden
  Eigen::Vector3d estimate_in_camera = Eigen::Vector3d::Zero();  // units of the map
  Eigen::Vector3d true_in_camera = Eigen::Vector3d::Zero();      // [m]
  std::string reason;

  double age_s() const { return time_s - placed.time_s; }
  /// 3D error in the camera's frame [m]; `scale`: true metres per unit of the map.
  double ErrorM(double scale) const { return (scale * estimate_in_camera - true_in_camera).norm(); }
};

/// Whether what anchors claim is true: each anchor's claim once a second, beside the truth.
///
/// Errors are in the camera's frame: the estimated point by the estimated pose against the true
/// point by the true pose, as people see it. Where the map has no metres the estimate is multiplied
/// by the scale of the whole trajectory, which is not known before its end: rows wait until then.
class ClaimLog {
 public:
  void Place(const PlacedAnchor& placed) { placed_.push_back({placed, std::nullopt}); }

  /// Every frame: notes who is trusted; once a second adds a claim of every anchor.
  /// `sees(point)`: whether the true point is in the picture and not hidden.
  void Observe(const ClaimFrame& frame, const std::vector<Annotation>& annotations,
               const std::function<bool(const Eigen::Vector3d&)>& sees);

  /// claims.csv; `scale`: true metres per unit of the map (1: it is metric).
  absl::Status Write(const std::filesystem::path& file, double scale) const;

  const std::vector<Claim>& claims() const { return claims_; }
  std::size_t anchors() const { return placed_.size(); }
  /// Anchors that were TRACKING at some time within `seconds` of their placing.
  std::size_t TrustedWithin(double seconds) const;

 private:
  struct Watched {
    PlacedAnchor placed;
    std::optional<double> trusted_s;  // after so long, first
  };
  std::vector<Watched> placed_;
  std::vector<Claim> claims_;
  double next_s_ = 0;
};

/// What the claims of several runs come to. A sighting is a claim in a frame that has a pose.
class ClaimTotals {
 public:
  void Add(const ClaimLog& log, double scale);
  void Add(const ClaimTotals& other);
  /// Of the sightings that claim to be tracking: the share beyond 3 sigma and the median of error
  /// over claim, by length and by pixels: in all, by method, by age, on and off outlines.
  nlohmann::ordered_json Report() const;

 private:
  struct Row {
    AnchorMethod method;
    bool outline;
    double age_s;
    double ratio_m;
    std::optional<double> ratio_px;
  };
  std::vector<Row> tracking_;
  std::uint64_t sightings_ = 0, anchors_ = 0, trusted_within_3s_ = 0;
  std::uint64_t far_ = 0, far_unsaid_ = 0;  // anchors
};

/// "plane", "median depth" ...
const char* ToString(AnchorMethod method);
const char* ToString(AnchorState state);

}  // namespace saccade
