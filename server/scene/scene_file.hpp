#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <filesystem>
#include <string>
#include <vector>

#include "shared/models/gltf_reader.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade {

/// Objects of one that is described in a file, with the models they name.
struct SceneContents {
  std::vector<SceneObject> objects;
  std::vector<std::shared_ptr<const SceneModel>> models;
};

constexpr std::size_t kMostSceneObjects = 1000;

/// Reads JSON as docs/scene.md has it; models are GLB files named relative to `folder` and below
/// it, whose path there is the model's id. Objects have no ids yet. Messages begin with the place
/// in the file ("objects[3].size_m").
///   InvalidArgument    not JSON, an unknown or missing key, a value out of range, a model outside
///                      the folder, more than kMostSceneObjects
///   others             as ReadGlb and ReadRegularFile
absl::StatusOr<SceneContents> ParseScene(absl::string_view json,
                                         const std::filesystem::path& folder,
                                         const GltfLimits& limits = {});
/// The same of a file of at most 1 MiB.
absl::StatusOr<SceneContents> ReadSceneFile(const std::filesystem::path& file,
                                            const GltfLimits& limits = {});

/// The objects alone, whether their models are there or not.
absl::StatusOr<std::vector<SceneObject>> ParseSceneObjects(absl::string_view json);

/// What ParseScene reads; models are named by their ids.
std::string SceneToJson(const std::vector<SceneObject>& objects);

/// A model out of its file's bytes. Errors as ReadGlb.
absl::StatusOr<std::shared_ptr<const SceneModel>> MakeModel(std::string id, std::string name,
                                                            std::string bytes,
                                                            const GltfLimits& limits = {});

}  // namespace saccade
