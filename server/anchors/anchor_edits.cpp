// The edits of AnchorManager: create, change, tick, delete.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/edit_checks.hpp"
#include "server/anchors/quota.hpp"

namespace saccade {
namespace {

std::int64_t UnixNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

Annotation Drafted(const AnnotationDraft& draft, const Editor& editor) {
  Annotation annotation;
  annotation.id = MakeUuid();
  annotation.shape = draft.shape;
  annotation.text = draft.text;
  annotation.author = draft.author;
  annotation.author_person_id = editor.person_id;
  annotation.size_m = draft.size_m;
  annotation.color_rgba = draft.color_rgba;
  annotation.created_unix_ns = UnixNow();
  annotation.revision = 1;
  if (draft.shape == AnnotationShape::kArrow || draft.shape == AnnotationShape::kBox) {
    annotation.world_from_mark = draft.world_from_mark;
  }
  if (draft.shape == AnnotationShape::kBox) {
    annotation.extent_m = draft.extent_m.value_or(Eigen::Vector3d::Constant(draft.size_m));
  }
  if (draft.shape == AnnotationShape::kPicture) annotation.picture = draft.picture;
  if (draft.shape == AnnotationShape::kCheckList) {
    auto items = std::make_shared<std::vector<CheckItem>>();
    for (const std::string& text : draft.check_items) items->push_back({text, false, "", 0});
    annotation.check_items = std::move(items);
  }
  return annotation;
}

}  // namespace

AnchorRecord* AnchorManager::Find(const std::string& id) {
  const auto same = [&id](const AnchorRecord& record) { return record.annotation.id == id; };
  const auto found = std::find_if(records_.begin(), records_.end(), same);
  return found == records_.end() ? nullptr : &*found;
}

std::optional<Annotation> AnchorManager::Get(const std::string& id) const {
  for (const AnchorRecord& record : records_) {
    if (record.annotation.id == id) return record.annotation;
  }
  return std::nullopt;
}

absl::Status AnchorManager::CheckReady() const {
  if (newest_) return absl::OkStatus();
  return absl::FailedPreconditionError("no frame has been tracked yet; wait for video");
}

/// Hangs `place` anew, at `target`.
absl::StatusOr<ResolvedTarget> AnchorManager::Hang(const AnnotationTarget& target,
                                                   AnchorPlace& hung) {
  if (absl::Status status = CheckReady(); !status.ok()) return status;
  absl::StatusOr<ResolvedTarget> resolved = ResolveTarget(target, frames_, *newest_, options_);
  if (!resolved.ok()) return resolved.status();
  const MapSnapshot& snapshot = newest_->snapshot();
  AnchorPlace place;
  place.id = next_content_++;
  place.map_generation = snapshot.map_generation;
  place.attached = true;
  const bool by_target = snapshot.metric && !options_.world_key.empty();
  place.world_key = by_target ? options_.world_key : options_.map_key;
  place.method = resolved->method;
  place.point = place.clicked_point = resolved->point_in_world;
  place.clicked_covariance = resolved->covariance_in_world;
  place.distance_m = resolved->distance_m;
  place.seed = resolved->feature;
  place.seed_is_target = resolved->feature_is_target;
  place.doubt = resolved->doubt;
  if (resolved->view) {
    const ResolvedTarget::View& view = *resolved->view;
    place.clicked_from = view.world_from_camera.translation;
    place.doubt_ray = (place.point - place.clicked_from).normalized();
    if (place.doubt.surface == ClickSurface::kUnknown) {
      place.look = {view.past.frame->id, view.pixel, view.depth_m};
    }
  }
  if (!place.seed && resolved->view && seed_) {
    const ResolvedTarget::View& view = *resolved->view;
    // The feature is to find the depth by itself: neighbours only tell it where to begin.
    const double sigma_m = std::clamp(3.0 * view.depth_sigma_m, 0.1 * view.depth_m,
                                      options_.median_depth_sigma * view.depth_m);
    const absl::StatusOr<FeatureId> feature =
        seed_(*view.past.frame, view.world_from_camera, view.pixel, view.depth_m, sigma_m);
    if (feature.ok()) place.seed = *feature;
  }
  hung = std::move(place);
  return resolved;
}

/// A refusal of the other end names its field.
absl::Status AnchorManager::HangEnd(const AnnotationTarget& target, AnchorRecord& record) {
  MeasureEnd end;
  const absl::Status status = Hang(target, end.place).status();
  if (status.ok()) {
    record.end = std::move(end);
    return status;
  }
  const bool named = absl::StartsWith(status.message(), "target");
  return absl::Status(status.code(),
                      absl::StrCat(named ? "end_" : "end_target: ", status.message()));
}

absl::Status AnchorManager::PlaceDraft(const AnnotationDraft& draft, AnchorRecord& record) {
  const absl::StatusOr<ResolvedTarget> resolved = Hang(draft.target, record.place);
  if (!resolved.ok()) return resolved.status();
  if (draft.shape == AnnotationShape::kInk) {
    record.annotation.ink_offset_m =
        draft.ink_px.empty() ? draft.ink_offset_m : InkStroke(ProjectInk(draft.ink_px, *resolved));
  } else if (draft.shape == AnnotationShape::kMeasure) {
    const AnnotationTarget end =
        draft.end_target ? *draft.end_target
                         : PointTarget{resolved->point_in_world + draft.ink_offset_m[0]};
    if (absl::Status status = HangEnd(end, record); !status.ok()) return status;
  }
  int selections_left = 2;
  Estimate(record, selections_left);
  return absl::OkStatus();
}

absl::StatusOr<AnnotationEdit> AnchorManager::Create(const AnnotationDraft& draft,
                                                     const Editor& editor) {
  if (absl::Status status = CheckDraft(draft); !status.ok()) return status;
  AnchorRecord record;
  record.annotation = Drafted(draft, editor);
  Holding added = HoldingOf(record.annotation);
  added.ink_points = std::max(draft.ink_px.size(), draft.ink_offset_m.size());
  added.bytes += added.ink_points * sizeof(Eigen::Vector3d);
  absl::Status fits = CheckQuotas(records_, options_, editor.person_id, added);
  if (!fits.ok()) return fits;
  if (absl::Status status = PlaceDraft(draft, record); !status.ok()) return status;
  // Not before it is placed: what is refused takes no number.
  if (draft.shape == AnnotationShape::kPin) record.annotation.number = ++last_pin_;
  record.content_id = next_content_++;
  AnnotationEdit edit =
      Apply(EditKind::kCreate, editor, nullptr, &record, /*touches_place=*/true, "created");
  edit.change.request_id = draft.request_id;
  return edit;
}

absl::StatusOr<const AnchorRecord*> AnchorManager::FindToChange(const std::string& id,
                                                                const Editor& editor) {
  const AnchorRecord* live = Find(id);
  if (!live) {
    return absl::NotFoundError(
        absl::StrCat("id '", id, "' is no annotation; list them to see which there are"));
  }
  if (absl::Status may = CheckMayChange(live->annotation, editor); !may.ok()) return may;
  return live;
}

absl::StatusOr<AnnotationEdit> AnchorManager::Update(const AnnotationPatch& patch,
                                                     const Editor& editor) {
  if (absl::Status status = CheckPatch(patch); !status.ok()) return status;
  const absl::StatusOr<const AnchorRecord*> live = FindToChange(patch.id, editor);
  if (!live.ok()) return live.status();
  AnchorRecord record = **live;
  Annotation& annotation = record.annotation;
  if (absl::Status suits = CheckPatchSuits(patch, annotation.shape); !suits.ok()) return suits;
  const bool turns_lock = patch.locked && *patch.locked != annotation.locked;
  if (turns_lock) {
    if (absl::Status may = CheckMayLock(annotation, editor); !may.ok()) return may;
    annotation.locked = *patch.locked;
    annotation.locked_by = annotation.locked ? editor.name : "";
  }
  if (patch.text) annotation.text = *patch.text;
  if (patch.size_m) annotation.size_m = *patch.size_m;
  if (patch.color_rgba) annotation.color_rgba = *patch.color_rgba;
  if (patch.world_from_mark) annotation.world_from_mark = patch.world_from_mark;
  if (patch.extent_m) annotation.extent_m = *patch.extent_m;
  absl::Status fits = CheckGrowth(*live, annotation, editor.person_id);
  if (!fits.ok()) return fits;
  if (patch.target) {
    const absl::Status hung = Hang(*patch.target, record.place).status();
    if (!hung.ok()) return hung;
  }
  if (patch.end_target) {
    if (absl::Status hung = HangEnd(*patch.end_target, record); !hung.ok()) return hung;
  }
  const bool moved = patch.target || patch.end_target;
  if (moved) {
    if (record.end) record.end->told_ns = 0;
    int selections_left = 2;
    Estimate(record, selections_left);
  }
  annotation.revision += 1;
  record.content_id = next_content_++;
  const char* const verb = moved        ? "moved"
                           : turns_lock ? (*patch.locked ? "locked" : "unlocked")
                                        : "changed";
  return Apply(EditKind::kUpdate, editor, *live, &record, /*touches_place=*/moved, verb);
}

absl::StatusOr<AnnotationEdit> AnchorManager::Tick(const std::string& id, std::size_t index,
                                                   bool done, const Editor& editor) {
  const AnchorRecord* live = Find(id);
  if (!live) {
    return absl::NotFoundError(
        absl::StrCat("id '", id, "' is no annotation; list them to see which there are"));
  }
  if (!live->annotation.check_items) {
    return absl::InvalidArgumentError(
        absl::StrCat("id: ", ShortName(live->annotation), " is no check list"));
  }
  std::vector<CheckItem> items = *live->annotation.check_items;
  if (index >= items.size()) {
    return absl::InvalidArgumentError(absl::StrCat("index: ", index, " is beyond the ",
                                                   items.size(), " lines, which count from 0"));
  }
  CheckItem& item = items[index];
  item.done = done;
  item.done_by = done ? editor.name : "";
  item.done_unix_ns = done ? UnixNow() : 0;
  AnchorRecord record = *live;
  record.annotation.check_items = std::make_shared<const std::vector<CheckItem>>(std::move(items));
  record.annotation.revision += 1;
  record.content_id = next_content_++;
  return Apply(EditKind::kUpdate, editor, live, &record, /*touches_place=*/false,
               absl::StrCat(done ? "ticked" : "unticked", " line ", index + 1, " of"));
}

absl::StatusOr<AnnotationEdit> AnchorManager::Delete(const std::string& id, const Editor& editor) {
  const absl::StatusOr<const AnchorRecord*> live = FindToChange(id, editor);
  if (!live.ok()) return live.status();
  return Apply(EditKind::kDelete, editor, *live, nullptr, /*touches_place=*/true, "deleted");
}

}  // namespace saccade
