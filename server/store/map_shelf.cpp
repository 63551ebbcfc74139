#include "server/store/map_shelf.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <system_error>
#include <tuple>

#include "server/map/archive.hpp"
#include "server/store/store_files.hpp"
#include "shared/io/log.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kMagic("SACCADE MAP\n");
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
constexpr std::size_t kMostFacts = 4096;  // of a file's beginning: a name has at most 200 bytes
constexpr absl::string_view kEnding = ".map";
constexpr absl::string_view kRemedy = "is damaged: restore it, or remove it";

std::uint32_t Checksum(absl::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

template <typename Archive>
void Text(Archive& archive, std::string& text) {
  archive.Count(text, 1);
  archive.Block(text.data(), text.size());
}

template <typename Archive>
void Fields(Archive& archive, KeptMapFacts& facts) {
  Text(archive, facts.id);
  Text(archive, facts.name);
  Text(archive, facts.world);
  archive.Number(facts.saved_unix_s);
  std::uint8_t metric = facts.metric ? 1 : 0;
  archive.Number(metric);
  if constexpr (Archive::kReads) facts.metric = metric != 0;
  archive.Number(facts.landmarks);
  archive.Number(facts.places);
  archive.Number(facts.width);
  archive.Number(facts.height);
}

/// Its length, the bytes, their checksum.
void Append(std::string& file, const std::string& part) {
  ArchiveWriter frame;
  auto size = static_cast<std::uint64_t>(part.size());
  std::uint32_t sum = Checksum(part);
  frame.Number(size);
  frame.Number(sum);
  file += frame.Take();
  file += part;
}

/// Takes a part off the front of `rest`; nothing: it is damaged.
std::optional<absl::string_view> TakePart(absl::string_view& rest) {
  constexpr std::size_t kFrame = sizeof(std::uint64_t) + sizeof(std::uint32_t);
  if (rest.size() < kFrame) return std::nullopt;
  ArchiveReader frame(rest.substr(0, kFrame));
  std::uint64_t size = 0;
  std::uint32_t sum = 0;
  frame.Number(size);
  frame.Number(sum);
  rest.remove_prefix(kFrame);
  if (size > rest.size()) return std::nullopt;
  const absl::string_view part = rest.substr(0, static_cast<std::size_t>(size));
  rest.remove_prefix(part.size());
  if (Checksum(part) != sum) return std::nullopt;
  return part;
}

absl::Status DamagedMap(const fs::path& file, absl::string_view what) {
  return absl::DataLossError(absl::StrCat(file.string(), ": ", what));
}

/// Takes everything before the map itself off the front of `bytes`.
absl::StatusOr<KeptMapFacts> TakeFacts(const fs::path& file, absl::string_view& bytes) {
  if (!absl::ConsumePrefix(&bytes, kMagic)) return DamagedMap(file, "is no map of saccade's");
  ArchiveReader head(bytes.substr(0, sizeof(kVersion)));
  std::uint32_t version = 0;
  head.Number(version);
  if (!head.ok()) return DamagedMap(file, "is cut short");
  bytes.remove_prefix(sizeof(kVersion));
  if (version > kVersion) {
    return DamagedMap(file, absl::StrCat("is of version ", version, "; this server reads ",
                                         kVersion, ": use the newer server, which wrote it"));
  }
  KeptMapFacts facts;
  const auto part = TakePart(bytes);
  ArchiveReader reader(part.value_or(absl::string_view()));
  Fields(reader, facts);
  if (!part || !reader.ok() || !reader.at_end()) return DamagedMap(file, kRemedy);
  return facts;
}

/// Facts of what is whole as far as they go, without reading the rest.
absl::StatusOr<KeptMapFacts> ReadFacts(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return DamagedMap(file, "is no regular file");
  std::string begin(kMostFacts, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  absl::string_view bytes = begin;
  absl::StatusOr<KeptMapFacts> facts = TakeFacts(file, bytes);
  if (facts.ok()) facts->bytes = fs::file_size(file, error);
  return facts;
}

/// UUIDs alone: an id never leads out of the folder.
bool IsId(const std::string& id) {
  return id.size() == 36 && std::all_of(id.begin(), id.end(), [](char c) {
           return c == '-' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

}  // namespace

fs::path MapShelf::FileOf(const std::string& id) const {
  return directory_ / absl::StrCat(id, kEnding);
}

std::vector<KeptMapFacts> MapShelf::List() {
  std::vector<KeptMapFacts> all;
  std::error_code error;
  for (fs::directory_iterator at(directory_, error), end; !error && at != end;
       at.increment(error)) {
    const fs::path file = at->path();
    if (file.extension() != fs::path(std::string(kEnding))) continue;
    absl::StatusOr<KeptMapFacts> facts = ReadFacts(file);
    if (facts.ok() && file.stem() == facts->id) {
      all.push_back(*std::move(facts));
    } else if (std::find(told_.begin(), told_.end(), file.string()) == told_.end()) {
      told_.push_back(file.string());
      Log(absl::StrCat("maps: ", facts.ok() ? file.string() + ": its name is not its id"
                                            : std::string(facts.status().message())));
    }
  }
  std::sort(all.begin(), all.end(), [](const KeptMapFacts& a, const KeptMapFacts& b) {
    return std::tie(a.saved_unix_s, a.id) > std::tie(b.saved_unix_s, b.id);
  });
  return all;
}

absl::Status MapShelf::Save(KeptMapFacts facts, const StoredMap& map) {
  if (absl::Status made = PrepareDirectory(directory_); !made.ok()) return made;
  facts.metric = map.metric;
  facts.landmarks = static_cast<std::uint32_t>(map.known.size() + map.at_rest.size());
  facts.places = static_cast<std::uint32_t>(map.places.size());
  facts.width = map.lens.width;
  facts.height = map.lens.height;
  ArchiveWriter writer;
  Fields(writer, facts);
  std::string file(kMagic);
  ArchiveWriter version;
  std::uint32_t number = kVersion;
  version.Number(number);
  file += version.Take();
  Append(file, writer.Take());
  Append(file, EncodeMap(map));
  if (const int failed = WritePrivateFile(FileOf(facts.id), file); failed != 0) {
    return StoreFileError(FileOf(facts.id), failed);
  }
  return absl::OkStatus();
}

absl::StatusOr<MapShelf::Kept> MapShelf::Load(const std::string& id) {
  if (!IsId(id)) return absl::InvalidArgumentError("map_id: not the id of a map (see the list)");
  const fs::path file = FileOf(id);
  absl::StatusOr<std::string> bytes = ReadRegularFile(file, kMaxBytes, "a map");
  if (absl::IsNotFound(bytes.status())) {
    return absl::NotFoundError(absl::StrCat("map_id: there is no map ", id));
  }
  if (!bytes.ok()) return bytes.status();
  absl::string_view rest = *bytes;
  absl::StatusOr<KeptMapFacts> facts = TakeFacts(file, rest);
  if (!facts.ok()) return facts.status();
  const auto part = TakePart(rest);
  if (!part || !rest.empty()) return DamagedMap(file, kRemedy);
  absl::StatusOr<StoredMap> map = DecodeMap(*part);
  if (!map.ok()) {
    return absl::DataLossError(absl::StrCat(file.string(), ": ", map.status().message()));
  }
  facts->bytes = bytes->size();
  return Kept{*std::move(facts), *std::move(map)};
}

absl::Status MapShelf::Remove(const std::string& id) {
  if (!IsId(id)) return absl::InvalidArgumentError("map_id: not the id of a map (see the list)");
  std::error_code error;
  if (!fs::remove(FileOf(id), error)) {
    if (error) return StoreFileError(FileOf(id), error.value());
    return absl::NotFoundError(absl::StrCat("map_id: there is no map ", id));
  }
  return absl::OkStatus();
}

void MapShelf::Thin(std::size_t most) {
  std::size_t seen = 0;
  for (const KeptMapFacts& facts : List()) {
    if (facts.name.empty() && ++seen > most) Remove(facts.id).IgnoreError();
  }
}

}  // namespace saccade
