#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/session/session.hpp"

namespace saccade::session {

/// What a person changes of the scene, one step of undo each. `done` is called from
/// Session::Poll() with the server's answer. The thread that draws.
class ThingEdits {
 public:
  /// What a change was about, and in words what came of it.
  struct Told {
    std::string id;  // empty: it is gone
    std::string words;
  };
  using Done = std::function<void(const absl::StatusOr<Told>&)>;

  explicit ThingEdits(Session& session) : session_(session) {}

  /// Lets it go where `draft` says, after a push along the floor if there is one; it is added where
  /// it has no id.
  void Place(const SceneObject& draft, const std::optional<Eigen::Vector3d>& push, Done done);
  /// Sends the GLB `file`, the same one being the same model, and places it as `draft` says.
  void PlaceModel(const std::string& name, const std::string& file, SceneObject draft, Done done);
  /// Adds a thing (no id), or changes the one of its id; nothing stops it. `said` puts what came of
  /// it in words. `further`: part of the change before it, with which it is taken back.
  using Said = std::function<std::string(const SceneObject&)>;
  void Put(const SceneObject& draft, Said said, Done done, bool further = false);
  /// As PlaceModel, but put where `draft` says.
  void PutModel(const std::string& name, const std::string& file, SceneObject draft, Said said,
                Done done);
  /// Where a thing lies by pairs of points; nothing is moved.
  void TryRegister(const std::string& id, const std::vector<net::PointPair>& pairs, bool with_scale,
                   std::function<void(const absl::StatusOr<net::RegisteredThing>&)> done);
  /// The same, and it is moved there.
  void Register(const std::string& id, const std::vector<net::PointPair>& pairs, bool with_scale,
                Done done);
  void Remove(const std::string& id, Done done);
  /// Takes back the last change made here.
  void Undo(Done done);

 private:
  /// The thing as it was, or that it was not there.
  struct Step {
    std::optional<SceneObject> was;
    std::string added_id;
  };
  void Remember(Step step);
  void Renumber(const std::string& old, const std::string& id);
  void Placed(const absl::StatusOr<net::PlacedThing>& placed, const std::optional<SceneObject>& was,
              const Done& done);
  void Ask(Session::Request request, const Done& done);
  std::optional<SceneObject> Known(const std::string& id) const;
  void TellPut(const absl::StatusOr<SceneObject>& put, const std::optional<SceneObject>& was,
               const Said& said, const Done& done);

  Session& session_;
  std::vector<Step> steps_;
};

/// "chair touches room after 0.512 m, rests on room".
std::string PlacedWords(const net::PlacedThing& placed);

}  // namespace saccade::session
