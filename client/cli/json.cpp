#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include "client/cli/text.hpp"

namespace saccade::cli {
namespace {

using nlohmann::json;

json Numbers(const Eigen::VectorXd& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

json Upper(const Eigen::MatrixXd& symmetric) {
  json upper = json::array();
  for (int row = 0; row < symmetric.rows(); ++row) {
    for (int column = row; column < symmetric.cols(); ++column) {
      upper.push_back(symmetric(row, column));
    }
  }
  return upper;
}

// A number where each reader takes it for the same one.
json Whole(std::uint64_t value) {
  constexpr std::uint64_t kExact = std::uint64_t{1} << 53;
  return value <= kExact ? json(value) : json(absl::StrCat(value));
}
json Nanoseconds(std::int64_t value) { return absl::StrCat(value); }

json ToJson(const std::vector<net::Participant>& participants) {
  json list = json::array();
  for (const net::Participant& participant : participants) {
    list.push_back({{"participant_id", participant.participant_id},
                    {"display_name", participant.display_name},
                    {"role", Word(participant.role)}});
  }
  return list;
}

json ToJson(const Anchor& anchor, bool metric) {
  json out = {{"state", Word(anchor.state)}, {"method", Word(anchor.method)},
              {"point_in_world_m", nullptr}, {"covariance_in_world_m2_upper", nullptr},
              {"error_mm", nullptr},         {"metric", metric},
              {"reason", anchor.reason}};
  if (anchor.place_known) {  // else they are of another map
    out["point_in_world_m"] = Numbers(anchor.point_in_world);
    out["covariance_in_world_m2_upper"] = Upper(anchor.covariance_in_world);
    if (metric) out["error_mm"] = 1e3 * anchor.error_m;
  }
  out["error_px"] = anchor.error_px ? json(*anchor.error_px) : json(nullptr);
  out["pixel"] = anchor.pixel ? Numbers(*anchor.pixel) : json(nullptr);
  return out;
}

json ToJson(const net::AnnotationChange& change, bool metric) {
  json anchors = json::array();
  for (const net::AnchorUpdate& update : change.anchors) {
    anchors.push_back({{"id", update.id}, {"anchor", ToJson(update.anchor, metric)}});
  }
  return {{"full", change.full},
          {"upserted", cli::ToJson(change.upserted, metric)},
          {"removed_ids", change.removed_ids},
          {"anchors", std::move(anchors)}};
}

}  // namespace

json ToJson(const MapSnapshot& pose) {
  const Eigen::Quaterniond& q = pose.world_from_camera.rotation;
  return {{"frame_id", Whole(pose.frame_id)},
          {"capture_time_ns", Nanoseconds(pose.capture_time_ns)},
          {"status", Word(pose.status)},
          {"quality", Word(pose.quality)},
          {"advice", pose.advice},
          {"metric", pose.metric},
          {"world_from_camera",
           {{"translation_m", Numbers(pose.world_from_camera.translation)},
            {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}}},
          {"covariance_upper", Upper(pose.pose_covariance)},
          {"features_attempted", pose.attempted},
          {"features_matched", pose.matched},
          {"map_revision", Whole(pose.map_revision)}};
}

json ToJson(const net::Statistics& s) {
  return {{"captured_fps_hz", s.captured_fps_hz},
          {"tracked_fps_hz", s.tracked_fps_hz},
          {"encoded_fps_hz", s.encoded_fps_hz},
          {"frames_dropped", Whole(s.frames_dropped)},
          {"bad_frames", Whole(s.bad_frames)},
          {"events_skipped", Whole(s.events_skipped)},
          {"video_bit_rate_bit_s", s.video_bit_rate_bit_s},
          {"track_ms", {{"p50", s.track_ms_p50}, {"p95", s.track_ms_p95}}},
          {"encode_ms", {{"p50", s.encode_ms_p50}, {"p95", s.encode_ms_p95}}}};
}

json ToJson(const net::ServerStatus& status) {
  return {{"source", status.source},
          {"source_ended", status.source_ended},
          {"picture_pause",
           {{"paused", status.picture_pause.paused},
            {"by", status.picture_pause.by},
            {"since_unix_ns", std::to_string(status.picture_pause.since_unix_ns)}}},
          {"server_version", status.server_version},
          {"uptime_s", status.uptime_s},
          {"pose", ToJson(status.pose)},
          {"map_features", status.map_features},
          {"annotations", status.annotations},
          {"statistics", ToJson(status.statistics)},
          {"participants", ToJson(status.participants)}};
}

json ToJson(const net::MapState& map) {
  json features = json::array();
  for (const FeatureSnapshot& feature : map.features) {
    features.push_back({{"id", Whole(feature.id)},
                        {"state", Word(feature.state)},
                        {"point_in_world_m", Numbers(feature.point_in_world)},
                        {"covariance_in_world_m2_upper", Upper(feature.covariance_in_world)},
                        {"depth_known", feature.depth_known},
                        {"matched_count", feature.matched_count}});
    features.back()["pixel"] = feature.pixel ? Numbers(*feature.pixel) : json(nullptr);
  }
  return {{"map_generation", Whole(map.generation)},
          {"map_revision", Whole(map.revision)},
          {"frame_id", Whole(map.frame_id)},
          {"metric", map.metric},
          {"complete", map.complete},
          {"features", std::move(features)}};
}

json ToJson(const Annotation& annotation, bool metric) {
  json out = {{"id", annotation.id},
              {"shape", Word(annotation.shape)},
              {"text", annotation.text},
              {"author", annotation.author},
              {"size_m", annotation.size_m},
              {"color_rgba", absl::StrFormat("%08x", annotation.color_rgba)},
              {"created_unix_ns", Nanoseconds(annotation.created_unix_ns)},
              {"revision", Whole(annotation.revision)},
              {"anchor", ToJson(annotation.anchor, metric)},
              {"author_person_id", annotation.author_person_id},
              {"locked", annotation.locked}};
  if (annotation.number > 0) out["number"] = annotation.number;
  if (annotation.shape == AnnotationShape::kBox) out["extent_m"] = Numbers(annotation.extent_m);
  if (const auto& q = annotation.world_from_mark) {
    out["world_from_mark_xyzw"] = {q->x(), q->y(), q->z(), q->w()};
  }
  if (annotation.shape == AnnotationShape::kMeasure) {
    out["offset_m"] = Numbers(annotation.ink_offset_m[0]);
    out["length_m"] = annotation.length_m;
    out["length_sigma_m"] = annotation.length_sigma_m;
  }
  if (annotation.picture) {
    out["picture"] = {{"sha256", annotation.picture->sha256},
                      {"media_type", annotation.picture->media_type},
                      {"width", annotation.picture->width},
                      {"height", annotation.picture->height}};
  }
  if (annotation.check_items) {
    json items = json::array();
    for (const CheckItem& item : *annotation.check_items) {
      items.push_back({{"text", item.text},
                       {"done", item.done},
                       {"done_by", item.done_by},
                       {"done_unix_ns", Nanoseconds(item.done_unix_ns)}});
    }
    out["check_items"] = std::move(items);
  }
  return out;
}

json ToJson(const std::vector<Annotation>& annotations, bool metric) {
  json list = json::array();
  for (const Annotation& annotation : annotations) list.push_back(ToJson(annotation, metric));
  return list;
}

json ToJson(const GazeSnapshot& state) {
  const auto pilot_name = [](const GazePilot& pilot) { return json(pilot.display_name); };
  json queue = json::array();
  for (const GazePilot& waiting : state.queue) queue.push_back(pilot_name(waiting));
  json result = {{"mode", ToString(state.mode)},
                 {"arrived", state.arrived},
                 {"target_lost", state.target_lost},
                 {"reachable", state.reachable},
                 {"miss_rad", state.miss_rad},
                 {"fast", state.fast},
                 {"problem", state.problem},
                 {"pilot", state.pilot ? pilot_name(*state.pilot) : json()},
                 {"queue", queue},
                 {"paused", state.paused},
                 {"handovers", Whole(state.handovers)},
                 {"last_handover", state.last_handover},
                 {"error_rad", state.error_rad ? json(*state.error_rad) : json()},
                 {"joints_rad", state.joints_rad ? Numbers(*state.joints_rad) : json()}};
  result["target_in_world_m"] = state.target_in_world ? Numbers(*state.target_in_world) : json();
  return result;
}

json ToJson(const net::WatchEvent& event, bool metric) {
  if (const auto* pose = std::get_if<MapSnapshot>(&event)) return {{"pose", ToJson(*pose)}};
  if (const auto* change = std::get_if<net::AnnotationChange>(&event)) {
    return {{"annotation", ToJson(*change, metric)}};
  }
  if (const auto* statistics = std::get_if<net::Statistics>(&event)) {
    return {{"statistics", ToJson(*statistics)}};
  }
  if (const auto* people = std::get_if<std::vector<net::Participant>>(&event)) {
    return {{"presence", ToJson(*people)}};
  }
  return {{"end_of_source", {{"frames", Whole(std::get<net::SourceEnd>(event).frames)}}}};
}

std::string Dump(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, json::error_handler_t::replace);
}

}  // namespace saccade::cli
