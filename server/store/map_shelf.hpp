#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <string>
#include <vector>

#include "server/store/map_file.hpp"

namespace saccade {

/// Maps in DIR/maps, one file each (docs/design/maps.md): facts, then the map, both with a
/// checksum; written beside and renamed, so that a file is whole or the one before. One thread.
class MapShelf {
 public:
  explicit MapShelf(std::filesystem::path directory) : directory_(std::move(directory)) {}

  /// Newest first. Files that cannot be read are left out, and named on stderr once.
  std::vector<KeptMapFacts> List();
  /// Writes `map` under `facts.id`, in place of what was there; what `facts` says of its content is
  /// filled in. Unavailable: the disk, with the reason.
  absl::Status Save(KeptMapFacts facts, const StoredMap& map,
                    const SurfaceSnapshot* surface = nullptr);
  ///   InvalidArgument  no id of a map
  ///   NotFound         there is no such map
  ///   DataLoss         damaged, or of a later version; names the file
  absl::StatusOr<KeptMap> Load(const std::string& id);
  absl::Status Remove(const std::string& id);
  /// Of those without a name the oldest go, until `most` are left.
  void Thin(std::size_t most);

  const std::filesystem::path& directory() const { return directory_; }
  /// Where `id`, which must be one (IsMapId), is or would be.
  std::filesystem::path FileOf(const std::string& id) const;

 private:
  std::filesystem::path directory_;
  std::vector<std::string> told_;  // files that could not be read
};

}  // namespace saccade
