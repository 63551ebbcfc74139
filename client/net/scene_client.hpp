#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/net/connection.hpp"
#include "client/net/scene_types.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade::net {

struct SceneList {
  std::uint64_t revision = 0;
  std::vector<SceneObject> objects;
  std::vector<ModelFacts> models;
};

/// The scene of one server. Calls block, errors as of Connection.
class SceneClient {
 public:
  explicit SceneClient(const ConnectionOptions& options);
  ~SceneClient();

  /// As TalkClient::Join: before every other call.
  absl::Status Join();
  const std::string& session_id() const;

  absl::StatusOr<SceneList> List();
  absl::StatusOr<SceneObject> Put(const SceneObject& object);
  absl::Status Remove(const std::string& id);
  absl::StatusOr<PlacedThing> Place(const SceneObject& object,
                                    const std::optional<Eigen::Vector3d>& push,
                                    const std::optional<Eigen::Vector3d>& gravity);
  /// In pieces; `progress` is told the bytes that are there.
  absl::StatusOr<ModelFacts> Upload(const std::string& name, const std::string& glb,
                                    const std::function<void(std::size_t)>& progress);
  absl::StatusOr<RegisteredThing> Register(const std::string& id,
                                           const std::vector<PointPair>& pairs, bool with_scale,
                                           bool accept);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade::net
