#include "server/store/map_transfer.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "server/store/store_files.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kPart = ".part";
constexpr absl::string_view kFileField = "file";  // as errors of what comes in name it

absl::Status Anew(absl::string_view why) {
  return absl::AbortedError(absl::StrCat("offset_bytes: ", why, "; begin anew at 0"));
}

}  // namespace

MapTransfer::~MapTransfer() {
  while (!uploads_.empty()) Forget(uploads_.begin());
}

absl::StatusOr<MapTransfer::Reading*> MapTransfer::Open(const std::string& id, Time now) {
  std::erase_if(readings_, [&](const Reading& each) { return now - each.touched > kPatience; });
  // Refused before it is sent, if it is damaged.
  if (const auto whole = shelf_.Load(id); !whole.ok()) return whole.status();
  Reading reading;
  reading.id = id;
  reading.touched = now;
  reading.file.open(shelf_.FileOf(id), std::ios::binary);
  std::string block(kMostSent, '\0');
  while (reading.file.read(block.data(), static_cast<std::streamsize>(block.size())) ||
         reading.file.gcount() > 0) {
    const auto got = static_cast<std::size_t>(reading.file.gcount());
    reading.checksum = MapChecksum(absl::string_view(block).substr(0, got), reading.checksum);
    reading.total += got;
  }
  if (!reading.file.eof()) return StoreFileError(shelf_.FileOf(id), EIO);
  if (readings_.size() >= kMost) readings_.pop_front();
  readings_.push_back(std::move(reading));
  return &readings_.back();
}

absl::StatusOr<MapFilePiece> MapTransfer::Read(const MapFileRequest& request, Time now) {
  Reading* reading = nullptr;
  if (request.offset == 0) {
    const auto opened = Open(request.id, now);
    if (!opened.ok()) return opened.status();
    reading = *opened;
  } else {
    const auto found = std::find_if(readings_.rbegin(), readings_.rend(), [&](const Reading& each) {
      return each.id == request.id && each.checksum == request.checksum;
    });
    if (found == readings_.rend()) return Anew("this file is not being read (any more)");
    reading = &*found;
  }
  if (request.offset > reading->total) {
    return absl::InvalidArgumentError(
        absl::StrCat("offset_bytes: ", request.offset, " of ", reading->total, "; give less"));
  }
  reading->touched = now;
  MapFilePiece piece{.total = reading->total, .checksum = reading->checksum, .data = {}};
  piece.data.resize(std::min<std::uint64_t>(kMostSent, reading->total - request.offset));
  reading->file.clear();
  reading->file.seekg(static_cast<std::streamoff>(request.offset));
  reading->file.read(piece.data.data(), static_cast<std::streamsize>(piece.data.size()));
  if (!reading->file) return StoreFileError(shelf_.FileOf(request.id), EIO);
  return piece;
}

fs::path MapTransfer::PartOf(const std::string& upload_id) const {
  return shelf_.directory() / absl::StrCat(upload_id, kPart);
}

void MapTransfer::Forget(std::list<Upload>::iterator upload) {
  std::error_code ignored;
  fs::remove(PartOf(upload->id), ignored);
  uploads_.erase(upload);
}

void MapTransfer::Sweep() {
  if (std::exchange(swept_, true)) return;
  std::error_code error;
  for (fs::directory_iterator at(shelf_.directory(), error), end; !error && at != end;
       at.increment(error)) {
    std::error_code ignored;
    if (at->path().extension() == fs::path(std::string(kPart))) fs::remove(at->path(), ignored);
  }
}

absl::Status MapTransfer::CheckNew(const std::string& id) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(shelf_.FileOf(id), error))) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("file: the map ", id,
                   " is kept here already; delete that one first to have this in its "
                   "place"));
}

absl::StatusOr<KeptMapFacts> MapTransfer::CheckBegin(const MapImportPiece& piece) {
  if (!IsMapId(piece.upload_id)) {
    return absl::InvalidArgumentError("upload_id: not a UUID in lower case");
  }
  if (piece.total == 0 || piece.total > kMostMapBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("total_bytes: ", piece.total, "; a map has 1 to ", kMostMapBytes));
  }
  if (piece.data.size() < std::min<std::uint64_t>(piece.total, kMostMapFacts)) {
    return absl::InvalidArgumentError(
        absl::StrCat("data: the first piece has at least ", kMostMapFacts, " bytes, or all"));
  }
  auto facts = DecodeMapFacts(kFileField, piece.data);
  if (!facts.ok()) return facts.status();
  if (absl::Status is_new = CheckNew(facts->id); !is_new.ok()) return is_new;
  return facts;
}

