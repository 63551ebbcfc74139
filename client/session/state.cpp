#include "client/session/state.hpp"

#include <type_traits>
#include <utility>
#include <variant>

namespace saccade::session {
namespace {

constexpr double kPathSpacingM = 0.005;
constexpr std::size_t kMaxPath = 4000;

}  // namespace

void State::Begin(const std::string& id, const net::Joined& told) {
  const bool goes_on = session_id == id;
  session_id = id;
  joined = told;
  source_ended = false;
  gaze.reset();
  pointers.Clear();
  if (goes_on) return;
  clock.Reset();
  path.clear();
  ++path_version;
}

void State::Apply(const net::StreamEvent& event, Timestamp now_ns) {
  heard_ns = now_ns;
  link = {Link::Kind::kLive, "", 0};
  std::visit(
      [&](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, MapSnapshot>) {
          Take(value, now_ns);
        } else if constexpr (std::is_same_v<T, net::MapChange>) {
          Take(value);
        } else if constexpr (std::is_same_v<T, net::AnnotationChange>) {
          annotations.Apply(value);
        } else if constexpr (std::is_same_v<T, GazeSnapshot>) {
          gaze = value;
        } else if constexpr (std::is_same_v<T, net::Statistics>) {
          statistics = value;
        } else if constexpr (std::is_same_v<T, net::Presence>) {
          participants = value.participants;
          listeners = value.listeners;
        } else if constexpr (std::is_same_v<T, std::vector<net::PointerNews>>) {
          pointers.Apply(value, joined.participant_id, now_ns);
        } else if constexpr (std::is_same_v<T, std::vector<net::ChatMessage>>) {
          chat.Add(value);
        } else if constexpr (std::is_same_v<T, net::PicturePause>) {
          pause = value.paused ? std::optional(value) : std::nullopt;
        } else if constexpr (std::is_same_v<T, net::SceneChange>) {
          scene.Apply(value);
        } else if constexpr (std::is_same_v<T, net::SourceEnd>) {
          source_ended = true;
        }
      },
      event);
}

void State::Take(const MapSnapshot& told, Timestamp now_ns) {
  if (pose && told.map_revision != pose->map_revision) path.clear(), ++path_version;
  pose = told;
  pose_ns = now_ns;
  if (!IsPlaced(pose)) return;
  const Eigen::Vector3d& at = told.world_from_camera.translation;
  if (!path.empty() && (path.back() - at).norm() < kPathSpacingM) return;
  path.push_back(at);
  if (path.size() > kMaxPath) path.erase(path.begin(), path.begin() + kMaxPath / 2);
  ++path_version;
}

void State::Take(const net::MapChange& change) {
  if (change.full || change.generation != map_generation) features.clear();
  map_generation = change.generation;
  map_revision = change.revision;
  for (const FeatureSnapshot& feature : change.upserted) features[feature.id] = feature;
  for (const FeatureId id : change.removed_ids) features.erase(id);
  ++map_version;
}

std::optional<Timestamp> State::Age(Timestamp now_ns) const {
  if (link.live() || heard_ns == 0) return std::nullopt;
  return now_ns - heard_ns;
}

}  // namespace saccade::session
