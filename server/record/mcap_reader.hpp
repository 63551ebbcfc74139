#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Reads an MCAP file (https://mcap.dev/spec) that is not compressed, by its index. One that was
/// cut off has none, and is gone through once: all its whole chunks count. One thread.
class McapReader {
 public:
  struct Message {
    absl::string_view topic;
    Timestamp time_ns = 0;  // of the log
    absl::string_view data;
  };

  /// DataLoss: no such file, or damaged; Unimplemented: compressed. Both name the file.
  static absl::StatusOr<std::unique_ptr<McapReader>> Open(const std::filesystem::path& file);

  /// Whether it was ended as it should be.
  bool whole() const { return whole_; }
  /// Of all messages; equal where there are none.
  Timestamp first_ns() const { return first_ns_; }
  Timestamp last_ns() const { return last_ns_; }
  /// Every message with a time in [from_ns, until_ns], in the order in which they were written.
  /// DataLoss: a chunk is damaged; what was read before it counts.
  absl::Status Read(Timestamp from_ns, Timestamp until_ns,
                    const std::function<void(const Message&)>& on_message);

 private:
  struct Chunk {
    Timestamp first_ns = 0, last_ns = 0;
    std::uint64_t offset = 0;  // of its record's content
    std::uint64_t size = 0;    // of that
  };
  McapReader(std::filesystem::path file, std::ifstream in, std::uint64_t size)
      : file_(std::move(file)), in_(std::move(in)), size_(size) {}

  /// Of `size` bytes from `offset`; empty: they are not there.
  std::string Bytes(std::uint64_t offset, std::uint64_t size);
  bool ReadSummary();
  absl::Status Scan();
  bool TakeChannel(absl::string_view content);
  absl::Status Damaged(absl::string_view what) const;

  const std::filesystem::path file_;
  std::ifstream in_;
  const std::uint64_t size_;
  bool whole_ = false;
  Timestamp first_ns_ = 0, last_ns_ = 0;
  std::vector<Chunk> chunks_;
  std::map<std::uint16_t, std::string> topics_;  // by channel
};

}  // namespace saccade
