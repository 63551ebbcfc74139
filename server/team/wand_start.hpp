#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "server/team/wand_adjustment.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A body that carries square tags, and cameras that stand still and see it.
struct WandBody {
  std::map<int, Rigid3> wand_from_tag;
  double side_m = 0.0;
};
struct TagSight {
  int camera = 0, instant = 0, tag = 0;
  std::array<Eigen::Vector2d, 4> corners;  // [px], in the order of their detector
};

/// Which of a tag's corners (-,-) (+,-) (+,+) (-,+) comes at each place of a detector's list.
using CornerOrder = std::array<int, 4>;

/// The one of eight orders in which views of several tags at once fit. FailedPrecondition: no view
/// has two tags, none fits to 3 px, or two fit alike.
absl::StatusOr<CornerOrder> FindCornerOrder(const std::vector<CameraModel>& lenses,
                                            const WandBody& body,
                                            const std::vector<TagSight>& sights);

/// The sights of each camera and instant together.
std::vector<WandView> ViewsOf(const WandBody& body, const std::vector<TagSight>& sights,
                              const CornerOrder& order);

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

  std::vector<CameraModel> lenses_;
  WandBody body_;
  WandStartOptions options_;
  std::vector<WandView> views_;
  std::vector<Candidates> candidates_;  // of each view
  int instants_ = 0;
  int reference_ = -1;
  WandPoses poses_;
  std::optional<WandFit> fit_;
};

}  // namespace saccade
