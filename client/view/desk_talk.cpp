// Strokes while they grow, messages, what is placed by a dialog.
#include <absl/strings/str_cat.h>

#include <utility>

#include "client/tools/written.hpp"
#include "client/view/desk.hpp"

namespace saccade::view {

void Desk::BeginSketch() {
  sketch_ = std::make_shared<session::Pointing>(net::RandomUuid(), state_.color_rgba);
  sketch_->Add(pressed_->landing->target);
  sketches_.push_back(sketch_);
}

/// What the others miss of a stroke is no reason to stop: nothing is said of it.
void Desk::TellSketches(Timestamp now_ns) {
  for (const std::shared_ptr<session::Pointing>& each : sketches_) {
    std::optional<net::PointerWord> word = each->Due(now_ns);
    if (!word) continue;
    edits_.Point(*std::move(word),
                 [each](const absl::StatusOr<std::string>& /*told*/) { each->Answered(); });
  }
  std::erase_if(sketches_, [](const auto& each) { return each->over(); });
}

void Desk::EndSketch() {
  if (sketch_) std::exchange(sketch_, nullptr)->End();
}

void Desk::Say() {
  TalkField& talk = state_.talk;
  const std::string text = tools::CleanText(talk.text);
  const std::string mark = talk.carries ? state_.selection.last() : "";
  if (text.empty() && mark.empty()) return;
  if (text.size() > tools::kMaxTextBytes) {
    talk.problem = absl::StrCat(text.size() - tools::kMaxTextBytes,
                                " bytes too long: say it in two messages.");
    return;
  }
  talk.text.clear();
  ++talk.field;
  talk.problem.clear();
  talk.carries = false;
  edits_.Say(text, mark, [this, text](const absl::StatusOr<std::string>& said) {
    if (said.ok()) return;
    if (state_.talk.text.empty()) {
      state_.talk.text = text;  // nothing that was typed is lost
      ++state_.talk.field;
    }
    state_.talk.problem = absl::StrCat("Not said: ", said.status().message());
  });
}

void Desk::Show(const std::string& id) {
  const Annotation* mark = session().annotations.Find(id);
  if (mark == nullptr) return;
  state_.selection.Only(id);
  if (!mark->anchor.place_known) return;
  state_.following = false;
  held_ = true;
  orbit_.LookAt(mark->anchor.point_in_world, 0.4 * orbit_.distance_m());
}

void Desk::PlaceDraft(AnnotationDraft draft, const tools::Landing& landing, const Where& where,
                      std::function<void()> answered) {
  session::Edits::Placement placement{std::move(draft), landing.later, landing.point_in_world, ""};
  placement.draft.target = landing.target;
  placement.draft.color_rgba = state_.color_rgba;
  edits_.Place(std::move(placement),
               [this, answered = std::move(answered),
                tell = Tell(where, "Not placed: ")](const absl::StatusOr<std::string>& id) {
                 if (id.ok()) state_.selection.Only(*id);
                 answered();
                 tell(id);
               });
}

}  // namespace saccade::view
