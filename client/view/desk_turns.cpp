// Rectangles round marks, and marks that are turned.
#include <algorithm>
#include <numbers>
#include <utility>

#include "client/tools/turn.hpp"
#include "client/view/desk.hpp"
#include "client/view/patch.hpp"
#include "shared/marks/shape_lines.hpp"

namespace saccade::view {
namespace {

constexpr double kStepRad = std::numbers::pi / 12;
constexpr Timestamp kSettles_ns = 500'000'000;  // several presses of a key are one turn
constexpr double kHandleShare = 16.0 / 22.0;    // of the radius in which a mark is picked

bool IsWithin(const Eigen::Vector2d& at, const Area& area) {
  const Eigen::Vector2d least = area.from.cwiseMin(area.to), most = area.from.cwiseMax(area.to);
  return (at.array() >= least.array()).all() && (at.array() <= most.array()).all();
}

Eigen::Quaterniond TurnOf(const Annotation& mark) {
  return mark.world_from_mark.value_or(Eigen::Quaterniond::Identity());
}

}  // namespace

std::optional<Annotation> Desk::Turnable() const {
  if (state_.tool != tools::Action::kSelect || state_.selection.ids().size() != 1) {
    return std::nullopt;
  }
  for (const Annotation& mark : Drawn()) {
    const bool turns = mark.id == state_.selection.last() && tools::IsTurnable(mark);
    if (turns && mark.anchor.place_known) return mark;
  }
  return std::nullopt;
}

bool Desk::GripHandle(const Eigen::Vector2d& pixel, const tools::View& view, double pick_px) {
  const std::optional<Annotation> mark = Turnable();
  if (!mark) return false;
  const auto handle = view.Project(tools::HandlePoint(*mark));
  if (!handle || (*handle - pixel).norm() > kHandleShare * pick_px) return false;
  turning_ = *mark;
  return true;
}

void Desk::DragHandle(const Eigen::Vector2d& pixel, const tools::View& view) {
  const auto turn = tools::TurnedTo(view, pixel, turning_->anchor.point_in_world,
                                    tools::HandleLength(*turning_), TurnOf(*turning_));
  if (!turn) return;
  turning_->world_from_mark = *turn;
  session().annotations.PreviewTurn(turning_->id, *turn);
}

void Desk::DropHandle(bool keep, const Where& where) {
  const Annotation mark = *std::exchange(turning_, std::nullopt);
  if (!keep) return session().annotations.EndPreview(mark.id);
  SendTurn(mark.id, TurnOf(mark), "", where);
}

void Desk::SendTurn(const std::string& id, const Eigen::Quaterniond& turn, const std::string& group,
                    const Where& where) {
  edits_.Update(
      PatchOf(id, &AnnotationPatch::world_from_mark, turn),
      [this, id, tell = Tell(where, "Not turned: ")](const auto& done) {
        session().annotations.EndPreview(id);
        tell(done);
      },
      group);
}

bool Desk::Turn(int sign, bool tips, const tools::View* view, Timestamp now_ns) {
  if (view == nullptr) return false;
  bool any = false;
  for (const Annotation& mark : Selected()) {
    if (!tools::IsTurnable(mark)) continue;
    const auto before = turns_.find(mark.id);
    const Eigen::Quaterniond from = before == turns_.end() ? TurnOf(mark) : before->second;
    const Eigen::Quaterniond turn = tools::TurnedBy(*view, from, sign * kStepRad, tips);
    turns_[mark.id] = turn;
    session().annotations.PreviewTurn(mark.id, turn);
    any = true;
  }
  if (any) turned_ns_ = now_ns;
  return any;
}

void Desk::SendTurns(Timestamp now_ns) {
  if (turns_.empty() || now_ns - turned_ns_ < kSettles_ns) return;
  const auto turns = std::exchange(turns_, {});
  const std::string group = turns.size() > 1 ? net::RandomUuid() : "";
  for (const auto& [id, turn] : turns) SendTurn(id, turn, group, NameOf(state_.main));
}

void Desk::SelectArea(const tools::View* view, bool adds, Timestamp now_ns) {
  const Area area = *std::exchange(state_.area, std::nullopt);
  if (view == nullptr) {
    return state_.Refuse(NameOf(area.pane), "Nothing selected: " + WhyNoLanding(area.pane), now_ns);
  }
  if (!adds) state_.selection.Clear();
  for (const Annotation& mark : Drawn()) {
    if (!mark.anchor.place_known || state_.selection.Has(mark.id)) continue;
    const auto anchor = view->Project(mark.anchor.point_in_world);
    const auto label = view->Project(LabelPoint(mark, view->world_from_camera));
    if ((anchor && IsWithin(*anchor, area)) || (label && IsWithin(*label, area))) {
      state_.selection.Toggle(mark.id);
    }
  }
}

void Desk::SelectAll() {
  std::vector<std::string> ids;
  for (const Annotation& mark : Drawn()) ids.push_back(mark.id);
  state_.selection.Set(std::move(ids));
}

}  // namespace saccade::view
