#include "server/record/mcap_reader.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstring>
#include <system_error>
#include <type_traits>
#include <utility>

#include "server/record/mcap_format.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr Timestamp kLongest_ns = Timestamp{2} * 86'400 * 1'000'000'000;
constexpr std::uint64_t kMostBytes = std::uint64_t{256} << 20;  // of a chunk, or the summary
/// Takes numbers and texts off the front; after the first that is not there ok() is false.
class Fields {
 public:
  explicit Fields(absl::string_view bytes) : left_(bytes) {}
  template <typename T>
  T Number() {
    static_assert(std::is_integral_v<T>);
    T value{};
    const absl::string_view bytes = Take(sizeof(T));
    if (ok_) std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  absl::string_view Text() { return Take(Number<std::uint32_t>()); }
  absl::string_view Take(std::uint64_t size) {
    ok_ = ok_ && size <= left_.size();
    if (!ok_) return {};
    const absl::string_view bytes = left_.substr(0, static_cast<std::size_t>(size));
    left_.remove_prefix(bytes.size());
    return bytes;
  }
  bool ok() const { return ok_; }
  bool at_end() const { return left_.empty(); }
  absl::string_view left() const { return left_; }

 private:
  absl::string_view left_;
  bool ok_ = true;
};

}  // namespace

absl::Status McapReader::Damaged(absl::string_view what) const {
  return absl::DataLossError(absl::StrCat(file_.string(), ": ", what));
}

absl::StatusOr<std::unique_ptr<McapReader>> McapReader::Open(const fs::path& file) {
  std::error_code error;
  const auto size = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
  std::ifstream in(file, std::ios::binary);
  if (error || !in) {
    return absl::DataLossError(absl::StrCat(file.string(), ": no such file, or not to be read"));
  }
  std::unique_ptr<McapReader> reader(new McapReader(file, std::move(in), size));
  if (reader->Bytes(0, mcap::kMagic.size()) != mcap::kMagic)
    return reader->Damaged("is no MCAP file");
  reader->whole_ = reader->ReadSummary();
  if (!reader->whole_) {
    if (absl::Status scanned = reader->Scan(); !scanned.ok()) return scanned;
  }
  for (const Chunk& chunk : reader->chunks_) {
    const bool first = &chunk == &reader->chunks_.front();
    reader->first_ns_ = first ? chunk.first_ns : std::min(reader->first_ns_, chunk.first_ns);
    reader->last_ns_ = first ? chunk.last_ns : std::max(reader->last_ns_, chunk.last_ns);
  }
  // Nobody steps through years of nothing.
  if (reader->first_ns_ < 0 || reader->last_ns_ < reader->first_ns_ ||
      reader->last_ns_ - reader->first_ns_ > kLongest_ns) {
    return reader->Damaged("its times are not those of one recording");
  }
  return reader;
}

std::string McapReader::Bytes(std::uint64_t offset, std::uint64_t size) {
  if (offset > size_ || size > size_ - offset || size > kMostBytes) return {};
  std::string bytes(static_cast<std::size_t>(size), '\0');
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(offset));
  in_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return in_ ? bytes : std::string();
}

bool McapReader::TakeChannel(absl::string_view content) {
  Fields fields(content);
  const auto id = fields.Number<std::uint16_t>();
  fields.Number<std::uint16_t>();  // schema
  const absl::string_view topic = fields.Text();
  if (fields.ok()) topics_[id] = std::string(topic);
  return fields.ok();
}

