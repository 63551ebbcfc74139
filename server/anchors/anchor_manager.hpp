#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/anchors/anchor_options.hpp"
#include "server/anchors/anchor_record.hpp"
#include "server/anchors/click.hpp"
#include "server/anchors/edit_history.hpp"
#include "server/anchors/frame_ring.hpp"
#include "server/anchors/stored_annotation.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Asks the tracker to start a feature at a clicked pixel of a past frame; its depth takes over
/// from the neighbours' guess. Same thread. An error (no texture there, map full) costs only
/// accuracy.
using SeedFeatureFunction = std::function<absl::StatusOr<FeatureId>(
    const Frame& clicked_frame, const Rigid3& world_from_camera, const Eigen::Vector2d& pixel,
    double depth_prior_m, double depth_sigma_m)>;

/// An edit that holds in memory and has to be made durable: hand `change` to the store, answer with
/// `annotation` after its commit, and call RollBack if it fails.
struct AnnotationEdit {
  Annotation annotation;  // after the edit; state STOPPED if it was deleted
  AnnotationChange change;
  std::vector<AnnotationChange> with;  // made before it, to be kept together with it or not at all
  std::string description;             // of all, in words

  /// Of the first of its changes.
  std::uint64_t first_sequence() const {
    return with.empty() ? change.sequence : with.front().sequence;
  }
};

/// Annotations bound to the map: the one owner, on the tracker thread. Readers take Latest().
///
/// Edits change memory at once and are kept revocable until Committed(sequence).
class AnchorManager {
 public:
  AnchorManager(AnchorOptions options, FrameLookup frames, SeedFeatureFunction seed);

  /// Takes over what the store holds, before the first Resolve. All of it is paused until its place
  /// in the map is known.
  /// `last_pin`: the highest number that a pin ever had; none is given again.
  void Load(std::vector<StoredAnnotation> stored, std::uint32_t last_pin = 0);

  /// Says whether `id` exists now; nothing otherwise.
  std::optional<Annotation> Get(const std::string& id) const;

  /// Places something. The target is resolved with the pose of the frame it names, carried into the
  /// newest map. Errors:
  ///   InvalidArgument     not finite, pixel outside the image, size or text out of range
  ///   NotFound            frame too old or unknown; unknown feature
  ///   FailedPrecondition  not tracking in that frame; map was reset since; no depth known yet
  ///   ResourceExhausted   a quota of the options is reached; says which, and what to do
  ///   PermissionDenied   it is locked, and not by or for this editor; says by whom
  absl::StatusOr<AnnotationEdit> Create(const AnnotationDraft& draft, const Editor& editor);
  /// As Create; NotFound for an unknown id. A measure whose `target` alone is set keeps its other
  /// end.
  absl::StatusOr<AnnotationEdit> Update(const AnnotationPatch& patch, const Editor& editor);
  absl::StatusOr<AnnotationEdit> Delete(const std::string& id, const Editor& editor);
  /// Ticks a line of a check list off, or on again; locked or not. InvalidArgument: there is no
  /// such line.
  absl::StatusOr<AnnotationEdit> Tick(const std::string& id, std::size_t index, bool done,
                                      const Editor& editor);

  /// Takes back, or does again, the last change made by this person, in whichever session, or the
  /// last ones that were made together (Editor::edit_group). FailedPrecondition if there is none,
  /// or if somebody else changed that annotation since (that step is then dropped; of several, the
  /// others are taken back); ResourceExhausted if what it brings back does not fit into the quotas
  /// now; PermissionDenied if somebody locked it.
  absl::StatusOr<AnnotationEdit> Undo(const Editor& editor);
  absl::StatusOr<AnnotationEdit> Redo(const Editor& editor);

  /// See AnnotationBook::SetWorld.
  void SetWorld(std::string world) { options_.map_key = std::move(world); }

  /// From the next Resolve on.
  void SetSurface(std::shared_ptr<const SurfaceSnapshot> surface) { surface_ = std::move(surface); }

