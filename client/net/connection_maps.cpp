// Maps that outlive a run of the server.
#include "client/net/connection.hpp"
#include "client/net/connection_impl.hpp"

namespace saccade::net {

absl::StatusOr<std::vector<StoredMapFacts>> Connection::ListMaps() {
  const auto response =
      impl_->Call(*impl_->map_, &v1::MapService::Stub::List, v1::ListMapsRequest());
  if (!response.ok()) return response.status();
  std::vector<StoredMapFacts> all;
  for (const v1::StoredMapFacts& map : response->maps()) {
    all.push_back({map.map_id(), map.name(), map.world_id(), map.saved_unix_s(), map.metric(),
                   map.landmark_count(), map.place_count(), map.width(), map.height(),
                   map.bytes()});
  }
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

}  // namespace saccade::net
