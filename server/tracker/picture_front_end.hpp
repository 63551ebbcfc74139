#pragma once

#include "server/features/corner_detector.hpp"
#include "server/features/search.hpp"
#include "server/tracker/front_end.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// Landmarks are patches of pixels, sought by correlation (slam-spec 5.1, 5.2).
class PictureFrontEnd final : public FrontEnd {
 public:
  /// `camera`: of the source, never null; pictures of another size are of no use.
  PictureFrontEnd(std::shared_ptr<const CameraModel> camera, const TrackerOptions& options);

  absl::Status Check(const SourceInfo& source) const override;
  bool Repeats(const Frame& frame) const override;
  bool Take(const Frame& frame) override;
  LandmarkSighting Find(const LandmarkQuery& query) override;
  std::vector<Eigen::Vector2d> Corners(std::span<const Eigen::Vector2d> occupied,
                                       int most) override;
  std::optional<PatchTemplate> Cut(const Eigen::Vector2d& pixel) override;
  absl::StatusOr<TargetObservation> FindChessboard(const ChessboardTarget& target,
                                                   const std::optional<Rigid3>& predicted) override;
  absl::StatusOr<PatchesSeen> FindPatches(const PatchTarget& target,
                                          const StartPose& start) override;
  absl::StatusOr<PatchTemplate> CutClicked(const Frame& clicked,
                                           const Eigen::Vector2d& pixel) override;
  absl::StatusOr<Eigen::Vector2d> FindClicked(const PatchTemplate& look,
                                              const LandmarkQuery& query) override;
  const ImagePyramid* pyramid() const override { return &pyramid_; }

 private:
  const std::shared_ptr<const CameraModel> camera_;
  const bool draw_as_seen_;  // patches are warped; false: as first seen
  PatchSearcher searcher_;
  CornerDetector detector_;
  WarpOptions warp_;
  Frame frame_;
  ImagePyramid pyramid_;  // of frame_
  // Scratch.
  WarpedPatch warped_;
  std::vector<Corner> corners_;
};

}  // namespace saccade
