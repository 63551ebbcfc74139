#pragma once

#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/decode/player.hpp"
#include "client/session/edits.hpp"
#include "client/session/gaze_pilot.hpp"
#include "client/session/latency.hpp"
#include "client/session/pointing.hpp"
#include "client/session/session.hpp"
#include "client/session/thing_edits.hpp"
#include "client/talk/voice_room.hpp"
#include "client/tools/drawn.hpp"
#include "client/tools/orbit.hpp"
#include "client/tools/things.hpp"
#include "client/tools/view.hpp"
#include "client/view/desk_state.hpp"
#include "client/view/layout.hpp"
#include "client/view/thing_work.hpp"

namespace saccade::view {

/// The picture in a pane: where its pixels stand in the window.
struct Placement {
  float left = 0, top = 0, scale = 1;
  Eigen::Vector2d PixelAt(float x, float y) const {
    return {(x - left) / scale - 0.5, (y - top) / scale - 0.5};
  }
};

/// One wearer at this client: session, pictures, and what the person does. What a click or key
/// does is decided here; drawing is elsewhere. The thread that draws.
class Desk {
 public:
  /// `title`: what it is called until the server has told; `wake` may be called on any thread.
  Desk(session::SessionOptions options, std::string title, talk::VoiceOptions voice,
       std::function<void()> wake);
  ~Desk();

  const session::State& session() const { return session_.state(); }
  session::State& session() { return session_.state(); }
  const talk::VoiceRoom& voice() const { return voice_; }
  void TogglePushToTalk() { voice_.TogglePushToTalk(); }
  /// The key of push to talk.
  void PressToTalk(bool pressed) { voice_.Press(pressed); }
  const session::GazePilot& pilot() const { return pilot_; }
  DeskState& state() { return state_; }
  const DeskState& state() const { return state_; }
  tools::Orbit& orbit() { return orbit_; }
  session::LatencyMeter& latency() { return latency_; }
  session::RateMeter& rate() { return rate_; }
  std::string title() const;
  std::string video_problem() const { return player_.problem(); }

  /// What the threads have brought: nothing, something that may wait for the next picture (numbers,
  /// the map), or a picture.
  enum class News { kNone, kState, kPicture };
  News Poll(Timestamp now_ns);
  /// The live picture on the screen; nothing before the first.
  const std::optional<decode::Picture>& live() const { return live_; }
  /// The one that the video pane shows: the still, or the live one.
  const decode::Picture* shown() const;
  /// The wearer lets nobody see a picture: none of the last one stays, but for a still.
  bool picture_paused() const { return session().pause.has_value() && !state_.still; }
  /// The view of that picture; nothing while its place is not known.
  std::optional<tools::View> video_view() const;
  /// The eye above the map, for a pane of this size.
  tools::View map_view(const Rect& pane) const;
  /// False if the map has jumped since the frame shown: its pose says nothing about today's map.
  bool same_map() const;
  /// Eases the eye, follows the wearer, frames the map by itself until someone takes hold. True
  /// while it moves.
  bool StepMap(double elapsed_ms);
  /// The picture was on the screen at that time.
  void Shown(Timestamp shown_ns);

