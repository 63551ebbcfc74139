#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "server/capture/frame_source.hpp"
#include "server/filter/landmark_filter.hpp"
#include "server/markers/square_search.hpp"
#include "server/markers/square_watch.hpp"
#include "server/scene/light_fit.hpp"
#include "server/tracker/frame_tracker.hpp"
#include "server/tracker/landmark_options.hpp"
#include "server/tracker/square_doubts.hpp"

namespace saccade {

/// `[landmarks] mode = "koller"`: follows a camera by squares whose places are known, and by
/// nothing else (Koller et al., VRST 1997).
///
/// Each frame: predict by M3, search the sides of every square in view, correct in information form
/// with the corners found. Two squares carry it; with fewer it asks the detector, and begins anew
/// where that sees enough. Each corner is a feature of the snapshot, 4 k + 1 to 4 k + 4 of square
/// k; of a corner that something hides (known geometry, or a hand: where there is no black border
/// on white paper) no attempt is counted. One thread; the detector has its own.
class LandmarkTracker final : public FrameTracker {
 public:
  /// InvalidArgument, NotFound: no camera, options, the map of squares.
  static absl::StatusOr<std::unique_ptr<LandmarkTracker>> Create(const SourceInfo& source,
                                                                 const LandmarkOptions& options);

  std::shared_ptr<const MapSnapshot> Track(const Frame& frame) override;
  /// Forgets where the camera is; the squares are where they are.
  void Reset() override;
  /// FailedPrecondition: there are no features but squares.
  absl::StatusOr<FeatureId> SeedFeature(const Frame&, const Rigid3&, const Eigen::Vector2d&, double,
                                        double) override;

  void SetSight(std::shared_ptr<const Sight> sight) override { sight_ = std::move(sight); }
  void SetCarried(std::shared_ptr<const CarriedSquareList> carried) override {
    carried_ = std::move(carried);
  }
  SceneLight light() const override { return light_.light(); }

  /// What the detector took for the picture it answered for last [ms]; 0: it did not answer.
  double detector_ms() const { return detector_ms_; }
  const SquareMap& map() const { return map_; }

 private:
  /// What became of a corner of the map in this frame.
  struct Corner {
    FeatureState state = FeatureState::kNotAttempted;
    std::optional<Eigen::Vector2d> pixel;
    Eigen::Matrix2d noise = Eigen::Matrix2d::Identity();
    std::uint32_t matched = 0;
  };

  LandmarkTracker(const LandmarkOptions& options, SquareMap map,
                  std::unique_ptr<MarkerDetector> detector);
  void Measure(const Frame& frame);
  bool IsCarried(const std::string& family, int id) const;
  void SearchOne(const Frame& frame, std::size_t square);
  /// Where the detector has found the camera, it begins there; true if it did.
  bool TakeDetection(const Frame& frame);
  void Judge();
  std::shared_ptr<const MapSnapshot> Publish(const Frame& frame) const;

  const LandmarkOptions options_;
  const SquareMap map_;
  std::vector<std::array<Eigen::Vector3d, 4>> points_;  // of each square's corners, in world
  std::vector<double> border_shares_;                   // of each
  std::shared_ptr<const CarriedSquareList> carried_ = std::make_shared<const CarriedSquareList>();
  std::shared_ptr<const Sight> sight_;  // null: nothing is known to be in the way
  SquareWatch watch_;
  SquareDoubts doubts_;
  LightFit light_;
  std::vector<PaperSeen> papers_;  // of this frame
  LandmarkFilter filter_;
  std::vector<Corner> corners_;  // four a square
  bool started_ = false;
  Timestamp time_ns_ = 0;  // of the filter
  TrackingStatus status_ = TrackingStatus::kInitialising;
  int squares_seen_ = 0, attempted_ = 0, matched_ = 0;
  int poor_in_row_ = 0;
  double searched_px2_ = 0, detector_ms_ = 0;
  std::uint64_t revision_ = 0;
  StageTimes times_;
};

}  // namespace saccade
