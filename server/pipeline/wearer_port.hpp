#pragma once

#include <absl/strings/string_view.h>

#include <cstddef>
#include <memory>
#include <string>

namespace saccade {

/// Where the socket of a wearer's phone leads: the gateway has the socket, and knows nothing of
/// what is said through it.
class WearerPort {
 public:
  /// The other direction: the socket. Any thread; none blocks.
  class Out {
   public:
    virtual ~Out() = default;
    /// One message; left out if the phone takes none for long.
    virtual void Send(std::string message) = 0;
    /// Ends the link once what was sent before has gone out. `reason`: for people, at most 120
    /// bytes.
    virtual void End(const std::string& reason) = 0;
  };

  /// One link, from the socket's thread. It is destroyed when the socket has ended.
  class Link {
   public:
    virtual ~Link() = default;
    /// How long the next message may be [bytes]; asked before it is read.
    virtual std::size_t most_bytes() const = 0;
    virtual void OnMessage(absl::string_view message) = 0;
    /// Ten times a second.
    virtual void OnTick() = 0;
  };

  virtual ~WearerPort() = default;
  /// `peer`: its address, without the port.
  virtual std::unique_ptr<Link> Open(const std::string& peer, std::shared_ptr<Out> out) = 0;
};

}  // namespace saccade
