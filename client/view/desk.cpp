#include "client/view/desk.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "client/tools/words.hpp"

namespace saccade::view {
namespace {

constexpr double kFieldOfViewRad = std::numbers::pi / 4;
constexpr Timestamp kSayAgainNs = 400'000'000;

session::SessionOptions HeardBy(talk::VoiceRoom& voice, session::SessionOptions options) {
  options.on_voice = [&voice](const net::VoiceNews& news) { voice.Hear(news); };
  return options;
}

}  // namespace

Desk::Desk(session::SessionOptions options, std::string title, talk::VoiceOptions voice,
           std::function<void()> wake)
    : title_(std::move(title)),
      wake_(wake),
      player_(wake),
      voice_(std::move(voice), wake),
      session_(HeardBy(voice_, std::move(options)), player_, std::move(wake)) {}

Desk::~Desk() { voice_.End(session_); }

std::string Desk::title() const {
  const std::string& source = session().joined.source;
  return source.empty() ? title_ : source;
}

Desk::News Desk::Poll(Timestamp now_ns) {
  bool changed = session_.Poll(), has_picture = false;
  if (std::optional<decode::Picture> picture = player_.Take()) {
    live_ = std::move(picture);
    has_picture = true;
  }
  changed = pilot_.Check() || changed;
  changed = voice_.Check(session_, now_ns) || changed;
  // Held still it is said again: after a second without a word it would be gone.
  if (!laser_id_.empty() && now_ns - pointed_ns_ > kSayAgainNs) PointAt(pointed_at_, false);
  TellSketches(now_ns);
  SendTurns(now_ns);
  thing_work_.Check(now_ns, markers());
  changed = CheckLoading() || changed;
  changed = state_.Expire(now_ns) || changed;
  changed = session().Expire(now_ns) || changed;
  // A still of a map that is gone shows marks where they are not.
  if (state_.still && state_.still->picture.facts->pose && session().pose &&
      session().pose->map_generation != state_.still->picture.facts->pose->map_generation) {
    state_.still.reset();
  }
  if (has_picture) return News::kPicture;
  return changed ? News::kState : News::kNone;
}

const decode::Picture* Desk::shown() const {
  if (state_.still) return &state_.still->picture;
  return live_ ? &*live_ : nullptr;
}

std::optional<tools::View> Desk::video_view() const {
  const decode::Picture* picture = shown();
  if (picture == nullptr || picture_paused() || !session::IsPlaced(picture->facts->pose))
    return std::nullopt;
  return tools::View(picture->facts->camera, picture->facts->pose->world_from_camera);
}

tools::View Desk::map_view(const Rect& pane) const {
  return {
      tools::PinholeOf(std::max(1, static_cast<int>(std::lround(pane.width))),
                       std::max(1, static_cast<int>(std::lround(pane.height))), kFieldOfViewRad),
      orbit_.world_from_camera()};
}

bool Desk::same_map() const {
  const decode::Picture* picture = shown();
  return picture != nullptr && picture->facts->pose && session().pose &&
         picture->facts->pose->map_revision == session().pose->map_revision;
}

/// A sphere round most features and the camera; stray ones do not count.
std::optional<Desk::Framed> Desk::Bounds() const {
  std::vector<Eigen::Vector3d> sure, all;
  for (const auto& [id, feature] : session().features) {
    all.push_back(feature.point_in_world);
    if (feature.depth_known) sure.push_back(feature.point_in_world);
  }
  const std::vector<Eigen::Vector3d>& points = sure.size() >= 4 ? sure : all;
  if (points.size() < 4) return std::nullopt;
  Eigen::Vector3d centre;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& point : points) values.push_back(point[axis]);
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    centre[axis] = values[values.size() / 2];
  }
  std::vector<double> away;
  for (const Eigen::Vector3d& point : points) away.push_back((point - centre).norm());
  std::sort(away.begin(), away.end());
  const double most = away[static_cast<std::size_t>(0.85 * static_cast<double>(away.size()))];
  double radius = std::max(most, 0.1);
  if (session().pose) {
    const double eye = (session().pose->world_from_camera.translation - centre).norm();
    radius = std::max(radius, std::min(eye, 3 * most));
  }
  return Framed{centre, radius};
}

bool Desk::StepMap(double elapsed_ms) {
  if (state_.following && live_ && session::IsPlaced(live_->facts->pose)) {
    orbit_.Follow(live_->facts->pose->world_from_camera.translation);
  } else if (!held_) {
    if (const std::optional<Framed> bounds = Bounds()) {
      const double moved =
          framed_ ? (bounds->centre - framed_->centre).norm() / framed_->radius_m : 1;
      const double grown = framed_ ? std::abs(std::log(bounds->radius_m / framed_->radius_m)) : 1;
      if (moved > 0.3 || grown > 0.3) {
        framed_ = bounds;
        orbit_.LookAt(bounds->centre, bounds->radius_m);
      }
    }
  }
  return orbit_.Step(elapsed_ms);
}