  /// `where`: of the pointer, in the window.
  void Run(tools::Action action, Timestamp now_ns);
  /// What was held while the button went down; `by_key`: it was Enter.
  struct Held {
    bool shift = false, ctrl = false, by_key = false;
  };
  void Press(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view, double pick_px,
             const Held& held);
  void Drag(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view);
  /// How the button came up: whether the pointer was dragged, where it is in the window, and
  /// whether Shift adds to what is selected.
  struct Lift {
    bool moved = false;
    float x = 0, y = 0;
    bool adds = false;
  };
  void Release(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view, const Lift& lift,
               Timestamp now_ns);
  void HoverAt(Pane pane, const std::optional<Eigen::Vector2d>& pixel, const tools::View* view,
               double pick_px);
  /// The map was moved by hand: it frames itself no more.
  void Hold() { held_ = true; }
  /// `adds`: to those that are selected.
  void Select(const std::string& id, bool adds = false);
  /// Selects it, and brings it before the eye of the map.
  void Show(const std::string& id);
  void Remove(const std::string& id, Timestamp now_ns);
  /// Of new marks, and of those selected.
  void Paint(std::uint32_t color_rgba);
  void Tick(const std::string& id, std::uint32_t index, bool done);
  /// Copied marks go where the pointer of that pane is; nothing there: it says why.
  void Paste(Pane pane, const std::optional<Eigen::Vector2d>& pixel, const tools::View* view,
             Timestamp now_ns);
  /// A file was dropped there: placed as a picture.
  void DropFile(const std::string& file, Pane pane, const Eigen::Vector2d& pixel,
                const tools::View* view, Timestamp now_ns);
  /// Places what the dialog has, or says in it what cannot be kept; false: drops it.
  void FinishDialog(bool keep);
  /// Says what is in the field, with the selected mark if it is to go with it.
  void Say();
  void LookAtMark(const std::string& id, const Where& where, Timestamp now_ns);
  void EditText(const std::string& id, float x, float y);
  /// Sends or drops what was written.
  void FinishEditor(bool keep, Timestamp now_ns);
  void ConfirmReset(bool really, Timestamp now_ns);
  /// Which frame's picture was last pressed, and where; for tests.
  const std::optional<PixelTarget>& pressed() const { return pressed_pixel_; }
  /// A drag is of a mark, a rectangle, a box, ink or the laser pointer: it does not turn the map.
  bool dragging_mark() const {
    return moving_ || turning_ || state_.area || drawing_ || !laser_id_.empty();
  }
  /// What was pressed goes on until it is let go.
  bool holding() const { return dragging_mark() || state_.ink.drawing(); }
  /// The one mark that has a handle now.
  std::optional<Annotation> Turnable() const;
  /// Turns the selected arrows and boxes by a step, as seen in `view`; false: there are none.
  bool Turn(int sign, bool tips, const tools::View* view, Timestamp now_ns);
  void SelectAll();
  /// What a pinned picture shows (RGBA); null: not there yet, it is asked for.
  const cv::Mat* PictureOf(const Annotation& mark);
  /// Where the mark that is dragged would be put [m].
  const std::optional<Eigen::Vector3d>& dragged_to() const { return dragged_to_; }
  /// Models that come with the program, by name: GLB files.
  std::map<std::string, std::filesystem::path> library;
  /// What a click does with things; `model`: of the library or the server, where it places one.
  void ChooseThingClick(ThingDesk::Click click, const std::string& model = "");
  void SelectThing(const std::string& id);
  ThingWork& thing_work() { return thing_work_; }
  /// Those that move, of the picture shown.
  std::span<const MarkerPose> markers() const;
  /// The selected thing along the floor as the main pane sees it, until it touches.
  void PushThing(tools::Way way);
  /// By a step about the vertical.
  void TurnThing(int sign);
  void RemoveThing();
  void UndoThing();
  /// Keeps a picture with its marks as a file, and says where; set by whoever knows where.
  std::function<std::string(const net::Still&, const Desk&)> keep_snapshot;

 private:
  std::optional<tools::Landing> LandingAt(Pane pane, const Eigen::Vector2d& pixel,
                                          const tools::View* view) const;
  std::string WhyNoLanding(Pane pane) const;
  /// Why it cannot be frozen or kept; empty: it can.
  std::string WhyNoPicture() const;
  std::vector<Annotation> Drawn() const;
  /// The selected marks; a change of several is one step of undo.
  std::vector<Annotation> Selected() const;
  void Lock(Timestamp now_ns);
  void RemoveSelected(Timestamp now_ns);
  void Copy(Timestamp now_ns);
  /// What is to be placed for a copy; for a picture once its file was fetched.
  void DraftOf(const CopiedMark& copy,
               std::function<void(const absl::StatusOr<AnnotationDraft>&)> done);
  void PutCopies(const tools::Landing& landing);
  void PutOthers(const std::vector<CopiedMark>& others, const Eigen::Vector3d& from,
                 const std::string& group, const Where& where);
  void MoveSelected(const std::string& grabbed, const tools::Landing& landing, const Where& where);
  /// `answered` is called once the server has, whatever it said.
  void PlaceDraft(
      AnnotationDraft draft, const tools::Landing& landing, const Where& where,
      std::function<void()> answered = [] {});
  bool GripHandle(const Eigen::Vector2d& pixel, const tools::View& view, double pick_px);
  void DragHandle(const Eigen::Vector2d& pixel, const tools::View& view);
  void DropHandle(bool keep, const Where& where);
  void SendTurn(const std::string& id, const Eigen::Quaterniond& turn, const std::string& group,
                const Where& where);
  void SendTurns(Timestamp now_ns);
  void SelectArea(const tools::View* view, bool adds, Timestamp now_ns);
  /// Reads a file beside this thread; `done` on it. One at a time.
  void Load(const std::string& file, int page,
            std::function<void(const absl::StatusOr<PicturePtr>&)> done);
  bool CheckLoading();
  void LoadForDialog();
  void UseThings(Pane pane, const std::optional<ThingSpot>& spot);
  /// Where a thing would stand: on a known surface, else where the map says.
  std::optional<Eigen::Vector3d> ThingPlace(const std::optional<tools::Landing>& landing,
                                            const RayTarget& ray) const;
  void PlaceThing(const std::string& model, const Rigid3& start);
  /// A model's GLB file; empty: the library has none of that name.
  std::string LibraryFile(const std::string& model) const;
  /// The selected thing, if it is one that can be moved; else says why `what` was not done.
  const SceneObject* Movable(const char* what);
  static AnnotationDraft PictureDraft(const PicturePtr& picture, const std::string& text);
  void Freeze(Timestamp now_ns);
  void Snapshot(Timestamp now_ns);
  void Escape();
  void RunHead(tools::Action action, Timestamp now_ns);
  void Place(AnnotationShape shape, const tools::Landing& landing, const std::string& text,
             std::vector<Eigen::Vector2d> ink, const Where& where);
  void Look(const tools::Landing& landing, const Where& where, Timestamp now_ns);
  void Fixate(const GazeTarget& target, const Eigen::Vector3d& point, const Where& where,
              Timestamp now_ns);
  std::string WhyNoHead() const;
  /// Of undo and redo: also says what of it was not done.
  session::Edits::Done TellWhatStays(const Where& where);
  /// Shows a refusal where it was asked for.
  session::Edits::Done Tell(const Where& where, const std::string& before = "");

