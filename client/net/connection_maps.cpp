// Maps that outlive a run of the server.
#include <zlib.h>

#include "client/net/connection.hpp"
#include "client/net/connection_impl.hpp"

namespace saccade::net {
namespace {

constexpr std::size_t kPiece = 200 * 1024;

std::uint32_t Checksum(const std::string& file) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(file.data()), file.size()));
}

StoredMapFacts FactsOf(const v1::StoredMapFacts& map) {
  return {map.map_id(),         map.name(),        map.world_id(), map.saved_unix_s(), map.metric(),
          map.landmark_count(), map.place_count(), map.width(),    map.height(),       map.bytes()};
}

}  // namespace

absl::StatusOr<std::vector<StoredMapFacts>> Connection::ListMaps() {
  const auto response =
      impl_->Call(*impl_->map_, &v1::MapService::Stub::List, v1::ListMapsRequest());
  if (!response.ok()) return response.status();
  std::vector<StoredMapFacts> all;
  for (const v1::StoredMapFacts& map : response->maps()) all.push_back(FactsOf(map));
  return all;
}

absl::StatusOr<std::string> Connection::SaveMap(const std::string& name) {
  v1::SaveMapRequest request;
  request.set_name(name);
  const auto response = impl_->Call(*impl_->map_, &v1::MapService::Stub::Save, request);
  if (!response.ok()) return response.status();
  return response->map_id();
}

absl::Status Connection::LoadMap(const std::string& id) {
  v1::LoadMapRequest request;
  request.set_map_id(id);
  return impl_->Call(*impl_->map_, &v1::MapService::Stub::Load, request).status();
}

absl::Status Connection::DeleteMap(const std::string& id) {
  v1::DeleteMapRequest request;
  request.set_map_id(id);
  return impl_->Call(*impl_->map_, &v1::MapService::Stub::Delete, request).status();
}

absl::StatusOr<std::string> Connection::ExportMapFile(const std::string& id) {
  v1::ExportMapFileRequest request;
  request.set_map_id(id);
  std::string file;
  for (;;) {
    const auto piece = impl_->Call(*impl_->map_, &v1::MapService::Stub::ExportFile, request);
    if (!piece.ok()) return piece.status();
    file += piece->data();
    if (file.size() < piece->total_bytes() && !piece->data().empty()) {
      request.set_offset_bytes(file.size());
      request.set_file_crc32(piece->file_crc32());
      continue;
    }
    if (file.size() == piece->total_bytes() && Checksum(file) == piece->file_crc32()) return file;
    return absl::DataLossError("the map did not come whole: try again");
  }
}

absl::StatusOr<StoredMapFacts> Connection::ImportMapFile(const std::string& file) {
  if (file.empty()) return absl::InvalidArgumentError("the file is empty");
  v1::ImportMapFileRequest request;
  request.set_upload_id(RandomUuid());
  request.set_total_bytes(file.size());
  request.set_file_crc32(Checksum(file));
  for (std::size_t offset = 0; offset < file.size(); offset += kPiece) {
    request.set_offset_bytes(offset);
    request.set_data(file.substr(offset, kPiece));
    const auto answer = impl_->Call(*impl_->map_, &v1::MapService::Stub::ImportFile, request);
    if (!answer.ok()) return answer.status();
    if (answer->has_map()) return FactsOf(answer->map());
  }
  return absl::InternalError("the server took the whole file and said nothing of it");
}

}  // namespace saccade::net
