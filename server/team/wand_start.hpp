#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "server/team/wand_adjustment.hpp"
#include "server/team/wand_views.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

struct WandStartOptions {
  double sigma_px = 0.5;
  double agrees_px = 12.0;  // a view agrees with a pose before adjustment
};

/// Places cameras and bodies one after another, from nothing but views, in the frame of the camera
/// that sees most, and keeps them adjusted while more views come. A single tag may look two ways:
/// what a view says alone is only taken where others agree. One thread.
class WandTeam {
 public:
  WandTeam(std::vector<CameraModel> lenses, WandBody body, const WandStartOptions& options)
      : lenses_(std::move(lenses)), body_(std::move(body)), options_(options) {}

  /// One instant's sights, after those of all instants before; `order` as FindCornerOrder found it.
  /// Places what can be placed and adjusts all of it.
  void Add(const std::vector<TagSight>& sights, const CornerOrder& order);
  /// Adjusts once more, to the end.
  void Finish();

  const WandPoses& poses() const { return poses_; }
  const std::optional<WandFit>& fit() const { return fit_; }
  int reference() const { return reference_; }  // the camera that is the world; -1: none yet

 private:
  struct Candidates {
    std::vector<Rigid3> camera_from_wand;  // best first
    bool sure = false;                     // the first is the one
  };

  Candidates CandidatesOf(const WandView& view, const std::vector<TagSight>& sights,
                          const CornerOrder& order) const;
  bool Begin();
  bool PlaceWands();
  bool PlaceCameras();
  double Agreement(int camera, const Rigid3& world_from_camera) const;
  void Adjust(int iterations);
  bool Reconsider();

  std::vector<CameraModel> lenses_;
  WandBody body_;
  WandStartOptions options_;
  std::vector<WandView> views_;
  std::vector<Candidates> candidates_;  // of each view
  std::vector<std::size_t> begin_;      // of each instant's views
  int instants_ = 0, adjust_at_ = 0;
  int reference_ = -1;
  WandPoses poses_;
  std::optional<WandFit> fit_;
};

}  // namespace saccade
