#include "server/record/mcap_writer.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <type_traits>

#include "server/record/mcap_format.hpp"

namespace saccade {
namespace {

static_assert(std::endian::native == std::endian::little, "MCAP is little-endian");

constexpr std::size_t kChunkBytes = 1 << 20;

template <typename T>
void Number(std::string& out, T value) {
  static_assert(std::is_integral_v<T>);
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

void Text(std::string& out, absl::string_view text) {
  Number(out, static_cast<std::uint32_t>(text.size()));
  out.append(text.data(), text.size());
}

void Record(std::string& out, mcap::Opcode opcode, absl::string_view content) {
  Number(out, static_cast<std::uint8_t>(opcode));
  Number(out, static_cast<std::uint64_t>(content.size()));
  out.append(content.data(), content.size());
}

absl::Status DiskError(const std::filesystem::path& file, int error) {
  const std::string what = absl::StrCat(file.string(), ": ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    return absl::ResourceExhaustedError(absl::StrCat(what, "; make room and start anew"));
  }
  return absl::UnavailableError(absl::StrCat(what, "; choose another --record"));
}

/// A group of records of the summary, and where it begins.
struct Group {
  mcap::Opcode opcode;
  std::string records;
};

}  // namespace

absl::StatusOr<std::unique_ptr<McapWriter>> McapWriter::Create(const std::filesystem::path& file,
                                                               const std::string& library) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) return DiskError(file, errno);
  std::unique_ptr<McapWriter> writer(new McapWriter(file, descriptor));
  std::string header;
  Text(header, "");  // profile
  Text(header, library);
  std::string begin(mcap::kMagic);
  Record(begin, mcap::kHeader, header);
  if (absl::Status put = writer->Put(begin); !put.ok()) return put;
  return writer;
}

McapWriter::~McapWriter() { Close().IgnoreError(); }

absl::Status McapWriter::Put(absl::string_view bytes) {
  if (!failed_.ok() || descriptor_ < 0) return failed_;
  while (!bytes.empty()) {
    const ssize_t put = ::write(descriptor_, bytes.data(), bytes.size());
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return failed_ = DiskError(file_, put < 0 ? errno : EIO);
    written_ += static_cast<std::uint64_t>(put);
    bytes.remove_prefix(static_cast<std::size_t>(put));
  }
  return absl::OkStatus();
}

std::uint16_t McapWriter::AddSchema(absl::string_view name, absl::string_view encoding,
                                    absl::string_view data) {
  std::string content;
  Number(content, ++schema_count_);
  Text(content, name);
  Text(content, encoding);
  Text(content, data);
  std::string record;
  Record(record, mcap::kSchema, content);
  outside_ += record;
  schemas_ += record;
  return schema_count_;
}

std::uint16_t McapWriter::AddChannel(std::uint16_t schema, absl::string_view topic,
                                     absl::string_view encoding) {
  const auto id = static_cast<std::uint16_t>(counts_.size() + 1);
  counts_[id] = 0;
  std::string content;
  Number(content, id);
  Number(content, schema);
  Text(content, topic);
  Text(content, encoding);
  Number(content, std::uint32_t{0});  // no metadata
  std::string record;
  Record(record, mcap::kChannel, content);
  outside_ += record;
  channels_ += record;
  return id;
}

void McapWriter::AddMetadata(absl::string_view name, const Texts& texts) {
  std::string map, content;
  for (const auto& [key, value] : texts) {
    Text(map, key);
    Text(map, value);
  }
  Text(content, name);
  Text(content, map);
  const std::uint64_t before = outside_.size();
  Record(outside_, mcap::kMetadata, content);
  metadata_.push_back({std::string(name), written_ + before, outside_.size() - before});
}

absl::Status McapWriter::Write(std::uint16_t channel, Timestamp time_ns, absl::string_view data) {
  if (!failed_.ok()) return failed_;
  if (chunk_.empty()) {
    now_ = ChunkIndex();
    now_.first_ns = now_.last_ns = time_ns;
  }
  now_.first_ns = std::min(now_.first_ns, time_ns);
  now_.last_ns = std::max(now_.last_ns, time_ns);
  offsets_[channel].emplace_back(time_ns, chunk_.size());
  const std::uint64_t number = ++counts_[channel];
  ++messages_;
  Number(chunk_, static_cast<std::uint8_t>(mcap::kMessage));
  Number(chunk_, static_cast<std::uint64_t>(2 + 4 + 8 + 8 + data.size()));
  Number(chunk_, channel);
  Number(chunk_, static_cast<std::uint32_t>(number));
  Number(chunk_, static_cast<std::uint64_t>(time_ns));
  Number(chunk_, static_cast<std::uint64_t>(time_ns));
  chunk_.append(data.data(), data.size());
  return chunk_.size() < kChunkBytes ? absl::OkStatus() : Flush();
}

