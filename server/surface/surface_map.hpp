#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/surface/surface_fusion.hpp"
#include "server/surface/surface_picture.hpp"
#include "shared/scene/keyframe_places.hpp"

namespace saccade {

/// What was done so far, and what it cost.
struct SurfaceCost {
  int keyframes = 0;  // whose pictures were taken
  int depths = 0;     // swept, again too
  int fused = 0;      // into the surface, again too
  double picture_ms = 0, depth_ms = 0, confirm_ms = 0, fuse_ms = 0, mesh_ms = 0;  // of processor
  double known_share = 0;      // sum over depths, of their pixels
  double confirmed_share = 0;  // sum over those fused
};

/// The surfaces that a tracker's keyframes show.
///
/// Frames and the keyframes' places go in, chunks of triangles come out. Where nothing is known
/// there is a hole. A keyframe's depth is sought once it was seen from both sides, counts where
/// others confirm it, and moves along when the keyframe does. Memory is bounded by the options.
/// Not for several threads; nothing here is random, and nothing depends on time.
class SurfaceMap {
 public:
  /// InvalidArgument: options out of range.
  static absl::StatusOr<std::unique_ptr<SurfaceMap>> Create(const SurfaceOptions& options);

  /// Whether this frame's picture would be kept, if it is the newest of the keyframes.
  bool Wants(FrameId frame, const KeyframePlaces& places) const;
  /// Takes the keyframes' places, and the picture of one of them.
  void Add(const Frame& frame, const KeyframePlaces& places);
  /// Takes the keyframes' places: they may have moved, gone, or be of another map.
  void SetPlaces(const KeyframePlaces& places);
  /// What the place looked like in a run before, in this map's coordinates: shown until as much is
  /// seen again.
  void Restore(const SurfaceSnapshot& before);
  /// The next step of what is to be done, at most some hundred milliseconds; false: nothing is.
  bool Work();

  /// Empty before the first.
  const SurfaceFusion::Chunks& chunks() const;
  /// Rises when all chunks before mean nothing any more: another map, another unit.
  std::uint64_t edition() const { return edition_; }
  std::uint64_t version() const { return fusion_ ? fusion_->version() : version_; }
  /// All of it as it is now, to be handed to other threads.
  SurfaceSnapshot Snapshot();
  const SurfaceCost& cost() const { return cost_; }
  /// Of pictures, depths, voxels and chunks.
  std::size_t bytes() const;
  std::size_t blocks() const { return fusion_ ? fusion_->voxels().size() : 0; }
  /// In the map's unit; 0 before the first.
  float voxel() const { return fusion_ ? fusion_->voxels().voxel() : restored_voxel_; }

  /// A keyframe that is kept, for evaluation.
  struct KeptView {
    FrameId frame = 0;
    Rigid3 world_from_camera;
    double distance = 1.0;
    const SurfacePicture* picture = nullptr;
    const DepthMap* depth = nullptr;  // null: not found yet
    float length_factor = 1.0f;       // of its lengths, since then
  };
  std::vector<KeptView> views() const;

 private:
  struct Kept {
    KeyframePlace place;
    // Where the graph has dropped it, it goes along with one that is still there.
    std::optional<std::int64_t> anchor;
    KeyframePlace anchor_place;
    SurfacePicture picture;
    std::optional<DepthMap> depth;
    std::vector<std::pair<std::int64_t, Rigid3>> swept;  // views, from this, as they were then
    bool tried = false;                                  // since the last keyframe came
    int confirmed_by = 0;                                // keyframes asked last
    bool confirm_due = false;
    std::optional<FusedView> fused;
  };

  explicit SurfaceMap(const SurfaceOptions& options)
      : options_(options), rectifier_(options.width_px) {}
  void ForgetAll();
  void ForgetFusion();
  void ForgetRestored();
  void Follow(Kept& kept, const std::map<std::int64_t, KeyframePlace>& now) const;
  double Moved(const Kept& kept) const;
  std::vector<std::int64_t> ViewsOf(std::int64_t id, const Kept& kept) const;
  float LengthFactor(const Kept& kept) const;
  bool SweptElsewhere(const Kept& kept) const;
  bool ConfirmNext();
  bool FollowMoved();
  bool SweepAgain();
  bool SweepNext();
  bool Sweep(std::int64_t id, Kept& kept);
  void Confirm(std::int64_t id, Kept& kept);
  void Fuse(std::int64_t id, Kept& kept, const DepthMap& depth);
  void DropOldest();

  const SurfaceOptions options_;
  Rectifier rectifier_;
  std::uint64_t generation_ = 0, edition_ = 0, version_ = 0;
  bool metric_ = false;
  SurfaceSnapshot::Chunks restored_;  // what is not seen again yet
  float restored_voxel_ = 0.0f;       // 0: nothing was restored
  bool restored_unit_ = false;        // whether it is known if that was in metres
  std::map<std::int64_t, KeyframePlace> places_;
  std::map<std::int64_t, Kept> kept_;
  std::unique_ptr<SurfaceFusion> fusion_;
  SurfaceCost cost_;
  int followed_at_ = 0;  // keyframes that had come when moves were last followed
};

}  // namespace saccade
