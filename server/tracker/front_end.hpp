#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/capture/frame_source.hpp"
#include "server/features/image_pyramid.hpp"
#include "server/features/target_detector.hpp"
#include "server/filter/point_model.hpp"
#include "server/map/landmark.hpp"

namespace saccade {

/// Where a landmark is sought, and what it should look like from there.
struct LandmarkQuery {
  const Landmark* landmark = nullptr;  // its look, as first seen
  PointFromClone birth;                // where that was, and where the point is from there
  Rigid3 world_from_camera;            // taken for this frame's pose
  Eigen::Vector2d centre;              // of the ellipse [px, distorted]
  Eigen::Matrix2d spread;              // its covariance, measurement noise included [px^2]
};

/// What came of it.
struct LandmarkSighting {
  enum class Kind {
    kNotSought,  // not seen from here, or beyond the picture: no attempt
    kHidden,     // nothing but blank where it should be: no attempt
    kMissed,
    kFound,
  };
  Kind kind = Kind::kNotSought;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();       // kFound [px]
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  // of the comparison [px^2]
  double searched_px2 = 0.0;                             // area of the ellipse
};

/// A target's patches in this frame.
struct PatchesSeen {
  TargetObservation observation;
  std::vector<PatchTemplate> looks;  // entry k: of target.points[k], as seen from the start pose
};

/// The newest frame, and all that the tracker and its rules ask of it. In the product it is made of
/// pixels (PictureFrontEnd); at feature level, of points (server/eval/points_front_end).
///
/// One thread. What is asked before the first Take() is not found.
class FrontEnd {
 public:
  virtual ~FrontEnd() = default;
  /// Whether the source can be tracked by this front end. InvalidArgument names what is missing.
  virtual absl::Status Check(const SourceInfo& source) const = 0;

  /// True if this frame shows to the bit what the one taken before showed.
  virtual bool Repeats(const Frame& frame) const = 0;
  /// Makes it the newest; false if it is of no use.
  virtual bool Take(const Frame& frame) = 0;

  virtual LandmarkSighting Find(const LandmarkQuery& query) = 0;
  /// What could become a landmark, best first, away from `occupied`; at most `most` [px].
  virtual std::vector<Eigen::Vector2d> Corners(std::span<const Eigen::Vector2d> occupied,
                                               int most) = 0;
  /// The look of a new landmark at `pixel`; nothing if it could not be found again.
  virtual std::optional<PatchTemplate> Cut(const Eigen::Vector2d& pixel) = 0;

  /// NotFound, FailedPrecondition: as the detectors (server/features/target_detector.hpp).
  virtual absl::StatusOr<TargetObservation> FindChessboard(
      const ChessboardTarget& target, const std::optional<Rigid3>& predicted) = 0;
  virtual absl::StatusOr<PatchesSeen> FindPatches(const PatchTarget& target,
                                                  const StartPose& start) = 0;

  /// The look of what was clicked in an earlier frame. NotFound: no corner there.
  virtual absl::StatusOr<PatchTemplate> CutClicked(const Frame& clicked,
                                                   const Eigen::Vector2d& pixel) = 0;
  /// Finds that in the newest frame [px]: more widely than what is tracked. NotFound.
  virtual absl::StatusOr<Eigen::Vector2d> FindClicked(const PatchTemplate& look,
                                                      const LandmarkQuery& query) = 0;

  /// Of the newest frame; null where there are no pixels.
  virtual const ImagePyramid* pyramid() const = 0;
};

}  // namespace saccade
