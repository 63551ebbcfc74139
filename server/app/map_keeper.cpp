#include "server/app/map_keeper.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <ctime>
#include <future>
#include <thread>
#include <utility>

#include "server/anchors/edit_checks.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::size_t kJobsWaiting = 16;
constexpr int kFirstAfter_s = 10;  // of the run

}  // namespace

MapKeeper::MapKeeper(MapKeeperOptions options)
    : options_(std::move(options)),
      shelf_(options_.directory),
      work_({.capacity = kJobsWaiting, .when_full = WhenFull::kRefuse},
            [](const std::function<void()>& job) { job(); }) {}

void MapKeeper::Post(std::function<void()> job, const DoneEmpty& refused) {
  if (absl::Status posted = work_.Post(std::move(job)); !posted.ok()) refused(posted);
}

void MapKeeper::Tick() {
  if (port_ == nullptr || options_.every.count() == 0 || asked_) return;
  if (++seconds_ < kFirstAfter_s || (seconds_ - kFirstAfter_s) % options_.every.count() != 0) {
    return;
  }
  asked_ = true;
  const auto answer = [this](absl::StatusOr<StoredWorld> stored) {
    const auto over = [this](const absl::Status&) { asked_ = false; };
    if (!stored.ok()) return over(stored.status());
    Post(
        [this, stored = *std::move(stored)] {
          KeepIfNew(stored);
          asked_ = false;
        },
        over);
  };
  if (!port_->Submit(StoreMap{answer}).ok()) asked_ = false;
}

void MapKeeper::KeepIfNew(const StoredWorld& stored) {
  const auto& keyframes = stored.map->keyframes.keyframes;
  const std::int64_t newest = keyframes.empty() ? -1 : keyframes.rbegin()->first;
  const std::uint64_t surface = stored.surface ? stored.surface->version : 0;
  if (stored.world == kept_world_ && newest == kept_keyframe_ &&
      stored.map->places.size() == kept_places_ && surface == kept_surface_) {
    return;
  }
  if (absl::Status written = Write(stored, stored.world, ""); !written.ok()) {
    Log(absl::StrCat("maps: the map is not kept: ", written.message()));
    return;
  }
  kept_world_ = stored.world;
  kept_keyframe_ = newest;
  kept_places_ = stored.map->places.size();
  kept_surface_ = surface;
  shelf_.Thin(options_.most_without_name);
}

absl::Status MapKeeper::Write(const StoredWorld& stored, const std::string& id,
                              const std::string& name) {
  KeptMapFacts facts;
  facts.id = id;
  facts.name = name;
  facts.world = stored.world;
  facts.saved_unix_s = std::time(nullptr);
  return shelf_.Save(std::move(facts), *stored.map, stored.surface.get());
}

void MapKeeper::Drain() {
  std::promise<void> done;
  std::future<void> drained = done.get_future();
  absl::Status posted;
  // A full queue is busy, not closed: room comes.
  do {
    posted = work_.Post([&done] { done.set_value(); });
    if (absl::IsResourceExhausted(posted))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  } while (absl::IsResourceExhausted(posted));
  if (posted.ok()) drained.wait();
}

void MapKeeper::Stop() {
  Drain();  // a runner that stops drops what waits, and each job owes an answer
  work_.Stop();
}

void MapKeeper::KeepLast(const StoredWorld& stored) {
  Stop();
  KeepIfNew(stored);
}

absl::StatusOr<std::optional<StoredWorld>> MapKeeper::ReadFirst(const std::string& id) {
  std::string wanted = id;
  if (wanted.empty()) {
    const std::vector<KeptMapFacts> all = shelf_.List();
    if (all.empty()) return std::nullopt;
    wanted = all.front().id;
  }
  absl::StatusOr<KeptMap> kept = shelf_.Load(wanted);
  if (!kept.ok()) return kept.status();
  return StoredWorld{std::make_shared<const StoredMap>(std::move(kept->map)), kept->facts.world,
                     std::move(kept->surface)};
}

void MapKeeper::List(Done<std::vector<KeptMapFacts>> done) {
  Post([this, done] { done(shelf_.List()); }, [done](const absl::Status& why) { done(why); });
}

void MapKeeper::Save(std::string name, Done<std::string> done) {
  if (name.empty() || name.size() > kLongestMapName) {
    return done(absl::InvalidArgumentError(
        absl::StrCat("name: give one of 1 to ", kLongestMapName, " bytes")));
  }
  const auto answer = [this, name = std::move(name), done](absl::StatusOr<StoredWorld> stored) {
    if (!stored.ok()) return done(stored.status());
    Post(
        [this, name, done, stored = *std::move(stored)] {
          const std::string id = MakeUuid();
          const absl::Status written = Write(stored, id, name);
          written.ok() ? done(id) : done(written);
        },
        [done](const absl::Status& why) { done(why); });
  };
  if (absl::Status asked = port_->Submit(StoreMap{answer}); !asked.ok()) done(asked);
}

void MapKeeper::Load(std::string id, DoneEmpty done) {
  const auto resume = [this, id = std::move(id), done] {
    absl::StatusOr<KeptMap> kept = shelf_.Load(id);
    if (!kept.ok()) return done(kept.status());
    StoredWorld stored{std::make_shared<const StoredMap>(std::move(kept->map)), kept->facts.world,
                       std::move(kept->surface)};
    if (absl::Status asked = port_->Submit(ResumeMap{std::move(stored), done}); !asked.ok()) {
      done(asked);
    }
  };
  // The map of now first: whoever loads the wrong one can go back.
  const auto keep = [this, resume, done](absl::StatusOr<StoredWorld> now) {
    Post(
        [this, resume, now = std::move(now)] {
          if (now.ok()) KeepIfNew(*now);
          resume();
        },
        done);
  };
  if (absl::Status asked = port_->Submit(StoreMap{keep}); !asked.ok()) done(asked);
}

void MapKeeper::Remove(std::string id, DoneEmpty done) {
  Post([this, id = std::move(id), done] { done(shelf_.Remove(id)); }, done);
}

void MapKeeper::ReadFile(MapFileRequest request, Done<MapFilePiece> done) {
  Post([this, request = std::move(request),
        done] { done(transfer_.Read(request, std::chrono::steady_clock::now())); },
       [done](const absl::Status& why) { done(why); });
}

void MapKeeper::Import(MapImportPiece piece, Done<MapImportProgress> done) {
  Post([this, piece = std::move(piece),
        done] { done(transfer_.Import(piece, std::chrono::steady_clock::now())); },
       [done](const absl::Status& why) { done(why); });
}

}  // namespace saccade
