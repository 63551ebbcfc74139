#pragma once

#include <cstdint>
#include <string>

namespace saccade {

/// What saccade-decode is asked for.
struct DecodeRequest {
  std::string url;             // empty: the file on standard input
  std::int64_t after_ns = -1;  // only frames later than this: where the last decoder died
};

/// Decodes until the end and writes DecodeHeader messages to standard output. One thread, from
/// within the sandbox. Returns the exit code.
int DecodeVideo(const DecodeRequest& request);

}  // namespace saccade
