#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <memory>
#include <string>

#include "server/map/stored_map.hpp"
#include "server/pipeline/kept_maps.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade {

/// Largest file of a map that is read or taken [bytes].
inline constexpr std::size_t kMostMapBytes = std::size_t{256} << 20;
/// Of a file's beginning, at least as much as its facts need [bytes].
inline constexpr std::size_t kMostMapFacts = 4096;
inline constexpr std::size_t kLongestMapName = 200;  // [bytes]

struct KeptMap {
  KeptMapFacts facts;
  StoredMap map;
  std::shared_ptr<const SurfaceSnapshot> surface;  // null: none is kept with it
};

/// CRC-32 of zlib; of the whole, if `before` is that of what comes before `bytes`.
std::uint32_t MapChecksum(absl::string_view bytes, std::uint32_t before = 0);

/// UUIDs alone: an id never leads out of a folder.
bool IsMapId(absl::string_view id);

/// The bytes of a file (docs/design/maps.md). What `facts` says of its content is filled in.
/// `surface`: null, or of that map.
std::string EncodeMapFile(KeptMapFacts& facts, const StoredMap& map,
                          const SurfaceSnapshot* surface = nullptr);

/// Facts from the beginning of a file, without its `bytes`. DataLoss: damaged, or of a later
/// version; says so after `name`.
absl::StatusOr<KeptMapFacts> DecodeMapFacts(absl::string_view name, absl::string_view begin);
/// The whole of a file; errors as above.
absl::StatusOr<KeptMap> DecodeMapFile(absl::string_view name, absl::string_view file);

}  // namespace saccade
