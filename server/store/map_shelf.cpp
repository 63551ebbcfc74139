#include "server/store/map_shelf.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <fstream>
#include <system_error>
#include <tuple>

#include "server/store/store_files.hpp"
#include "shared/io/log.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kEnding = ".map";

/// Facts of what is whole as far as they go, without reading the rest.
absl::StatusOr<KeptMapFacts> ReadFacts(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    return absl::DataLossError(absl::StrCat(file.string(), ": is no regular file"));
  }
  std::string begin(kMostMapFacts, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  absl::StatusOr<KeptMapFacts> facts = DecodeMapFacts(file.string(), begin);
  if (facts.ok()) facts->bytes = fs::file_size(file, error);
  return facts;
}

absl::Status NoId() {
  return absl::InvalidArgumentError("map_id: not the id of a map (see the list)");
}

absl::Status NoSuchMap(absl::string_view id) {
  return absl::NotFoundError(absl::StrCat("map_id: there is no map ", id));
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

absl::Status MapShelf::Save(KeptMapFacts facts, const StoredMap& map,
                            const SurfaceSnapshot* surface) {
  if (absl::Status made = PrepareDirectory(directory_); !made.ok()) return made;
  const std::string file = EncodeMapFile(facts, map, surface);
  if (const int failed = WritePrivateFile(FileOf(facts.id), file); failed != 0) {
    return StoreFileError(FileOf(facts.id), failed);
  }
  return absl::OkStatus();
}

absl::StatusOr<KeptMap> MapShelf::Load(const std::string& id) {
  if (!IsMapId(id)) return NoId();
  const fs::path file = FileOf(id);
  const absl::StatusOr<std::string> bytes = ReadRegularFile(file, kMostMapBytes, "a map");
  if (absl::IsNotFound(bytes.status())) return NoSuchMap(id);
  if (!bytes.ok()) return bytes.status();
  return DecodeMapFile(file.string(), *bytes);
}

absl::Status MapShelf::Remove(const std::string& id) {
  if (!IsMapId(id)) return NoId();
  std::error_code error;
  if (!fs::remove(FileOf(id), error)) {
    if (error) return StoreFileError(FileOf(id), error.value());
    return NoSuchMap(id);
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
