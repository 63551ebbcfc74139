#pragma once

#include <cstdint>
#include <memory>
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
};

}  // namespace saccade
