#pragma once

#include <map>
#include <optional>

#include "saccade/v1/surface.pb.h"
#include "shared/scene/surface_snapshot.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Which chunks of a surface a recording is to hold now: what is new at once, and everything once
/// more in every round of ten seconds, a little of it each time, so that whoever begins anywhere
/// has all of it without a burst of it all.
class SurfaceRounds {
 public:
  /// What is due since the last call; nothing: nothing is.
  std::optional<v1::GetSurfaceResponse> Due(const SurfaceSnapshot& surface, Timestamp now_ns);
  /// Everything is due again: of a new file.
  void Restart() { *this = SurfaceRounds(); }

 private:
  struct Written {
    std::uint64_t version = 0;
    Timestamp time_ns = 0;
  };
  std::uint64_t edition_ = 0;
  Timestamp last_ns_ = 0;
  std::map<SurfaceChunk::Index, Written> written_;
};

}  // namespace saccade
