#pragma once

#include <cstddef>
#include <cstdint>

#include "saccade/v1/session.pb.h"
#include "server/rpc/change_log.hpp"

namespace saccade {

/// An event is at most about this large encoded: far below what a receiver takes by default (4
/// MiB), and video and poses go out between the parts of a large state.
inline constexpr std::size_t kPartBytes = 256 << 10;

/// At most how large an annotation is encoded.
std::size_t EncodedBytes(const Annotation& annotation);

/// How far one reader is in the changes of a list. What it lacks is handed out in this order: what
/// it never had (by the number of its content), then newer estimates of what it has, then removals.
/// Estimates go round: whoever is slow gets all of them, not those at the front again and again.
struct ReadPosition {
  bool started = false;
  ChangeNumber content = 0;   // has everything made or edited up to here
  ChangeNumber estimate = 0;  // ... and every estimate up to here
  ChangeNumber removal = 0;   // ... and knows of every removal up to here
  // A round of estimates under way: up to which content it came, and what will be known after it.
  ChangeNumber round_at = 0, round_until = 0;

  bool IsUpTo(ChangeNumber newest) const {
    return content == newest && estimate == newest && removal == newest && round_at == 0;
  }
  bool IsComplete() const { return started && IsUpTo(content); }
  friend bool operator==(const ReadPosition&, const ReadPosition&) = default;
};

/// One subscriber's map; turns a state into what it lacks.
class MapReader {
 public:
  /// Fills `delta` with the next part of what is lacking, takes it as sent and sets `more` if there
  /// are others; false if there is nothing worth sending. The first part of a subscription, and of
  /// a new map, is `full`.
  bool Next(const NumberedState& state, v1::MapDelta& delta);

  /// Whether it has some state whole. Equal readers get the same from Next.
  bool complete() const { return at_.IsComplete(); }
  friend bool operator==(const MapReader&, const MapReader&) = default;

 private:
  ReadPosition at_;
  std::uint64_t generation_ = 0;
  std::uint64_t revision_ = 0;
};

/// The same for annotations. A live estimate of a stroke that was sent goes without the stroke.
class AnnotationReader {
 public:
  bool Next(const NumberedState& state, v1::AnnotationEvent& delta);

  bool complete() const { return at_.IsComplete(); }
  friend bool operator==(const AnnotationReader&, const AnnotationReader&) = default;

 private:
  ReadPosition at_;
};

/// The whole map in one message: 3000 landmarks, as many as a map keeps, are below 0.5 MB.
v1::MapDelta FullMap(const MapSnapshot& snapshot);

}  // namespace saccade
