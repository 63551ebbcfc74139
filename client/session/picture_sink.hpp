#pragma once

#include "client/net/stream.hpp"

namespace saccade::session {

/// Where coded pictures go. Called from the session's threads; must not block.
class PictureSink {
 public:
  virtual ~PictureSink() = default;
  virtual void Push(net::CodedPicture picture) = 0;
  /// A new subscription begins: its first unit is a key frame.
  virtual void Reset() = 0;
  /// True while so much waits to be decoded that no more should come.
  virtual bool Behind() const = 0;
  /// True once after the decoder lost its state.
  virtual bool TakeKeyFrameRequest() = 0;
};

}  // namespace saccade::session
