#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/pipeline/kept_maps.hpp"
#include "server/pipeline/runner.hpp"
#include "server/store/map_shelf.hpp"
#include "server/store/map_transfer.hpp"

namespace saccade {

struct MapKeeperOptions {
  std::filesystem::path directory;     // DIR/maps
  std::chrono::seconds every{60};      // while there is news; zero: at exit alone
  std::size_t most_without_name = 10;  // then the oldest go
};

/// Keeps the map of now: every minute while it grows, at exit, and when asked to; brings another
/// one back. Reads and writes on a thread of its own.
class MapKeeper final : public KeptMaps {
 public:
  explicit MapKeeper(MapKeeperOptions options);
  ~MapKeeper() override { Stop(); }

  /// What asks the tracker's thread; before anything else.
  void Connect(CommandPort& port) { port_ = &port; }
  /// Once a second: asks for the map where it is due.
  void Tick();
  /// Writes it before it returns; for the end of the run. Its last news is kept, whatever fails is
  /// said on stderr.
  void KeepLast(const StoredWorld& stored);
  /// Answers everything that was asked before it returns; what is asked after it is refused.
  void Stop();

  /// The newest map, or that of `id`, for the start of the run; nothing: there is none. Errors as
  /// MapShelf::Load.
  absl::StatusOr<std::optional<StoredWorld>> ReadFirst(const std::string& id);

  void List(Done<std::vector<KeptMapFacts>> done) override;
  void Save(std::string name, Done<std::string> done) override;
  void Load(std::string id, DoneEmpty done) override;
  void Remove(std::string id, DoneEmpty done) override;
  void ReadFile(MapFileRequest request, Done<MapFilePiece> done) override;
  void Import(MapImportPiece piece, Done<MapImportProgress> done) override;

 private:
  /// Runs on the thread; `refused` says why it will not.
  void Post(std::function<void()> job, const DoneEmpty& refused);
  /// Waits until the thread has done what was posted so far.
  void Drain();
  void KeepIfNew(const StoredWorld& stored);
  absl::Status Write(const StoredWorld& stored, const std::string& id, const std::string& name);

  const MapKeeperOptions options_;
  CommandPort* port_ = nullptr;
  MapShelf shelf_;  // the thread's, and whoever calls before it has anything to do
  MapTransfer transfer_{shelf_};
  int seconds_ = 0;
  std::atomic<bool> asked_ = false;
  // Of what was written last: without news nothing is.
  std::string kept_world_;
  std::int64_t kept_keyframe_ = -1;
  std::size_t kept_places_ = 0;
  std::uint64_t kept_surface_ = 0;  // version
  Runner<std::function<void()>> work_;
};

}  // namespace saccade
