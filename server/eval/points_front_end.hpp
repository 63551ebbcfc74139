#pragma once

#include <random>

#include "server/eval/points_world.hpp"
#include "server/tracker/front_end.hpp"

namespace saccade {

/// What the tracker sees of a PointsWorld: the look of a landmark is the number of its point, and
/// what is sought is found where its noisy projection lies within the search ellipse. With
/// PointsOptions::false_matches some are found anywhere in it.
class PointsFrontEnd final : public FrontEnd {
 public:
  /// `world`, `options`: kept by the caller.
  PointsFrontEnd(const PointsWorld& world, const PointsOptions& options);

  /// What the frame that is taken next shows; kept by the caller until the one after.
  void Show(const PointsFrame& frame) { next_ = &frame; }
  /// The number of the point that a landmark is.
  static int PointOf(const PatchTemplate& look);

  absl::Status Check(const SourceInfo& source) const override;
  bool Repeats(const Frame&) const override { return false; }
  bool Take(const Frame& frame) override;
  LandmarkSighting Find(const LandmarkQuery& query) override;
  std::vector<Eigen::Vector2d> Corners(std::span<const Eigen::Vector2d> occupied,
                                       int most) override;
  std::optional<PatchTemplate> Cut(const Eigen::Vector2d& pixel) override;
  absl::StatusOr<TargetObservation> FindChessboard(const ChessboardTarget& target,
                                                   const std::optional<Rigid3>& predicted) override;
  /// The pose is fitted to what is seen of the target, with the start pose as prior.
  absl::StatusOr<PatchesSeen> FindPatches(const PatchTarget& target,
                                          const StartPose& start) override;
  absl::StatusOr<PatchTemplate> CutClicked(const Frame& clicked,
                                           const Eigen::Vector2d& pixel) override;
  absl::StatusOr<Eigen::Vector2d> FindClicked(const PatchTemplate& look,
                                              const LandmarkQuery& query) override;
  const ImagePyramid* pyramid() const override { return nullptr; }

 private:
  /// Where the newest frame shows this point; null: not in view.
  const PointObservation* Seen(int point) const;
  /// Anywhere in the ellipse.
  Eigen::Vector2d Stray(const LandmarkQuery& query);

  const PointsWorld& world_;
  const PointsOptions& options_;
  const PointsFrame* next_ = nullptr;
  const PointsFrame* frame_ = nullptr;
  double time_s_ = 0.0;
  std::mt19937_64 random_;
};

}  // namespace saccade