bool McapReader::ReadSummary() {
  if (size_ < 2 * mcap::kMagic.size() + mcap::kFooterBytes) return false;
  const std::uint64_t footer_at = size_ - mcap::kMagic.size() - mcap::kFooterBytes;
  const std::string end = Bytes(footer_at, mcap::kFooterBytes + mcap::kMagic.size());
  if (end.size() < mcap::kFooterBytes ||
      absl::string_view(end).substr(mcap::kFooterBytes) != mcap::kMagic)
    return false;
  Fields footer(absl::string_view(end).substr(mcap::kHeadBytes));
  const auto begin = footer.Number<std::uint64_t>();
  footer.Number<std::uint64_t>();
  const auto sum = footer.Number<std::uint32_t>();
  if (begin == 0 || begin > footer_at) return false;
  std::string summary = Bytes(begin, footer_at - begin);
  if (sum != 0 && mcap::Crc(summary + end.substr(0, mcap::kFooterBytes - sizeof(sum))) != sum)
    return false;
  for (Fields records(summary); !records.at_end();) {
    const auto opcode = records.Number<std::uint8_t>();
    const absl::string_view content = records.Take(records.Number<std::uint64_t>());
    if (!records.ok() || (opcode == mcap::kChannel && !TakeChannel(content))) return false;
    if (opcode != mcap::kChunkIndex) continue;
    Fields fields(content);
    Chunk chunk;
    chunk.first_ns = static_cast<Timestamp>(fields.Number<std::uint64_t>());
    chunk.last_ns = static_cast<Timestamp>(fields.Number<std::uint64_t>());
    chunk.offset = fields.Number<std::uint64_t>() + mcap::kHeadBytes;
    chunk.size = fields.Number<std::uint64_t>() - mcap::kHeadBytes;
    if (!fields.ok()) return false;
    chunks_.push_back(chunk);
  }
  return true;
}

absl::Status McapReader::Scan() {
  chunks_.clear();
  for (std::uint64_t at = mcap::kMagic.size();;) {
    const std::string head = Bytes(at, mcap::kHeadBytes);
    if (head.size() < mcap::kHeadBytes) return absl::OkStatus();
    Fields fields(head);
    const auto opcode = fields.Number<std::uint8_t>();
    const auto size = fields.Number<std::uint64_t>();
    if (size > size_ - at - mcap::kHeadBytes) return absl::OkStatus();  // it was cut off here
    if (opcode == mcap::kChannel && !TakeChannel(Bytes(at + mcap::kHeadBytes, size))) {
      return Damaged("a channel is damaged");
    }
    if (opcode == mcap::kChunk) {
      const std::string times = Bytes(at + mcap::kHeadBytes, 16);
      Fields chunk(times);
      const auto first_ns = static_cast<Timestamp>(chunk.Number<std::uint64_t>());
      const auto last_ns = static_cast<Timestamp>(chunk.Number<std::uint64_t>());
      if (!chunk.ok()) return Damaged("a chunk is damaged");
      chunks_.push_back({first_ns, last_ns, at + mcap::kHeadBytes, size});
    }
    at += mcap::kHeadBytes + size;
  }
}

absl::Status McapReader::Read(Timestamp from_ns, Timestamp until_ns,
                              const std::function<void(const Message&)>& on_message) {
  for (const Chunk& chunk : chunks_) {
    if (chunk.last_ns < from_ns || chunk.first_ns > until_ns) continue;
    const std::string content = Bytes(chunk.offset, chunk.size);
    Fields fields(content);
    fields.Number<std::uint64_t>();
    fields.Number<std::uint64_t>();
    fields.Number<std::uint64_t>();
    const auto sum = fields.Number<std::uint32_t>();
    const absl::string_view compression = fields.Text();
    const absl::string_view records = fields.Take(fields.Number<std::uint64_t>());
    if (!fields.ok()) return Damaged("a chunk is damaged");
    if (!compression.empty()) {
      return absl::UnimplementedError(
          absl::StrCat(file_.string(), ": is compressed (", compression,
                       "): make it plain with `mcap compress --compression none`"));
    }
    if (sum != 0 && mcap::Crc(records) != sum)
      return Damaged("the checksum of a chunk does not hold");
    for (Fields each(records); !each.at_end();) {
      const auto opcode = each.Number<std::uint8_t>();
      Fields message(each.Take(each.Number<std::uint64_t>()));
      if (!each.ok()) return Damaged("a chunk is damaged");
      if (opcode == mcap::kChannel) TakeChannel(message.left());
      if (opcode != mcap::kMessage) continue;
      const auto topic = topics_.find(message.Number<std::uint16_t>());
      message.Number<std::uint32_t>();
      const auto time_ns = static_cast<Timestamp>(message.Number<std::uint64_t>());
      message.Number<std::uint64_t>();
      if (!message.ok() || topic == topics_.end()) return Damaged("a message is damaged");
      if (time_ns < from_ns || time_ns > until_ns) continue;
      on_message({topic->second, time_ns, message.left()});
    }
  }
  return absl::OkStatus();
}

}  // namespace saccade