  /// Once per frame: recomputes every anchor from the newest map and publishes. Returns the jumps.
  std::vector<AnchorMoved> Resolve(std::shared_ptr<const MapSnapshot> snapshot,
                                   const CameraModel& camera);

  /// Anchors whose estimate became worth storing again (moved by more than a centimetre or became
  /// twice as sure since last stored); at most one in two seconds each. Not part of any undo.
  std::vector<AnnotationChange> TakeRefinements();

  /// The person cannot come back: what they did can no longer be undone.
  void ForgetPerson(const std::string& person_id);

  /// Everything up to `sequence` is on disk.
  void Committed(std::uint64_t sequence);
  /// Takes back every change after `sequence`, newest first: the store could not keep them.
  void RollBack(std::uint64_t sequence);

  /// Memory that undo holds, over all persons [bytes].
  std::size_t undo_bytes() const { return histories_.bytes(); }

  /// All annotations as of the last Resolve or edit, oldest first; never null. Any thread.
  std::shared_ptr<const std::vector<Annotation>> Latest() const;

 private:
  AnnotationEdit Apply(EditKind kind, const Editor& editor, const AnchorRecord* before,
                       const AnchorRecord* after, bool touches_place, const std::string& verb);
  AnnotationEdit Commit(EditKind kind, const Editor& editor, const std::string& id,
                        const AnchorRecord* after, EditHistory history,
                        const std::string& description);
  absl::StatusOr<AnnotationEdit> TakeBack(bool undo, const Editor& editor);
  absl::StatusOr<AnnotationEdit> TakeBackStep(bool undo, const EditStepPtr& step,
                                              const Editor& editor);
  AnchorRecord Restore(const PastState& past, const AnchorRecord* live) const;
  static StoredAnnotation Stored(const AnchorRecord& record);
  absl::Status CheckGrowth(const AnchorRecord* live, const Annotation& wanted,
                           const std::string& person_id) const;
  absl::StatusOr<ResolvedTarget> Hang(const AnnotationTarget& target, AnchorPlace& hung);
  absl::Status HangEnd(const AnnotationTarget& target, AnchorRecord& record);
  absl::Status PlaceDraft(const AnnotationDraft& draft, AnchorRecord& record);
  absl::StatusOr<const AnchorRecord*> FindToChange(const std::string& id, const Editor& editor);
  void Put(const std::string& id, const AnchorRecord* record);
  AnchorRecord* Find(const std::string& id);
  absl::Status CheckReady() const;
  bool Attach(const Anchor& last, AnchorPlace& place) const;
  /// `selections_left`: see Follow. Attaching a place counts as one too.
  void Estimate(AnchorRecord& record, int& selections_left) const;
  std::optional<PlaceEstimate> EstimatePlace(AnchorPlace& place, Anchor& anchor,
                                             int& selections_left) const;
  void TellLength(const PlaceEstimate& at_anchor, const PlaceEstimate& at_end,
                  AnchorRecord& record) const;
  std::optional<AnchorMoved> ResolveOne(bool map_corrected, AnchorRecord& record,
                                        int& selections_left) const;
  void Publish();

  AnchorOptions options_;
  FrameLookup frames_;
  SeedFeatureFunction seed_;
  ScaleChain scale_;
  PoseTrail trail_;
  std::shared_ptr<const SurfaceSnapshot> surface_;  // null: none is known
  std::shared_ptr<const MapView> newest_;           // null before the first Resolve
  std::optional<CameraModel> camera_;
  std::vector<AnchorRecord> records_;  // oldest first
  EditHistories histories_;
  std::deque<PendingEdit> pending_;
  std::uint64_t next_sequence_ = 1;
  std::uint64_t next_content_ = 1;
  std::uint64_t next_step_ = 1;
  std::uint32_t last_pin_ = 0;

  mutable std::mutex latest_mutex_;
  std::shared_ptr<const std::vector<Annotation>> latest_;
};

}  // namespace saccade
