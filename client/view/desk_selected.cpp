// What happens to the selected marks together: each thing is one step of undo.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "client/tools/marks.hpp"
#include "client/view/desk.hpp"
#include "client/view/patch.hpp"

namespace saccade::view {
namespace {

std::string GroupOf(std::size_t count) { return count > 1 ? net::RandomUuid() : ""; }
Where RowOf(const std::string& id) { return absl::StrCat("annotation ", id); }

}  // namespace

std::vector<Annotation> Desk::Selected() const {
  std::vector<Annotation> marks;
  for (const std::string& id : state_.selection.ids()) {
    if (const Annotation* mark = session().annotations.Find(id)) marks.push_back(*mark);
  }
  return marks;
}

void Desk::Select(const std::string& id, bool adds) {
  const bool only = state_.selection.ids().size() == 1 && state_.selection.Has(id);
  if (adds || only) return state_.selection.Toggle(id);
  state_.selection.Only(id);
}

void Desk::Lock(Timestamp now_ns) {
  const std::vector<Annotation> marks = Selected();
  if (marks.empty()) return state_.Refuse("Lock", "Select a mark first.", now_ns);
  const bool all =
      std::all_of(marks.begin(), marks.end(), [](const Annotation& mark) { return mark.locked; });
  const std::string group = GroupOf(marks.size());
  for (const Annotation& mark : marks) {
    edits_.Update(PatchOf(mark.id, &AnnotationPatch::locked, !all), Tell(RowOf(mark.id)), group);
  }
}

void Desk::RemoveSelected(Timestamp now_ns) {
  const std::vector<Annotation> marks = Selected();
  if (marks.empty()) return state_.Refuse("Delete", "Select a mark first.", now_ns);
  const std::string group = GroupOf(marks.size());
  state_.selection.Clear();
  for (const Annotation& mark : marks) edits_.Remove(mark.id, Tell(RowOf(mark.id)), group);
}

void Desk::Remove(const std::string& id, Timestamp /*now_ns*/) {
  state_.selection.Drop(id);
  edits_.Remove(id, Tell(RowOf(id)));
}

void Desk::Paint(std::uint32_t color_rgba) {
  state_.color_rgba = color_rgba;
  const std::vector<Annotation> marks = Selected();
  const std::string group = GroupOf(marks.size());
  for (const Annotation& mark : marks) {
    edits_.Update(PatchOf(mark.id, &AnnotationPatch::color_rgba, color_rgba), Tell(RowOf(mark.id)),
                  group);
  }
}

void Desk::Tick(const std::string& id, std::uint32_t index, bool done) {
  edits_.Tick(id, index, done, Tell(RowOf(id), "Not ticked: "));
}

/// The others keep where they stand to the one that was grabbed.
void Desk::MoveSelected(const std::string& grabbed, const tools::Landing& landing,
                        const Where& where) {
  const std::vector<Annotation> marks = Selected();
  const Annotation* mark = session().annotations.Find(grabbed);
  if (mark == nullptr) return;
  const std::string group = GroupOf(marks.size());
  const Eigen::Vector3d delta = landing.point_in_world - mark->anchor.point_in_world;
  const session::Edits::Done tell = Tell(where, "Not moved: ");
  edits_.Update(PatchOf(grabbed, &AnnotationPatch::target, landing.target), tell, group);
  for (const Annotation& other : marks) {
    if (other.id == grabbed || !other.anchor.place_known) continue;
    const AnnotationTarget to = PointTarget{other.anchor.point_in_world + delta};
    edits_.Update(PatchOf(other.id, &AnnotationPatch::target, to), tell, group);
  }
}

void Desk::Copy(Timestamp now_ns) {
  std::vector<Annotation> marks = Selected();
  std::erase_if(marks, [](const Annotation& mark) { return !mark.anchor.place_known; });
  if (marks.empty()) return state_.Refuse("Copy", "Select a mark first.", now_ns);
  state_.copied.clear();
  const Eigen::Vector3d from = marks.front().anchor.point_in_world;
  for (const Annotation& mark : marks) {
    state_.copied.push_back({mark, mark.anchor.point_in_world - from});
  }
  const std::string count =
      marks.size() == 1 ? "The mark is" : absl::StrCat(marks.size(), " marks are");
  state_.Refuse("Copy", absl::StrCat(count, " copied: ^V puts it where the pointer is."), now_ns);
}

void Desk::Paste(Pane pane, const std::optional<Eigen::Vector2d>& pixel, const tools::View* view,
                 Timestamp now_ns) {
  if (state_.copied.empty()) return state_.Refuse("Paste", "Copy a mark first (^C).", now_ns);
  if (!session().link.live()) {
    return state_.Refuse("Paste", "Not placed: no connection to the server.", now_ns);
  }
  const std::optional<tools::Landing> landing =
      pixel ? LandingAt(pane, *pixel, view) : std::nullopt;
  if (!landing) {
    return state_.Refuse("Paste", absl::StrCat("Not placed: ", WhyNoLanding(pane)), now_ns);
  }
  PutCopies(*landing);
}

void Desk::DraftOf(const CopiedMark& copy,
                   std::function<void(const absl::StatusOr<AnnotationDraft>&)> done) {
  const Annotation& mark = copy.mark;
  AnnotationDraft draft;
  draft.shape = mark.shape;
  draft.text = mark.text;
  draft.size_m = mark.size_m;
  draft.color_rgba = mark.color_rgba;
  draft.ink_offset_m = mark.ink_offset_m;
  draft.world_from_mark = mark.world_from_mark;
  if (mark.shape == AnnotationShape::kBox) draft.extent_m = mark.extent_m;
  if (mark.check_items) {
    for (const CheckItem& item : *mark.check_items) draft.check_items.push_back(item.text);
  }
  if (mark.shape != AnnotationShape::kPicture) return done(draft);
  edits_.FetchPicture(mark.id, [draft, done](const absl::StatusOr<Picture>& picture) mutable {
    if (!picture.ok()) return done(picture.status());
    draft.picture = std::make_shared<const Picture>(*picture);
    done(draft);
  });
}

void Desk::PutCopies(const tools::Landing& landing) {
  const std::vector<CopiedMark> others(state_.copied.begin() + 1, state_.copied.end());
  const std::string group = GroupOf(state_.copied.size());
  const session::Edits::Done tell = Tell("Paste", "Not pasted: ");
  DraftOf(state_.copied.front(), [=, this](const absl::StatusOr<AnnotationDraft>& draft) {
    if (!draft.ok()) return tell(draft.status());
    session::Edits::Placement placement{*draft, landing.later, landing.point_in_world, group};
    placement.draft.target = landing.target;
    edits_.Place(std::move(placement), [=, this](const absl::StatusOr<std::string>& id) {
      if (!id.ok()) return tell(id);
      state_.selection.Only(*id);
      const Annotation* placed = session().annotations.Find(*id);
      PutOthers(others, placed == nullptr ? landing.point_in_world : placed->anchor.point_in_world,
                group, "Paste");
    });
  });
}

void Desk::PutOthers(const std::vector<CopiedMark>& others, const Eigen::Vector3d& from,
                     const std::string& group, const Where& where) {
  const session::Edits::Done tell = Tell(where, "Not pasted: ");
  for (const CopiedMark& each : others) {
    const Eigen::Vector3d to = from + each.offset_in_world;
    DraftOf(each, [=, this](const absl::StatusOr<AnnotationDraft>& draft) {
      if (!draft.ok()) return tell(draft.status());
      session::Edits::Placement placement{*draft, std::nullopt, to, group};
      placement.draft.target = PointTarget{to};
      edits_.Place(std::move(placement), [this, tell](const absl::StatusOr<std::string>& id) {
        if (!id.ok()) return tell(id);
        if (!state_.selection.Has(*id)) state_.selection.Toggle(*id);
      });
    });
  }
}

}  // namespace saccade::view
