#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/pipeline/commands.hpp"

namespace saccade {

/// What is known of a map on the disk without reading it.
struct KeptMapFacts {
  std::string id;     // UUID
  std::string name;   // empty: kept by itself, not because somebody asked
  std::string world;  // whose coordinates it has: UUID of the map that it is, or is a copy of
  std::int64_t saved_unix_s = 0;
  bool metric = false;
  std::uint32_t landmarks = 0, places = 0;  // places: views that it is recognised by
  std::int32_t width = 0, height = 0;       // of the pictures [px]
  std::uint64_t bytes = 0;
};

/// Which piece of a map's file is wanted.
struct MapFileRequest {
  std::string id;
  std::uint64_t offset = 0;    // [bytes]
  std::uint32_t checksum = 0;  // of the first piece's answer; not asked for at 0
};
struct MapFilePiece {
  std::uint64_t total = 0;     // of the file [bytes]
  std::uint32_t checksum = 0;  // CRC-32 of the whole file
  std::string data;
};
/// A piece of a map's file that comes from elsewhere; in order.
struct MapImportPiece {
  std::string upload_id;  // UUID of the sender's
  std::uint64_t total = 0, offset = 0;
  std::uint32_t checksum = 0;  // CRC-32 of the whole file
  std::string data;
};
struct MapImportProgress {
  std::uint64_t received = 0;         // [bytes]
  std::optional<KeptMapFacts> whole;  // once all is there, was read, and is kept
};

/// Maps that outlive the run. Thread safe; nothing blocks. Errors go to `done`:
///   FailedPrecondition  too little is mapped to come back to; a map of another lens
///   NotFound            there is no such map
///   DataLoss            its file is damaged, or of a later version
///   Unavailable         the disk, with the reason; the server is shutting down
class KeptMaps {
 public:
  virtual ~KeptMaps() = default;
  /// Newest first.
  virtual void List(Done<std::vector<KeptMapFacts>> done) = 0;
  /// Answers with the id of a copy of the map as it is now.
  virtual void Save(std::string name, Done<std::string> done) = 0;
  /// The map of now is kept, and thrown away; the other one is looked for in the frames that come.
  virtual void Load(std::string id, DoneEmpty done) = 0;
  virtual void Remove(std::string id, DoneEmpty done) = 0;
  /// A piece of the file of a map that is whole. Also:
  ///   Aborted  the file is not being read, or no longer; begin at 0
  virtual void ReadFile(MapFileRequest request, Done<MapFilePiece> done) = 0;
  /// Takes a piece; after the last the map is kept under its own id. Also:
  ///   AlreadyExists  there is a map of this id; said at the first piece
  ///   Aborted        not the piece that is next; begin at 0
  ///   ResourceExhausted  too many are on their way here
  virtual void Import(MapImportPiece piece, Done<MapImportProgress> done) = 0;
};

}  // namespace saccade
