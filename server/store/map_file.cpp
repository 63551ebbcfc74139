#include "server/store/map_file.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <zlib.h>

#include <algorithm>
#include <optional>

#include "server/map/archive.hpp"
#include "server/store/surface_archive.hpp"

namespace saccade {
namespace {

constexpr absl::string_view kMagic("SACCADE MAP\n");
constexpr std::uint32_t kVersion = 2;  // 1: without surfaces
constexpr absl::string_view kRemedy = "is damaged: restore it, or remove it";

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
  std::uint32_t sum = MapChecksum(part);
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
  if (MapChecksum(part) != sum) return std::nullopt;
  return part;
}

absl::Status DamagedMap(absl::string_view name, absl::string_view what) {
  return absl::DataLossError(absl::StrCat(name, ": ", what));
}

/// What a message can carry, and a list can show on a line.
bool IsShownName(absl::string_view name) {
  if (name.size() > kLongestMapName) return false;
  for (std::size_t at = 0; at < name.size();) {
    const auto first = static_cast<unsigned char>(name[at++]);
    if (first < 0x80) continue;
    const int more = first >= 0xf0 && first < 0xf5 ? 3 : first >= 0xe0 ? 2 : first >= 0xc2 ? 1 : 0;
    if (more == 0 || first >= 0xf5 || at + static_cast<std::size_t>(more) > name.size()) {
      return false;
    }
    std::uint32_t code = first & (0x3fU >> more);
    for (int k = 0; k < more; ++k) {
      const auto next = static_cast<unsigned char>(name[at++]);
      if ((next & 0xc0U) != 0x80U) return false;
      code = code << 6U | (next & 0x3fU);
    }
    constexpr std::uint32_t kLeast[] = {0, 0x80, 0x800, 0x10000};
    if (code < kLeast[more] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return false;
  }
  return true;
}

/// Takes everything before the map itself off the front of `bytes`.
absl::StatusOr<KeptMapFacts> TakeFacts(absl::string_view name, absl::string_view& bytes,
                                       std::uint32_t& version) {
  if (!absl::ConsumePrefix(&bytes, kMagic)) return DamagedMap(name, "is no map of saccade's");
  ArchiveReader head(bytes.substr(0, sizeof(kVersion)));
  head.Number(version);
  if (!head.ok()) return DamagedMap(name, "is cut short");
  bytes.remove_prefix(sizeof(kVersion));
  if (version > kVersion) {
    return DamagedMap(name, absl::StrCat("is of version ", version, "; this server reads ",
                                         kVersion, ": use the newer server, which wrote it"));
  }
  KeptMapFacts facts;
  const auto part = TakePart(bytes);
  ArchiveReader reader(part.value_or(absl::string_view()));
  Fields(reader, facts);
  if (!part || !reader.ok() || !reader.at_end() || !IsShownName(facts.name) || !IsMapId(facts.id) ||
      !IsMapId(facts.world)) {
    return DamagedMap(name, kRemedy);
  }
  return facts;
}

}  // namespace

std::uint32_t MapChecksum(absl::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

bool IsMapId(absl::string_view id) {
  return id.size() == 36 && std::all_of(id.begin(), id.end(), [](char c) {
           return c == '-' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

std::string EncodeMapFile(KeptMapFacts& facts, const StoredMap& map,
                          const SurfaceSnapshot* surface) {
  facts.metric = map.metric;
  facts.landmarks = static_cast<std::uint32_t>(map.known.size() + map.at_rest.size());
  facts.places = static_cast<std::uint32_t>(map.places.size());
  facts.width = map.lens.width;
  facts.height = map.lens.height;
  ArchiveWriter writer;
  Fields(writer, facts);
  std::string file(kMagic);
  ArchiveWriter version;
  std::uint32_t number = surface == nullptr ? 1 : kVersion;  // who reads no surfaces reads that
  version.Number(number);
  file += version.Take();
  Append(file, writer.Take());
  Append(file, EncodeMap(map));
  if (surface != nullptr) Append(file, EncodeSurface(*surface));
  facts.bytes = file.size();
  return file;
}

absl::StatusOr<KeptMapFacts> DecodeMapFacts(absl::string_view name, absl::string_view begin) {
  std::uint32_t version = 0;
  return TakeFacts(name, begin, version);
}

absl::StatusOr<KeptMap> DecodeMapFile(absl::string_view name, absl::string_view file) {
  absl::string_view rest = file;
  std::uint32_t version = 0;
  absl::StatusOr<KeptMapFacts> facts = TakeFacts(name, rest, version);
  if (!facts.ok()) return facts.status();
  const auto part = TakePart(rest);
  std::shared_ptr<const SurfaceSnapshot> surface;
  if (part && version >= 2) {
    const auto bytes = TakePart(rest);
    surface = bytes ? DecodeSurface(*bytes) : nullptr;
    if (surface == nullptr) return DamagedMap(name, kRemedy);
  }
  if (!part || !rest.empty()) return DamagedMap(name, kRemedy);
  absl::StatusOr<StoredMap> map = DecodeMap(*part);
  if (!map.ok()) return DamagedMap(name, map.status().message());
  facts->bytes = file.size();
  return KeptMap{*std::move(facts), *std::move(map), std::move(surface)};
}

}  // namespace saccade
