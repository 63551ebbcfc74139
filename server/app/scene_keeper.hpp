#pragma once

#include <absl/status/statusor.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <vector>

#include "server/pipeline/events.hpp"
#include "server/pipeline/runner.hpp"
#include "server/pipeline/scene_commands.hpp"
#include "server/scene/sight.hpp"
#include "server/store/scene_store.hpp"
#include "server/tracker/carried_squares.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/marker_pose.hpp"

namespace saccade {

/// Owns the scene: one thread carries out what is asked of it, one after the other, commits, tells
/// everybody the new scene and then answers. Thread safe.
class SceneKeeper {
 public:
  static constexpr std::size_t kMostObjects = 1000, kMostModels = 64;
  static constexpr std::size_t kMostModelBytes = std::size_t{128} << 20;

  /// Annotations as of now; never null.
  using Annotations = std::function<std::shared_ptr<const AnnotationList>()>;

  /// `directory` empty: nothing is kept. Errors as SceneStore; a model that can no longer be read
  /// is DataLoss.
  static absl::StatusOr<std::unique_ptr<SceneKeeper>> Open(const std::filesystem::path& directory);
  ~SceneKeeper() { Stop(); }

  /// Before the first Submit; what objects fixed to annotations move with.
  void SetAnnotations(Annotations annotations) { annotations_ = std::move(annotations); }

  /// Before the first Submit; told of every change, on the keeper's thread, before its answer.
  void SetOnChange(std::function<void(const std::shared_ptr<const Scene>&)> told) {
    on_change_ = std::move(told);
  }

  /// Never null.
  std::shared_ptr<const Scene> scene() const;
  /// Of what is real and stands still; null: there is nothing.
  std::shared_ptr<const Sight> sight() const;
  /// Markers that objects are fixed to; never null.
  std::shared_ptr<const CarriedSquareList> carried() const;
  /// Where those are now; null: none was seen. Things are placed among them.
  void SetMarkers(std::shared_ptr<const std::vector<MarkerPose>> markers);
  absl::Status Submit(SceneCommand command);
  /// What was not begun is answered Unavailable.
  void Stop();

 private:
  explicit SceneKeeper(std::unique_ptr<SceneStore> store);
  absl::Status Load();

  void Run(SceneCommand command);
  absl::StatusOr<SceneObject> Put(SceneObject object);
  absl::Status Remove(const std::string& id);
  absl::StatusOr<PlacedObject> PlaceOne(const PlaceSceneObject& command);
  absl::StatusOr<std::shared_ptr<const SceneModel>> AddModel(AddSceneModel command);
  absl::StatusOr<RegisteredObject> RegisterOne(const RegisterSceneObject& command);
  absl::Status CheckObject(const SceneObject& object) const;
  absl::Status CheckMarker(const SceneObject& object) const;
  void Publish(Scene next);

  Annotations annotations_;
  std::function<void(const std::shared_ptr<const Scene>&)> on_change_ = [](const auto&) {};
  const std::unique_ptr<SceneStore> store_;  // null: none; the runner's thread
  mutable std::mutex mutex_;
  std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>();
  std::shared_ptr<const Sight> sight_;
  std::shared_ptr<const CarriedSquareList> carried_ = std::make_shared<const CarriedSquareList>();
  std::shared_ptr<const std::vector<MarkerPose>> markers_;
  std::mutex submit_mutex_;
  std::atomic<bool> stopping_ = false;  // set under submit_mutex_
  std::atomic<std::size_t> waiting_ = 0;
  Runner<SceneCommand> runner_;  // last: its thread uses all of the above
};

}  // namespace saccade
