#include "server/record/recording_reader.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "saccade/v1/map.pb.h"
#include "saccade/v1/tracking.pb.h"
#include "server/record/replayed_state.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

// Before a moment, the whole state is at most so far away; else farther back, each time twice.
constexpr Timestamp kLookBack_ns = 12'000'000'000;
constexpr char kPoseTopic[] = "/saccade/pose", kMapTopic[] = "/saccade/map",
               kSurfaceTopic[] = "/saccade/surface", kMarksTopic[] = "/saccade/annotations";

absl::Status NotOurs(absl::string_view topic) {
  return absl::DataLossError(absl::StrCat(topic, ": a message is not as this version writes it"));
}

template <typename Message>
bool Parse(const McapReader::Message& from, Message& message) {
  return message.ParseFromArray(from.data.data(), static_cast<int>(from.data.size()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<RecordingReader>> RecordingReader::Open(
    const std::filesystem::path& file) {
  absl::StatusOr<std::unique_ptr<McapReader>> mcap = McapReader::Open(file);
  if (!mcap.ok()) return mcap.status();
  return std::unique_ptr<RecordingReader>(new RecordingReader(*std::move(mcap)));
}

absl::StatusOr<std::vector<RecordedPose>> RecordingReader::Poses() {
  std::vector<RecordedPose> poses;
  absl::Status bad;
  const auto take = [&](const McapReader::Message& from) {
    if (from.topic != kPoseTopic || !bad.ok()) return;
    v1::PoseEvent pose;
    if (!Parse(from, pose)) {
      bad = NotOurs(kPoseTopic);
      return;
    }
    if (pose.status() != v1::TRACKING_STATUS_TRACKING &&
        pose.status() != v1::TRACKING_STATUS_COASTING) {
      return;
    }
    const auto placed = wire::FromProto(pose.world_from_camera(), "world_from_camera");
    if (!placed.ok()) {
      bad = NotOurs(kPoseTopic);
    } else {
      poses.push_back({from.time_ns, *placed});
    }
  };
  const absl::Status read = mcap_->Read(mcap_->first_ns(), mcap_->last_ns(), take);
  if (!read.ok()) return read;
  if (!bad.ok()) return bad;
  std::sort(poses.begin(), poses.end(),
            [](const RecordedPose& a, const RecordedPose& b) { return a.unix_ns < b.unix_ns; });
  poses.erase(std::unique(poses.begin(), poses.end(),
                          [](const RecordedPose& a, const RecordedPose& b) {
                            return a.unix_ns == b.unix_ns;
                          }),
              poses.end());
  return poses;
}

absl::StatusOr<RecordedMap> RecordingReader::MapAt(Timestamp unix_ns) {
  std::map<FeatureId, FeatureSnapshot> features;
  RecordedMap map;
  bool whole = false;
  absl::Status bad;
  const auto take = [&](const McapReader::Message& from) {
    if (!bad.ok()) return;
    if (from.topic == kPoseTopic) {
      v1::PoseEvent pose;
      if (Parse(from, pose)) map.metric = pose.metric();
    }
    if (from.topic != kMapTopic) return;
    v1::MapDelta delta;
    if (!Parse(from, delta)) {
      bad = NotOurs(kMapTopic);
      return;
    }
    if (delta.full()) features.clear();
    whole = whole || delta.full();
    for (const v1::Feature& message : delta.upserted()) {
      absl::StatusOr<FeatureSnapshot> feature = wire::FromProto(message, "upserted");
      if (!feature.ok()) bad = NotOurs(kMapTopic);
      if (feature.ok()) features[feature->id] = *std::move(feature);
    }
    for (const std::uint64_t id : delta.removed_ids()) features.erase(id);
  };
  for (Timestamp back_ns = kLookBack_ns; !whole; back_ns *= 2) {
    features.clear();
    const Timestamp from_ns = std::max(mcap_->first_ns(), unix_ns - back_ns);
    if (absl::Status read = mcap_->Read(from_ns, unix_ns, take); !read.ok()) return read;
    if (!bad.ok()) return bad;
    if (from_ns == mcap_->first_ns()) break;
  }
  for (auto& [id, feature] : features) map.features.push_back(std::move(feature));
  return map;
}

absl::StatusOr<RecordedScene> RecordingReader::SceneAt(Timestamp unix_ns) {
  ReplayedState state;
  state.Restart();
  RecordedScene scene;
  absl::Status bad;
  const auto take = [&](const McapReader::Message& from) {
    if (!bad.ok()) return;
    if (from.topic == kPoseTopic) {
      v1::PoseEvent pose;
      if (Parse(from, pose)) scene.metric = pose.metric();
    } else if (from.topic == kSurfaceTopic || from.topic == kMarksTopic) {
      bad = state.Take(from, nullptr);
    }
  };
  // Every ten seconds each chunk and the whole list are told again.
  const Timestamp from_ns = std::max(mcap_->first_ns(), unix_ns - 2 * kLookBack_ns);
  if (absl::Status read = mcap_->Read(from_ns, unix_ns, take); !read.ok()) return read;
  if (!bad.ok()) return bad;
  scene.surface = state.surface();
  scene.annotations = state.annotations();
  return scene;
}

}  // namespace saccade
