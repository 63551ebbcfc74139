#pragma once

#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace saccade {

/// Which names a browser may call this server by (against DNS rebinding), and which pages may call
/// it.
class HostCheck {
 public:
  /// Accepts `localhost`, IP literals, this machine's host name and `also` (compared without case).
  explicit HostCheck(const std::vector<std::string>& also);

  /// True if a request with this Host header ("name", "name:port", "[::1]:port") is for us.
  bool HostAllowed(absl::string_view host) const;

  /// True if a page at `origin` ("http://name:port", empty: no browser page) may call us as `host`:
  /// only our own pages may.
  static bool OriginAllowed(absl::string_view origin, absl::string_view host);

 private:
  std::vector<std::string> names_;
};

}  // namespace saccade
