#include "server/rpc/map_service.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

#include "server/rpc/deltas.hpp"
#include "server/rpc/early_handler.hpp"

namespace saccade {
namespace {

// Davison's colours: red measured, blue failed, yellow not attempted.
const char* ColourOf(FeatureState state) {
  switch (state) {
    case FeatureState::kMeasured:
      return "255 0 0";
    case FeatureState::kFailed:
      return "0 0 255";
    case FeatureState::kNotAttempted:
      return "255 255 0";
  }
  return "255 255 255";
}

std::string ToPly(const MapSnapshot& snapshot) {
  std::string ply = absl::StrCat(
      "ply\nformat ascii 1.0\ncomment saccade map, world frame, metres",
      snapshot.metric ? "" : " (scale arbitrary)", "\nelement vertex ", snapshot.features.size(),
      "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nproperty double sigma_m\nend_header\n");
  for (const FeatureSnapshot& feature : snapshot.features) {
    const Eigen::Vector3d& p = feature.point_in_world;
    const double sigma_m = std::sqrt(std::max(0.0, feature.covariance_in_world.trace()));
    absl::StrAppend(&ply, p.x(), " ", p.y(), " ", p.z(), " ", ColourOf(feature.state), " ", sigma_m,
                    "\n");
  }
  return ply;
}

void Fill(const KeptMapFacts& facts, v1::StoredMapFacts& out) {
  out.set_map_id(facts.id);
  out.set_name(facts.name);
  out.set_world_id(facts.world);
  out.set_saved_unix_s(facts.saved_unix_s);
  out.set_metric(facts.metric);
  out.set_landmark_count(facts.landmarks);
  out.set_place_count(facts.places);
  out.set_width(static_cast<std::uint32_t>(facts.width));
  out.set_height(static_cast<std::uint32_t>(facts.height));
  out.set_bytes(facts.bytes);
}

absl::Status NoMapYet() {
  return absl::FailedPreconditionError("no frame has been tracked yet: try again shortly");
}

}  // namespace

MapService::MapService(Backend& backend, StreamHub& hub, Gatekeeper& gate)
    : backend_(backend), hub_(hub), gate_(gate) {
  // By their numbers in the proto; limits_test calls every one.
  MarkMethodCallback(0, Early(gate, "MapService/Get", this, &MapService::Get));
  MarkMethodCallback(1, Early(gate, "MapService/Reset", this, &MapService::Reset));
  MarkMethodCallback(2, Early(gate, "MapService/Export", this, &MapService::Export));
  MarkMethodCallback(3, Early(gate, "MapService/Save", this, &MapService::Save));
  MarkMethodCallback(4, Early(gate, "MapService/Load", this, &MapService::Load));
  MarkMethodCallback(5, Early(gate, "MapService/List", this, &MapService::List));
  MarkMethodCallback(6, Early(gate, "MapService/Delete", this, &MapService::Delete));
  MarkMethodCallback(7, Early(gate, "MapService/ExportFile", this, &MapService::ExportFile));
  MarkMethodCallback(8, Early(gate, "MapService/ImportFile", this, &MapService::ImportFile));
}

grpc::ServerUnaryReactor* MapService::Get(grpc::CallbackServerContext* context,
                                          const v1::GetMapRequest* /*request*/,
                                          v1::GetMapResponse* response) {
  UnaryCall call(*context, "MapService/Get", UnaryCall::Log::kNothing);
  if (const auto access = call.Enter(gate_, Toll::kRead); !access.ok()) {
    return call.Finish(access.status());
  }
  const std::optional<TrackedEvent> newest = hub_.newest();
  if (!newest) return call.Finish(NoMapYet());
  *response->mutable_map() = FullMap(*newest->snapshot);
  response->set_metric(newest->snapshot->metric);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* MapService::Reset(grpc::CallbackServerContext* context,
                                            const v1::ResetMapRequest* request,
                                            v1::ResetMapResponse* response) {
  UnaryCall call(*context, "MapService/Reset", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kReset, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  const auto fill = [response](std::uint64_t generation) {
    response->set_map_generation(generation);
  };
  return call.Submitted(backend_.Submit(ResetMap{call.Answer<std::uint64_t>(fill)}));
}

grpc::ServerUnaryReactor* MapService::Export(grpc::CallbackServerContext* context,
                                             const v1::ExportMapRequest* request,
                                             v1::ExportMapResponse* response) {
  UnaryCall call(*context, "MapService/Export", UnaryCall::Log::kNothing);
  const std::optional<TrackedEvent> newest = hub_.newest();
  absl::Status status = call.Enter(gate_, Toll::kRead).status();
  if (status.ok() && !newest) status = NoMapYet();
  if (request->format() != v1::ExportMapRequest::FORMAT_PLY &&
      request->format() != v1::ExportMapRequest::FORMAT_UNSPECIFIED) {
    status = absl::InvalidArgumentError(
        absl::StrCat("format: unknown format ", static_cast<int>(request->format())));
  }
  if (status.ok()) {
    response->set_data(ToPly(*newest->snapshot));
    response->set_feature_count(static_cast<std::uint32_t>(newest->snapshot->features.size()));
  }
  return call.Finish(status);
}

grpc::ServerUnaryReactor* MapService::Save(grpc::CallbackServerContext* context,
                                           const v1::SaveMapRequest* request,
                                           v1::SaveMapResponse* response) {
  UnaryCall call(*context, "MapService/Save", UnaryCall::Log::kAll);
  const absl::StatusOr<KeptMaps*> maps = Enter(call, Toll::kReset);
  if (!maps.ok()) return call.Finish(maps.status());
  (*maps)->Save(request->name(), call.Answer<std::string>([response](const std::string& id) {
    response->set_map_id(id);
  }));
  return call.reactor();
}

grpc::ServerUnaryReactor* MapService::Load(grpc::CallbackServerContext* context,
                                           const v1::LoadMapRequest* request,
                                           v1::LoadMapResponse* /*response*/) {
  UnaryCall call(*context, "MapService/Load", UnaryCall::Log::kAll);
  const absl::StatusOr<KeptMaps*> maps = Enter(call, Toll::kReset);
  if (!maps.ok()) return call.Finish(maps.status());
  (*maps)->Load(request->map_id(), call.Answer());
  return call.reactor();
}

grpc::ServerUnaryReactor* MapService::List(grpc::CallbackServerContext* context,
                                           const v1::ListMapsRequest* /*request*/,
                                           v1::ListMapsResponse* response) {
  UnaryCall call(*context, "MapService/List", UnaryCall::Log::kNothing);
  const absl::StatusOr<KeptMaps*> maps = Enter(call, Toll::kRead);
  if (!maps.ok()) return call.Finish(maps.status());
  (*maps)->List(
      call.Answer<std::vector<KeptMapFacts>>([response](const std::vector<KeptMapFacts>& all) {
        for (const KeptMapFacts& facts : all) {
          response->add_map_ids(facts.id);
          Fill(facts, *response->add_maps());
        }
      }));
  return call.reactor();
}

grpc::ServerUnaryReactor* MapService::Delete(grpc::CallbackServerContext* context,
                                             const v1::DeleteMapRequest* request,
                                             v1::DeleteMapResponse* /*response*/) {
  UnaryCall call(*context, "MapService/Delete", UnaryCall::Log::kAll);
  const absl::StatusOr<KeptMaps*> maps = Enter(call, Toll::kReset);
  if (!maps.ok()) return call.Finish(maps.status());
  (*maps)->Remove(request->map_id(), call.Answer());
  return call.reactor();
}

grpc::ServerUnaryReactor* MapService::ExportFile(grpc::CallbackServerContext* context,
                                                 const v1::ExportMapFileRequest* request,
                                                 v1::ExportMapFileResponse* response) {
  const bool first = request->offset_bytes() == 0;  // reads it all
  UnaryCall call(*context, "MapService/ExportFile",
                 first ? UnaryCall::Log::kAll : UnaryCall::Log::kRefusals);
  const absl::StatusOr<KeptMaps*> maps = Enter(call, first ? Toll::kReset : Toll::kRead);
  if (!maps.ok()) return call.Finish(maps.status());
  (*maps)->ReadFile({request->map_id(), request->offset_bytes(), request->file_crc32()},
                    call.Answer<MapFilePiece>([response](const MapFilePiece& piece) {
                      response->set_total_bytes(piece.total);
                      response->set_file_crc32(piece.checksum);
                      response->set_data(piece.data);
                    }));
  return call.reactor();
}

grpc::ServerUnaryReactor* MapService::ImportFile(grpc::CallbackServerContext* context,
                                                 const v1::ImportMapFileRequest* request,
                                                 v1::ImportMapFileResponse* response) {
  const bool first = request->offset_bytes() == 0;
  UnaryCall call(*context, "MapService/ImportFile",
                 first ? UnaryCall::Log::kAll : UnaryCall::Log::kRefusals);
  const absl::StatusOr<KeptMaps*> maps = Enter(call, first ? Toll::kReset : Toll::kEdit);
  if (!maps.ok()) return call.Finish(maps.status());
  (*maps)->Import({request->upload_id(), request->total_bytes(), request->offset_bytes(),
                   request->file_crc32(), request->data()},
                  call.Answer<MapImportProgress>([response](const MapImportProgress& progress) {
                    response->set_received_bytes(progress.received);
                    if (progress.whole) Fill(*progress.whole, *response->mutable_map());
                  }));
  return call.reactor();
}

absl::StatusOr<KeptMaps*> MapService::Enter(UnaryCall& call, Toll toll) {
  if (const auto access = call.Enter(gate_, toll); !access.ok()) return access.status();
  if (KeptMaps* maps = backend_.maps()) return maps;
  return absl::FailedPreconditionError(
      "maps: this server keeps none: start it with --data-dir and without --map none");
}

}  // namespace saccade