  const std::string title_;
  const std::function<void()> wake_;
  DeskState state_;
  decode::Player player_;
  talk::VoiceRoom voice_;
  session::Session session_;  // after player_ and voice_: it pushes there
  session::Edits edits_{session_};
  session::ThingEdits thing_edits_{session_};
  ThingWork thing_work_{session_, thing_edits_, state_};
  session::GazePilot pilot_{session_};
  session::LatencyMeter latency_;
  session::RateMeter rate_;
  tools::Orbit orbit_;
  std::optional<decode::Picture> live_;
  FrameId counted_ = 0;  // the frame whose latency was taken
  bool held_ = false;
  struct Framed {
    Eigen::Vector3d centre;
    double radius_m;
  };
  std::optional<Framed> Bounds() const;
  std::optional<Framed> framed_;
  // What was under the pointer when it went down: the picture may change before it comes up.
  struct Pressed {
    std::optional<tools::Landing> landing;
    std::string picked_id;
    std::optional<ThingSpot> spot;
  };
  std::optional<Pressed> pressed_;
  std::optional<PixelTarget> pressed_pixel_;
  std::string laser_id_;  // of the point that is shown to others; empty: none
  Timestamp pointed_ns_ = 0;
  AnnotationTarget pointed_at_;
  void PointAt(const AnnotationTarget& target, bool released);
  std::shared_ptr<session::Pointing> sketch_;  // the stroke under way, for the others
  std::vector<std::shared_ptr<session::Pointing>> sketches_;  // until their end was sent
  /// A box or, in the map, a stroke: on the plane that was pressed.
  struct Drawing {
    Pane pane;
    tools::Landing landing;
    tools::Plane plane;
    std::string pending_id;
    Eigen::Vector2d last_px;
    std::optional<tools::DrawnBox> box;   // once it was dragged
    std::vector<Eigen::Vector3d> points;  // of a stroke; empty: it is a box
  };
  std::optional<Drawing> drawing_;
  void BeginDrawing(Pane pane, const Eigen::Vector2d& pixel, const tools::View& view);
  void Draw(Pane pane, const Eigen::Vector2d& pixel, const tools::View& view);
  void FinishDrawing(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view,
                     const Where& where, Timestamp now_ns);
  void DropDrawing();
  /// The selected ones are not drawn any more; with none selected all are again, or none is.
  void HideMarks();
  void BeginSketch();
  void TellSketches(Timestamp now_ns);
  void EndSketch();
  std::optional<std::string> moving_;                // id of the mark that is dragged
  std::optional<Annotation> turning_;                // by its handle
  std::map<std::string, Eigen::Quaterniond> turns_;  // by keys, not sent yet
  Timestamp turned_ns_ = 0;
  std::map<std::string, cv::Mat> pictures_;  // by sha256; empty: asked for, or damaged
  std::function<void(const absl::StatusOr<PicturePtr>&)> loaded_;
  std::future<absl::StatusOr<PicturePtr>> loading_;
  std::optional<Eigen::Vector3d> dragged_to_;
};

}  // namespace saccade::view
