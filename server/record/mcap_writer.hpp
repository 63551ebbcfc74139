#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Writes one MCAP file (https://mcap.dev/spec), uncompressed: pictures are coded already.
///
/// Messages gather in a chunk, which goes to the file in one write with its checksum and indexes.
/// What was written is in the kernel's hands: killed, a process loses its last chunk alone, and
/// every reader that streams reads the rest. Close() adds the index of the whole. One thread.
///
/// Errors are those of the disk, with file and reason: ResourceExhausted (full), Unavailable. After
/// one the writer only closes.
class McapWriter {
 public:
  using Texts = std::vector<std::pair<std::string, std::string>>;

  /// Makes `file`, which must not exist, for its owner alone.
  static absl::StatusOr<std::unique_ptr<McapWriter>> Create(const std::filesystem::path& file,
                                                            const std::string& library);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Ids of schema and channel, from 1. `data`: a FileDescriptorSet, with encoding "protobuf".
  std::uint16_t AddSchema(absl::string_view name, absl::string_view encoding,
                          absl::string_view data);
  std::uint16_t AddChannel(std::uint16_t schema, absl::string_view topic,
                           absl::string_view encoding);
  /// A record of texts by name.
  void AddMetadata(absl::string_view name, const Texts& texts);

  /// `time_ns`: on the clock of the file, which is the readers': Unix. A chunk that is large enough
  /// goes to the file.
  absl::Status Write(std::uint16_t channel, Timestamp time_ns, absl::string_view data);
  /// What waits goes to the file.
  absl::Status Flush();
  /// To the disk itself.
  absl::Status Sync();
  /// Index and end of the file; then nothing more.
  absl::Status Close();

  const std::filesystem::path& file() const { return file_; }
  /// So far, with what waits.
  std::uint64_t bytes() const { return written_ + chunk_.size() + outside_.size(); }
  std::uint64_t messages() const { return messages_; }

 private:
  struct ChunkIndex {
    Timestamp first_ns = 0, last_ns = 0;
    std::uint64_t offset = 0, length = 0;  // of its record
    std::map<std::uint16_t, std::uint64_t> indexes;
    std::uint64_t indexes_length = 0, size = 0;
  };
  struct MetadataIndex {
    std::string name;
    std::uint64_t offset = 0, length = 0;
  };

  McapWriter(std::filesystem::path file, int descriptor)
      : file_(std::move(file)), descriptor_(descriptor) {}
  absl::Status Put(absl::string_view bytes);
  std::string Summary() const;

  const std::filesystem::path file_;
  int descriptor_;
  absl::Status failed_;
  std::uint64_t written_ = 0, messages_ = 0;
  std::string outside_;             // records that wait and belong to no chunk
  std::string schemas_, channels_;  // their records, once more for the summary
  std::uint16_t schema_count_ = 0;
  std::string chunk_;  // records of messages
  ChunkIndex now_;     // of `chunk_`
  std::map<std::uint16_t, std::vector<std::pair<Timestamp, std::uint64_t>>> offsets_;
  std::map<std::uint16_t, std::uint64_t> counts_;  // of all channels
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
};

}  // namespace saccade
