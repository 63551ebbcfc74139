#include "client/cli/text.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>

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

json ToJson(const std::vector<net::Participant>& participants) {
  json list = json::array();
  for (const net::Participant& participant : participants) {
    list.push_back({{"participant_id", participant.participant_id},
                    {"display_name", participant.display_name},
                    {"role", Word(participant.role)}});
  }
  return list;
}

// Bytes above 127 in UTF-8 take one column per character.
std::size_t Width(absl::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

}  // namespace

absl::string_view Word(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kInitialising:
      return "initialising";
    case TrackingStatus::kTracking:
      return "tracking";
    case TrackingStatus::kCoasting:
      return "coasting";
    case TrackingStatus::kLost:
      return "lost";
    case TrackingStatus::kRelocalising:
      return "relocalising";
  }
  return "unknown";
}

absl::string_view Word(TrackingQuality quality) {
  switch (quality) {
    case TrackingQuality::kBad:
      return "bad";
    case TrackingQuality::kPoor:
      return "poor";
    case TrackingQuality::kGood:
      return "good";
    case TrackingQuality::kUnknown:
      break;
  }
  return "unknown";
}

absl::string_view Word(FeatureState state) {
  switch (state) {
    case FeatureState::kNotAttempted:
      return "not_attempted";
    case FeatureState::kMeasured:
      return "measured";
    case FeatureState::kFailed:
      return "failed";
  }
  return "unknown";
}

absl::string_view Word(AnnotationShape shape) {
  switch (shape) {
    case AnnotationShape::kCube:
      return "cube";
    case AnnotationShape::kNote:
      return "note";
    case AnnotationShape::kArrow:
      return "arrow";
    case AnnotationShape::kInk:
      return "ink";
  }
  return "unknown";
}

absl::string_view Word(AnchorState state) {
  switch (state) {
    case AnchorState::kProvisional:
      return "provisional";
    case AnchorState::kTracking:
      return "tracking";
    case AnchorState::kPaused:
      return "paused";
    case AnchorState::kStopped:
      return "stopped";
  }
  return "unknown";
}

absl::string_view Word(AnchorMethod method) {
  switch (method) {
    case AnchorMethod::kScene:
      return "scene";
    case AnchorMethod::kFeature:
      return "feature";
    case AnchorMethod::kPlane:
      return "plane";
    case AnchorMethod::kMedianDepth:
      return "median_depth";
    case AnchorMethod::kPoint:
      return "point";
  }
  return "unknown";
}

absl::string_view Word(net::Role role) {
  switch (role) {
    case net::Role::kExpert:
      return "expert";
    case net::Role::kWearer:
      return "wearer";
    case net::Role::kViewer:
      return "viewer";
  }
  return "unknown";
}

json ToJson(const MapSnapshot& pose) {
  const Eigen::Quaterniond& q = pose.world_from_camera.rotation;
  return {{"frame_id", pose.frame_id},
          {"capture_time_ns", pose.capture_time_ns},
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
          {"map_revision", pose.map_revision}};
}

json ToJson(const net::Statistics& s) {
  return {{"captured_fps_hz", s.captured_fps_hz},
          {"tracked_fps_hz", s.tracked_fps_hz},
          {"encoded_fps_hz", s.encoded_fps_hz},
          {"frames_dropped", s.frames_dropped},
          {"bad_frames", s.bad_frames},
          {"events_skipped", s.events_skipped},
          {"video_bit_rate_bit_s", s.video_bit_rate_bit_s},
          {"track_ms", {{"p50", s.track_ms_p50}, {"p95", s.track_ms_p95}}},
          {"encode_ms", {{"p50", s.encode_ms_p50}, {"p95", s.encode_ms_p95}}}};
}