void Desk::Shown(Timestamp shown_ns) {
  if (!live_ || live_->facts->frame_id == counted_) return;
  counted_ = live_->facts->frame_id;
  rate_.Add(shown_ns);
  if (const auto times = session::TimesOf(*live_->facts, live_->decoded_ns, shown_ns,
                                          session().clock.offset_ns())) {
    latency_.Add(*times);
  }
}

void Desk::Escape() {
  if (state_.editor) {
    state_.editor.reset();
  } else if (state_.dialog) {
    state_.dialog.reset();
  } else if (state_.measure_from) {
    state_.measure_from.reset();
  } else if (state_.ink.drawing()) {
    state_.ink.Cancel();
    EndSketch();
  } else if (drawing_) {
    DropDrawing();
  } else if (turning_) {
    DropHandle(false, "");
  } else if (state_.area) {
    state_.area.reset();
  } else if (!laser_id_.empty()) {
    PointAt(pointed_at_, true);
  } else if (moving_) {
    moving_.reset();
    dragged_to_.reset();
  } else if (state_.confirming_reset) {
    state_.confirming_reset = false;
  } else if (thing_work_.Cancel()) {
  } else if (state_.tool != tools::Action::kSelect) {
    state_.tool = tools::Action::kSelect;
  } else if (state_.still) {
    state_.still.reset();
  } else {
    state_.selection.Clear();
  }
}

void Desk::Run(tools::Action action, Timestamp now_ns) {
  using enum tools::Action;
  state_.hover.reset();
  const tools::Control& control = tools::ControlOf(action);
  if (control.group == tools::Group::kTool) {
    const std::string why = action == kGaze ? WhyNoHead() : "";
    if (!why.empty()) return state_.Refuse(control.label, why, now_ns);
    if (action != kThings) thing_work_.Cancel();
    state_.tool = action;
    state_.measure_from.reset();
    return;
  }
  if (control.group == tools::Group::kHead) return RunHead(action, now_ns);
  switch (action) {
    case kUndo:
      return edits_.Undo(TellWhatStays(control.label));
    case kRedo:
      return edits_.Redo(TellWhatStays(control.label));
    case kDelete:
      return RemoveSelected(now_ns);
    case kCopy:
      return Copy(now_ns);
    case kLock:
      return Lock(now_ns);
    case kFreeze:
      return Freeze(now_ns);
    case kSwap:
      state_.main = state_.main == Pane::kMap ? Pane::kVideo : Pane::kMap;
      return;
    case kFollow:
      state_.following = !state_.following;
      return;
    case kShow:
      state_.shows = NextOf(state_.shows);
      return;
    case kTop:
      held_ = true;
      state_.from_above = !state_.from_above;
      if (state_.from_above) return orbit_.FromTop();
      [[fallthrough]];
    case kWholeMap:
      state_.from_above = false;
      state_.following = false;
      if (const auto bounds = Bounds()) orbit_.LookAt(bounds->centre, bounds->radius_m);
      return;
    case kReset:
      state_.confirming_reset = !state_.confirming_reset;
      return;
    case kOnlyMine:
      state_.filter.mine = !state_.filter.mine;
      return;
    case kHideMarks:
      return HideMarks();
    case kSnapshot:
      return Snapshot(now_ns);
    case kSelectAll:
      return SelectAll();
    case kFind:
      state_.find = true;
      return;
    case kMessage:
      state_.talk.open = state_.talk.wanted = true;
      return;
    case kVoice:
      return voice_.state() == talk::VoiceRoom::State::kOff ? voice_.Join(session_)
                                                            : voice_.Leave(session_);
    case kMute:
      if (voice_.has_microphone()) voice_.ToggleMute();
      return;
    case kEscape:
      return Escape();
    default:
      return;
  }
}

void Desk::ConfirmReset(bool really, Timestamp /*now_ns*/) {
  state_.confirming_reset = false;
  if (really) edits_.ResetMap(Tell("Reset map"));
}

session::Edits::Done Desk::TellWhatStays(const Where& where) {
  return [this, where](const absl::StatusOr<std::string>& done) {
    const std::string words = done.ok() ? *done : std::string(done.status().message());
    if (done.ok() && !absl::StrContains(words, "stays: ")) return;
    state_.Refuse(where, words, MonotonicNow());
  };
}

session::Edits::Done Desk::Tell(const Where& where, const std::string& before) {
  return [this, where, before](const absl::StatusOr<std::string>& done) {
    if (done.ok()) return;
    state_.Refuse(where, absl::StrCat(before, done.status().message()), MonotonicNow());
  };
}

}  // namespace saccade::view
