#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>

#include "client/session/session.hpp"

namespace saccade::session {

/// What a person can change. Each shows its effect at once and takes it back if it was refused;
/// `done` is called from Session::Poll() with the server's answer. The thread that draws.
class Edits {
 public:
  /// OK with the annotation's id, or why not, in words for a person.
  using Done = std::function<void(const absl::StatusOr<std::string>&)>;

  explicit Edits(Session& session) : session_(session) {}

  struct Placement {
    AnnotationDraft draft;
    /// Takes the target's place where the server no longer keeps the frame that it names.
    std::optional<AnnotationTarget> later;
    /// Where it seems to land, shown until the server answers [m].
    std::optional<Eigen::Vector3d> guess_in_world;
    /// Edits with the same one, not empty, are undone together.
    std::string edit_group{};
  };
  void Place(Placement placement, Done done);
  void Update(AnnotationPatch patch, Done done, const std::string& edit_group = "");
  void Remove(const std::string& id, Done done, const std::string& edit_group = "");
  /// Ticks line `index` (from 0) of a check list off, or on again.
  void Tick(const std::string& id, std::uint32_t index, bool tick, Done done);
  void Undo(Done done);
  void Redo(Done done);
  void ResetMap(Done done);
  void Point(net::PointerWord word, Done done);
  /// `annotation_id`: a mark to look at; empty: none.
  void Say(const std::string& text, const std::string& annotation_id, Done done);
  /// The file that a picture was made of.
  void FetchPicture(const std::string& id,
                    std::function<void(const absl::StatusOr<Picture>&)> done);
  /// A still of a frame of the last 10 s.
  void FetchStill(FrameId frame_id, net::VideoView view,
                  std::function<void(const absl::StatusOr<net::Still>&)> done);

 private:
  void AskForWords(absl::StatusOr<std::string> (net::Connection::*call)(), Done done);
  /// Asks, or says at once why not.
  void Ask(Session::Request request, const Done& done);

  Session& session_;
};

}  // namespace saccade::session