json ToJson(const net::ServerStatus& status) {
  return {{"source", status.source},
          {"source_ended", status.source_ended},
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
    features.push_back({{"id", feature.id},
                        {"state", Word(feature.state)},
                        {"point_in_world_m", Numbers(feature.point_in_world)},
                        {"covariance_in_world_m2_upper", Upper(feature.covariance_in_world)},
                        {"depth_known", feature.depth_known},
                        {"matched_count", feature.matched_count}});
    features.back()["pixel"] = feature.pixel ? Numbers(*feature.pixel) : json(nullptr);
  }
  return {{"map_generation", map.generation},
          {"map_revision", map.revision},
          {"frame_id", map.frame_id},
          {"metric", map.metric},
          {"features", std::move(features)}};
}

json ToJson(const Annotation& annotation) {
  const Anchor& anchor = annotation.anchor;
  json out = {{"id", annotation.id},
              {"shape", Word(annotation.shape)},
              {"text", annotation.text},
              {"author", annotation.author},
              {"size_m", annotation.size_m},
              {"color_rgba", absl::StrFormat("%08x", annotation.color_rgba)},
              {"created_unix_ns", annotation.created_unix_ns},
              {"revision", annotation.revision},
              {"anchor",
               {{"state", Word(anchor.state)},
                {"method", Word(anchor.method)},
                {"point_in_world_m", nullptr},
                {"covariance_in_world_m2_upper", nullptr},
                {"error_mm", nullptr},
                {"reason", anchor.reason}}}};
  if (anchor.place_known) {  // else they are of another map
    out["anchor"]["point_in_world_m"] = Numbers(anchor.point_in_world);
    out["anchor"]["covariance_in_world_m2_upper"] = Upper(anchor.covariance_in_world);
    out["anchor"]["error_mm"] = 1e3 * anchor.error_m;
  }
  out["anchor"]["error_px"] = anchor.error_px ? json(*anchor.error_px) : json(nullptr);
  out["anchor"]["pixel"] = anchor.pixel ? Numbers(*anchor.pixel) : json(nullptr);
  return out;
}

json ToJson(const std::vector<Annotation>& annotations) {
  json list = json::array();
  for (const Annotation& annotation : annotations) list.push_back(ToJson(annotation));
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
                 {"handovers", state.handovers},
                 {"last_handover", state.last_handover},
                 {"error_rad", state.error_rad ? json(*state.error_rad) : json()},
                 {"joints_rad", state.joints_rad ? Numbers(*state.joints_rad) : json()}};
  result["target_in_world_m"] = state.target_in_world ? Numbers(*state.target_in_world) : json();
  return result;
}

json ToJson(const net::WatchEvent& event) {
  if (const auto* pose = std::get_if<MapSnapshot>(&event)) return {{"pose", ToJson(*pose)}};
  if (const auto* change = std::get_if<net::AnnotationChange>(&event)) {
    return {{"annotation",
             {{"full", change->full},
              {"upserted", ToJson(change->upserted)},
              {"removed_ids", change->removed_ids}}}};
  }
  if (const auto* statistics = std::get_if<net::Statistics>(&event)) {
    return {{"statistics", ToJson(*statistics)}};
  }
  if (const auto* people = std::get_if<std::vector<net::Participant>>(&event)) {
    return {{"presence", ToJson(*people)}};
  }
  return {{"end_of_source", {{"frames", std::get<net::SourceEnd>(event).frames}}}};
}

std::string PointText(const Eigen::Vector3d& point, bool metric) {
  return absl::StrFormat("x %.3f y %.3f z %.3f%s", point.x(), point.y(), point.z(),
                         metric ? " m" : "");
}

std::string PlaceText(const Anchor& anchor) {
  return anchor.place_known ? PointText(anchor.point_in_world, false) : "place not known";
}

std::string ErrorText(const Anchor& anchor) {
  if (!anchor.place_known) return "place not known";
  const std::string mm = absl::StrFormat("%.0f mm", 1e3 * anchor.error_m);
  if (!anchor.error_px) return absl::StrCat("out of view ", mm);
  return absl::StrFormat("%.1f px %s", *anchor.error_px, mm);
}

std::string Table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], Width(row[i]));
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      absl::StrAppend(&line, row[i], std::string(widths[i] - Width(row[i]) + 2, ' '));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    absl::StrAppend(&out, line, "\n");
  }
  return out;
}

}  // namespace saccade::cli
