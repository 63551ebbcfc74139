#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <list>
#include <string>

#include "server/pipeline/kept_maps.hpp"
#include "server/store/map_shelf.hpp"

namespace saccade {

/// Files of a shelf on their way out and in, piece by piece. What comes in lies beside the maps
/// (UPLOAD.part) until it is whole and was read; little is held for those who do not go on. The
/// shelf's thread.
class MapTransfer {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::size_t kMost = 4;  // under way at once, of each direction
  static constexpr std::chrono::seconds kPatience{60};
  static constexpr std::size_t kMostSent = 512 * 1024, kMostTaken = 200 * 1024;  // [bytes]

  explicit MapTransfer(MapShelf& shelf) : shelf_(shelf) {}
  ~MapTransfer();

  /// As KeptMaps::ReadFile.
  absl::StatusOr<MapFilePiece> Read(const MapFileRequest& request, Time now);
  /// As KeptMaps::Import.
  absl::StatusOr<MapImportProgress> Import(const MapImportPiece& piece, Time now);

 private:
  struct Reading {  // of a file that was whole, whatever takes its place meanwhile
    std::string id;
    std::uint64_t total = 0;
    std::uint32_t checksum = 0;
    std::ifstream file;
    Time touched;
  };
  struct Upload {
    std::string id;
    std::uint64_t total = 0, received = 0;
    std::uint32_t checksum = 0, so_far = 0;
    Time touched;
  };

  absl::StatusOr<Reading*> Open(const std::string& id, Time now);
  absl::StatusOr<Upload*> Begin(const MapImportPiece& piece, Time now);
  absl::Status Append(Upload& upload, const std::string& data);
  absl::StatusOr<KeptMapFacts> Finish(const Upload& upload);
  /// Whether such a map may come in at all.
  absl::StatusOr<KeptMapFacts> CheckBegin(const MapImportPiece& piece);
  absl::Status CheckNew(const std::string& id);
  std::filesystem::path PartOf(const std::string& upload_id) const;
  void Forget(std::list<Upload>::iterator upload);
  /// What another run left lying.
  void Sweep();

  MapShelf& shelf_;
  bool swept_ = false;
  std::list<Reading> readings_;
  std::list<Upload> uploads_;
};

}  // namespace saccade