absl::StatusOr<MapTransfer::Upload*> MapTransfer::Begin(const MapImportPiece& piece, Time now) {
  for (auto at = uploads_.begin(); at != uploads_.end();) {
    const auto next = std::next(at);
    if (at->id == piece.upload_id || now - at->touched > kPatience) Forget(at);
    at = next;
  }
  if (const auto facts = CheckBegin(piece); !facts.ok()) return facts.status();
  if (uploads_.size() >= kMost) {
    return absl::ResourceExhaustedError(
        "upload_id: as many maps are on their way here as can be; try again in a minute");
  }
  if (absl::Status made = PrepareDirectory(shelf_.directory()); !made.ok()) return made;
  Sweep();
  std::error_code error;
  const fs::space_info space = fs::space(shelf_.directory(), error);
  if (!error && space.available < piece.total + kMostMapBytes) {
    return StoreFileError(shelf_.directory(), ENOSPC);
  }
  if (absl::Status made = CreatePrivate(PartOf(piece.upload_id)); !made.ok()) return made;
  uploads_.push_back(
      {.id = piece.upload_id, .total = piece.total, .checksum = piece.checksum, .touched = now});
  return &uploads_.back();
}

absl::Status MapTransfer::Append(Upload& upload, const std::string& data) {
  const fs::path part = PartOf(upload.id);
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0) return StoreFileError(part, errno);
  int failed = 0;
  for (absl::string_view left = data; !left.empty() && failed == 0;) {
    const ssize_t written = ::write(descriptor, left.data(), left.size());
    if (written > 0) left.remove_prefix(static_cast<std::size_t>(written));
    if (written < 0 && errno != EINTR) failed = errno;
  }
  ::close(descriptor);
  if (failed != 0) return StoreFileError(part, failed);
  upload.so_far = MapChecksum(data, upload.so_far);
  upload.received += data.size();
  return absl::OkStatus();
}

absl::StatusOr<KeptMapFacts> MapTransfer::Finish(const Upload& upload) {
  if (upload.so_far != upload.checksum) {
    return absl::DataLossError("file_crc32: is not that of what came; send the file anew");
  }
  const auto bytes = ReadRegularFile(PartOf(upload.id), kMostMapBytes, "a map");
  if (!bytes.ok()) return bytes.status();
  absl::StatusOr<KeptMap> kept = DecodeMapFile(kFileField, *bytes);
  if (!kept.ok()) return kept.status();
  if (absl::Status is_new = CheckNew(kept->facts.id); !is_new.ok()) return is_new;
  const absl::Status published = PublishFile(PartOf(upload.id), shelf_.FileOf(kept->facts.id));
  if (!published.ok()) return published;
  return std::move(kept->facts);
}

absl::StatusOr<MapImportProgress> MapTransfer::Import(const MapImportPiece& piece, Time now) {
  if (piece.data.empty() || piece.data.size() > kMostTaken) {
    return absl::InvalidArgumentError(
        absl::StrCat("data: ", piece.data.size(), " bytes; give 1 to ", kMostTaken));
  }
  if (piece.offset == 0) {
    if (const auto begun = Begin(piece, now); !begun.ok()) return begun.status();
  }
  const auto upload = std::find_if(uploads_.begin(), uploads_.end(),
                                   [&](const Upload& each) { return each.id == piece.upload_id; });
  if (upload == uploads_.end() || upload->received != piece.offset) {
    return Anew("this is not the piece that is next");
  }
  upload->touched = now;
  MapImportProgress progress;
  absl::Status status;
  if (piece.data.size() > upload->total - upload->received) {
    status = absl::InvalidArgumentError("data: is more than total_bytes said; begin anew");
  }
  if (status.ok()) status = Append(*upload, piece.data);
  progress.received = upload->received;
  if (status.ok() && upload->received < upload->total) return progress;
  if (status.ok()) {
    absl::StatusOr<KeptMapFacts> facts = Finish(*upload);
    status = facts.status();
    if (facts.ok()) progress.whole = *std::move(facts);
  }
  Forget(upload);
  if (!status.ok()) return status;
  return progress;
}

}  // namespace saccade
