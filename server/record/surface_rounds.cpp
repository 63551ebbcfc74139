#include "server/record/surface_rounds.hpp"

#include "shared/wire/surface.hpp"

namespace saccade {
namespace {

constexpr Timestamp kEvery_ns = 1'000'000'000;
constexpr Timestamp kRound_ns = 10'000'000'000;

}  // namespace

std::optional<v1::GetSurfaceResponse> SurfaceRounds::Due(const SurfaceSnapshot& surface,
                                                         Timestamp now_ns) {
  const bool other = surface.edition != edition_;
  if (!other && now_ns - last_ns_ < kEvery_ns) return std::nullopt;
  last_ns_ = now_ns;
  if (other) written_.clear();
  edition_ = surface.edition;
  v1::GetSurfaceResponse due;
  due.set_edition(surface.edition);
  due.set_version(surface.version);
  for (const auto& [index, chunk] : surface.chunks) {
    Written& written = written_[index];
    if (written.version == chunk->version && now_ns - written.time_ns < kRound_ns) continue;
    written = {chunk->version, now_ns};
    *due.add_chunks() = wire::ToProto(*chunk);
  }
  if (due.chunks_size() == 0 && !other) return std::nullopt;
  return due;
}

}  // namespace saccade
