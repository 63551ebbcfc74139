#include "server/wearable/wearable.hpp"

#include <type_traits>
#include <utility>
#include <variant>

#include "server/anchors/edit_checks.hpp"

namespace saccade {

absl::StatusOr<std::unique_ptr<Wearable>> Wearable::Create(
    const SourceInfo& source, std::unique_ptr<FrameTracker> tracker, AnchorOptions anchors,
    std::unique_ptr<AnnotationJournal> journal, std::function<void()> wake) {
  if (source.target && anchors.world_key.empty()) anchors.world_key = WorldKey(*source.target);
  std::unique_ptr<Wearable> wearable(new Wearable(source, std::move(tracker)));
  wearable->pointers_ = std::make_unique<PointerPlacer>(
      [ring = &wearable->ring_](FrameId id) { return ring->Find(id, FrameRing::Want::kPose); },
      anchors);
  absl::StatusOr<std::unique_ptr<AnnotationBook>> book = AnnotationBook::Open(
      std::move(anchors),
      [ring = &wearable->ring_](FrameId id) { return ring->Find(id, FrameRing::Want::kGrey); },
      [tracker = wearable->tracker_.get()](const Frame& frame, const Rigid3& world_from_camera,
                                           const Eigen::Vector2d& pixel, double depth_m,
                                           double sigma_m) {
        return tracker->SeedFeature(frame, world_from_camera, pixel, depth_m, sigma_m);
      },
      std::move(journal), std::move(wake));
  if (!book.ok()) return book.status();
  wearable->book_ = *std::move(book);
  return wearable;
}

Wearable::Wearable(const SourceInfo& source, std::unique_ptr<FrameTracker> tracker)
    : upright_(source.target.has_value()), tracker_(std::move(tracker)) {}

const WearableStep& Wearable::Step(Frame frame) {
  WearableStep step;
  if (auto lens = tracker_->lens(); lens && frame.camera) frame.camera = std::move(lens);
  step.frame = std::make_shared<const Frame>(std::move(frame));
  CostMeter meter;
  step.snapshot = tracker_->Track(*step.frame);
  step.cost = meter.Read(step.snapshot->stage_ms.waited_ms);
  if (auto lens = tracker_->lens(); lens && step.frame->camera != lens) {  // learnt with this frame
    Frame seen = *step.frame;
    seen.camera = std::move(lens);
    step.frame = std::make_shared<const Frame>(std::move(seen));
  }
  ring_.Push({step.frame, step.snapshot});
  pointers_->OnSnapshot(step.snapshot, surface_);
  book_->SetSurface(surface_);
  if (generation_ != step.snapshot->map_generation) {
    generation_ = step.snapshot->map_generation;
    world_ = resuming_.empty() ? MakeUuid() : std::exchange(resuming_, "");
    if (const auto before = std::exchange(resuming_surface_, nullptr)) {
      auto restored = std::make_shared<SurfaceSnapshot>(*before);
      restored->generation = *generation_;
      step.restored = std::move(restored);
    }
    book_->SetWorld(world_);
  }
  step.moved = book_->OnSnapshot(step.snapshot, *step.frame->camera);
  return newest_.emplace(std::move(step));
}

void Wearable::Settle() {
  book_->Settle();  // also without a frame: stored annotations can be edited before the first
  if (newest_) book_->OnSnapshot(newest_->snapshot, *newest_->frame->camera);
}

GazeView Wearable::View(const std::optional<MountAngles>& angles) const {
  GazeView view{.map = newest_->snapshot,
                .annotations = book_->Latest(),
                .angles = angles,
                .down_in_world = std::nullopt};
  if (upright_ && view.map->metric) view.down_in_world = Eigen::Vector3d::UnitY();
  return view;
}

void Wearable::Execute(Command command) {
  std::visit(
      [this](auto& one) {
        using T = std::decay_t<decltype(one)>;
        if constexpr (std::is_same_v<T, CreateAnnotation>) {
          book_->Create(one.draft, one.editor, one.done);
        } else if constexpr (std::is_same_v<T, UpdateAnnotation>) {
          book_->Update(one.patch, one.editor, one.done);
        } else if constexpr (std::is_same_v<T, DeleteAnnotation>) {
          book_->Delete(one.id, one.editor, [done = one.done](const absl::StatusOr<Annotation>& a) {
            done(a.status());
          });
        } else if constexpr (std::is_same_v<T, TickItem>) {
          book_->Tick(one.id, one.index, one.ticked, one.editor, one.done);
        } else if constexpr (std::is_same_v<T, UndoChange>) {
          one.redo ? book_->Redo(one.editor, one.done) : book_->Undo(one.editor, one.done);
        } else if constexpr (std::is_same_v<T, ForgetPerson>) {
          book_->ForgetPerson(one.person_id);
          one.done(absl::OkStatus());
        } else if constexpr (std::is_same_v<T, StoreMap>) {
          one.done(Store());
        } else if constexpr (std::is_same_v<T, ResumeMap>) {
          one.done(Resume(one.stored));
        } else {
          ResetTracker(one);
        }
      },
      command);
}

void Wearable::ResetTracker(const ResetMap& command) {
  tracker_->Reset();
  // What readers see changes with the next frame; after the end of the source there is none.
  if (newest_) {
    newest_->snapshot = tracker_->Track(*newest_->frame);
    pointers_->OnSnapshot(newest_->snapshot);
  }
  command.done(newest_ ? newest_->snapshot->map_generation : 0);
}

absl::StatusOr<StoredWorld> Wearable::Store() const {
  std::shared_ptr<const StoredMap> map = tracker_->Store();
  if (map && !world_.empty()) {
    const bool same = surface_ && generation_ == surface_->generation && !surface_->chunks.empty();
    return StoredWorld{std::move(map), world_, same ? surface_ : nullptr};
  }
  return absl::FailedPreconditionError(
      "too little is mapped yet to come back to: look round for some seconds first");
}

absl::Status Wearable::Resume(const StoredWorld& stored) {
  if (absl::Status status = tracker_->Resume(stored.map); !status.ok()) return status;
  resuming_ = stored.world;
  resuming_surface_ = stored.surface;
  generation_.reset();
  return absl::OkStatus();
}

std::shared_ptr<const AnnotationList> Wearable::annotations() const {
  const std::lock_guard lock(book_gone_mutex_);
  return book_ ? book_->Latest() : std::make_shared<const AnnotationList>();
}

absl::Status Wearable::Flush(std::chrono::milliseconds limit) {
  const std::unique_lock lock(book_gone_mutex_, limit);
  if (!lock) return absl::UnavailableError("the data base is still being written");
  return book_ ? book_->Flush(limit) : absl::OkStatus();
}

void Wearable::Close() {
  const std::lock_guard lock(book_gone_mutex_);
  book_ = nullptr;
}

}  // namespace saccade
