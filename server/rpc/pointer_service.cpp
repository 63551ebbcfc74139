#include "server/rpc/pointer_service.hpp"

#include <absl/strings/str_cat.h>

#include <optional>
#include <utility>
#include <vector>

#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/scene/limits.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

constexpr char kPoint[] = "PointerService/Point";

absl::StatusOr<std::vector<AnnotationTarget>> TargetsOf(const v1::PointRequest& request,
                                                        const wire::ImageSize& image) {
  std::vector<AnnotationTarget> targets;
  for (int i = 0; i < request.points_size(); ++i) {
    const std::string field = absl::StrCat("points[", i, "]");
    if (request.points(i).has_feature_id()) {
      return absl::InvalidArgumentError(
          absl::StrCat(field, ".feature_id: give frame_pixel, ray or point_in_world_m"));
    }
    absl::StatusOr<AnnotationTarget> target = wire::FromProto(request.points(i), image, field);
    if (!target.ok()) return target.status();
    targets.push_back(*std::move(target));
  }
  return targets;
}

absl::StatusOr<PointerWord> WordOf(const v1::PointRequest& request) {
  PointerWord word;
  switch (request.kind()) {
    case v1::POINTER_KIND_LASER:
      word.kind = PointerKind::kLaser;
      break;
    case v1::POINTER_KIND_SKETCH:
      word.kind = PointerKind::kSketch;
      break;
    default:
      return absl::InvalidArgumentError(absl::StrCat(
          "kind: unknown kind ", static_cast<int>(request.kind()), ": use LASER or SKETCH"));
  }
  if (absl::Status uuid = wire::CheckUuid(request.stroke_id(), "stroke_id"); !uuid.ok()) {
    return uuid;
  }
  word.stroke_id = request.stroke_id();
  word.released = request.released();
  if (static_cast<std::size_t>(request.points_size()) > kMaxPointerPoints) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: at most ", kMaxPointerPoints, ", not ", request.points_size()));
  }
  if (request.points().empty() && !word.released) {
    return absl::InvalidArgumentError("points: give at least one, or released");
  }
  return word;
}

}  // namespace

PointerService::PointerService(Backend& backend, PointerBoard& board, Gatekeeper& gate)
    : backend_(backend), board_(board), gate_(gate) {
  MarkMethodCallback(0, Early(gate, kPoint, this, &PointerService::Point));
}

absl::Status PointerService::Say(const v1::PointRequest& request, const Session& session) {
  absl::StatusOr<PointerWord> word = WordOf(request);
  if (!word.ok()) return word.status();
  const CameraModel& camera = *backend_.facts().camera;
  const absl::StatusOr<std::vector<AnnotationTarget>> targets =
      TargetsOf(request, {camera.width(), camera.height()});
  if (!targets.ok()) return targets.status();
  word->color_rgba = request.color_rgba() == 0 ? session.color_rgba : request.color_rgba();
  if (!targets->empty()) {
    absl::StatusOr<std::vector<Eigen::Vector3d>> points;
    if (word->kind == PointerKind::kLaser) {  // what came before its newest point is over
      points = backend_.LocatePointer({&targets->back(), 1}, nullptr);
    } else {
      word->surface = board_.SurfaceOf(session, word->stroke_id);
      points = backend_.LocatePointer(*targets, &word->surface);
    }
    if (!points.ok()) return points.status();
    word->points = *std::move(points);
  }
  return board_.Say(session, *std::move(word));
}

grpc::ServerUnaryReactor* PointerService::Point(grpc::CallbackServerContext* context,
                                                const v1::PointRequest* request,
                                                v1::PointResponse* /*response*/) {
  UnaryCall call(*context, kPoint, UnaryCall::Log::kNothing);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kPoint, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  return call.Finish(Say(*request, *session));
}

}  // namespace saccade