absl::Status McapWriter::Flush() {
  std::string out = std::exchange(outside_, {});
  if (chunk_.empty()) return Put(out);
  std::string content;
  content.reserve(chunk_.size() + 64);
  Number(content, static_cast<std::uint64_t>(now_.first_ns));
  Number(content, static_cast<std::uint64_t>(now_.last_ns));
  Number(content, static_cast<std::uint64_t>(chunk_.size()));
  Number(content, mcap::Crc(chunk_));
  Text(content, "");  // not compressed
  Number(content, static_cast<std::uint64_t>(chunk_.size()));
  content += chunk_;
  now_.size = chunk_.size();
  now_.offset = written_ + out.size();
  Record(out, mcap::kChunk, content);
  now_.length = written_ + out.size() - now_.offset;
  const std::uint64_t indexes_begin = written_ + out.size();
  for (const auto& [channel, offsets] : offsets_) {
    now_.indexes[channel] = written_ + out.size();
    std::string index;
    Number(index, channel);
    Number(index, static_cast<std::uint32_t>(16 * offsets.size()));
    for (const auto& [time_ns, offset] : offsets) {
      Number(index, static_cast<std::uint64_t>(time_ns));
      Number(index, offset);
    }
    Record(out, mcap::kMessageIndex, index);
  }
  now_.indexes_length = written_ + out.size() - indexes_begin;
  chunks_.push_back(now_);
  chunk_.clear();
  offsets_.clear();
  return Put(out);
}

absl::Status McapWriter::Sync() {
  if (!failed_.ok() || descriptor_ < 0) return failed_;
  return ::fdatasync(descriptor_) == 0 ? absl::OkStatus() : failed_ = DiskError(file_, errno);
}

std::string McapWriter::Summary() const {
  std::string statistics, chunks, metadata, counts;
  Timestamp first_ns = 0, last_ns = 0;
  for (const ChunkIndex& chunk : chunks_) {
    const bool first = &chunk == &chunks_.front();
    first_ns = first ? chunk.first_ns : std::min(first_ns, chunk.first_ns);
    last_ns = first ? chunk.last_ns : std::max(last_ns, chunk.last_ns);
    std::string content, indexes;
    for (const auto& [channel, offset] : chunk.indexes) {
      Number(indexes, channel);
      Number(indexes, offset);
    }
    for (const std::uint64_t number :
         {static_cast<std::uint64_t>(chunk.first_ns), static_cast<std::uint64_t>(chunk.last_ns),
          chunk.offset, chunk.length}) {
      Number(content, number);
    }
    Text(content, indexes);
    Number(content, chunk.indexes_length);
    Text(content, "");
    Number(content, chunk.size);
    Number(content, chunk.size);
    Record(chunks, mcap::kChunkIndex, content);
  }
  for (const MetadataIndex& each : metadata_) {
    std::string content;
    Number(content, each.offset);
    Number(content, each.length);
    Text(content, each.name);
    Record(metadata, mcap::kMetadataIndex, content);
  }
  for (const auto& [channel, count] : counts_) {
    Number(counts, channel);
    Number(counts, count);
  }
  std::string content;
  Number(content, messages_);
  Number(content, schema_count_);
  Number(content, static_cast<std::uint32_t>(counts_.size()));
  Number(content, std::uint32_t{0});  // attachments
  Number(content, static_cast<std::uint32_t>(metadata_.size()));
  Number(content, static_cast<std::uint32_t>(chunks_.size()));
  Number(content, static_cast<std::uint64_t>(first_ns));
  Number(content, static_cast<std::uint64_t>(last_ns));
  Text(content, counts);
  Record(statistics, mcap::kStatistics, content);

  const std::uint64_t begin = written_;
  std::string summary, offsets;
  for (const Group& group : {Group{mcap::kSchema, schemas_}, Group{mcap::kChannel, channels_},
                             Group{mcap::kStatistics, statistics}, Group{mcap::kChunkIndex, chunks},
                             Group{mcap::kMetadataIndex, metadata}}) {
    if (group.records.empty()) continue;
    std::string offset;
    Number(offset, static_cast<std::uint8_t>(group.opcode));
    Number(offset, begin + summary.size());
    Number(offset, static_cast<std::uint64_t>(group.records.size()));
    summary += group.records;
    Record(offsets, mcap::kSummaryOffset, offset);
  }
  const std::uint64_t offsets_begin = begin + summary.size();
  summary += offsets;
  // The footer's own checksum is of everything of the summary before it.
  Number(summary, static_cast<std::uint8_t>(mcap::kFooter));
  Number(summary, std::uint64_t{20});
  Number(summary, begin);
  Number(summary, offsets_begin);
  Number(summary, mcap::Crc(summary));
  summary.append(mcap::kMagic.data(), mcap::kMagic.size());
  return summary;
}

absl::Status McapWriter::Close() {
  if (descriptor_ < 0) return failed_;
  Flush().IgnoreError();
  std::string end;
  Record(end, mcap::kDataEnd, std::string(4, '\0'));  // without a checksum of it all
  Put(end).IgnoreError();
  Put(Summary()).IgnoreError();
  Sync().IgnoreError();
  ::close(std::exchange(descriptor_, -1));
  return failed_;
}

}  // namespace saccade
