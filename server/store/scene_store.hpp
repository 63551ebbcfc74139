#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "shared/scene/scene_object.hpp"

namespace saccade {

/// A scene in DIR/scene.sqlite: WAL, synchronous=FULL. Each call returns when it is on disk. One
/// thread. Errors as SqliteDatabase.
class SceneStore {
 public:
  /// A model as it was uploaded.
  struct StoredModel {
    std::string id, name, bytes;
  };
  struct Stored {
    std::vector<SceneObject> objects;
    std::vector<StoredModel> models;
  };

  /// Opens or creates the file in `directory`, which exists. DataLoss: it is damaged, or none of
  /// ours.
  static absl::StatusOr<std::unique_ptr<SceneStore>> Open(const std::filesystem::path& directory);
  ~SceneStore();

  /// DataLoss: a row is damaged; names it.
  absl::StatusOr<Stored> LoadAll();
  absl::Status PutObject(const SceneObject& object);
  absl::Status RemoveObject(const std::string& id);
  absl::Status PutModel(const StoredModel& model);

 private:
  struct Impl;
  explicit SceneStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
