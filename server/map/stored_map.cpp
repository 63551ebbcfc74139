#include "server/map/stored_map.hpp"

#include <absl/status/status.h>

#include <cmath>
#include <memory>
#include <utility>

#include "server/map/archive.hpp"

namespace saccade {
namespace {

constexpr int kThumbnail = 40 * 30;

template <typename Archive, int Rows, int Columns>
void Fields(Archive& archive, Eigen::Matrix<double, Rows, Columns>& matrix) {
  for (double& value : matrix.reshaped()) archive.Number(value);
}

/// A direction: angles of a millionth of a pixel are kept.
template <typename Archive>
void Bearing(Archive& archive, Eigen::Vector3d& unit) {
  for (double& value : unit) {
    auto single = static_cast<float>(value);
    archive.Number(single);
    if constexpr (Archive::kReads) value = single;
  }
  if constexpr (Archive::kReads) {
    archive.Check(std::abs(unit.norm() - 1.0) < 1e-3);
    unit = archive.ok() ? unit.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  }
}

template <typename Archive>
void Fields(Archive& archive, Rigid3& pose) {
  for (double& value : pose.rotation.coeffs()) archive.Number(value);
  Fields(archive, pose.translation);
  if constexpr (Archive::kReads) {
    archive.Check(std::abs(pose.rotation.norm() - 1.0) < 1e-6);
    pose.rotation = archive.ok() ? pose.rotation.normalized() : Eigen::Quaterniond::Identity();
  }
}

template <typename Archive>
void Fields(Archive& archive, CameraIntrinsics& lens) {
  archive.Number(lens.model);
  archive.Number(lens.width);
  archive.Number(lens.height);
  for (double* value :
       {&lens.fx, &lens.fy, &lens.cx, &lens.cy, &lens.fps, &lens.rolling_shutter_readout_s}) {
    archive.Number(*value);
  }
  for (double& value : lens.distortion) archive.Number(value);
  archive.Check(lens.model >= LensModel::kPinhole && lens.model <= LensModel::kFov);
  archive.Check(lens.width > 0 && lens.width <= 16384 && lens.height > 0 && lens.height <= 16384);
  archive.Check(lens.fx > 0.0 && lens.fy > 0.0);
}

template <typename Archive>
void Fields(Archive& archive, GraphSighting& sighting) {
  archive.Number(sighting.id);
  Bearing(archive, sighting.ray);
  archive.Number(sighting.sigma_rad);
  archive.Check(sighting.sigma_rad > 0.0);
  std::uint8_t known = sighting.known_point.has_value() ? 1 : 0;
  archive.Number(known);
  if (known == 0) return;
  if constexpr (Archive::kReads) sighting.known_point.emplace();
  Fields(archive, *sighting.known_point);
}

template <typename Archive>
void Fields(Archive& archive, KeyframeGraph::Keyframe& keyframe) {
  Fields(archive, keyframe.world_from_camera);
  archive.Number(keyframe.distance_m);
  archive.Check(keyframe.distance_m > 0.0);
  archive.Count(keyframe.sightings, 29);
  for (GraphSighting& sighting : keyframe.sightings) Fields(archive, sighting);
  archive.Count(keyframe.births, sizeof(FeatureId));
  for (FeatureId& id : keyframe.births) archive.Number(id);
}

template <typename Archive>
void Fields(Archive& archive, KeyframeGraph::Point& point) {
  archive.Number(point.anchor);
  archive.Number(point.birth.id);
  Bearing(archive, point.birth.bearing);
  archive.Number(point.birth.sigma_rad);
  archive.Number(point.birth.inverse_range);
  archive.Number(point.birth.inverse_range_sigma);
  Bearing(archive, point.estimate.bearing);
  archive.Number(point.estimate.inverse_range);
  archive.Check(point.birth.sigma_rad > 0.0 && point.birth.inverse_range_sigma > 0.0);
  archive.Count(point.seen_from, sizeof(KeyframeId));
  for (KeyframeId& id : point.seen_from) archive.Number(id);
}

template <typename Archive>
void Fields(Archive& archive, PatchTemplate& patch) {
  archive.Block(patch.pixels.data(), patch.pixels.size());
  Fields(archive, patch.birth_pixel);
  Bearing(archive, patch.birth_bearing);
  Fields(archive, patch.centre_in_template);
  for (int* value : {&patch.valid.x, &patch.valid.y, &patch.valid.width, &patch.valid.height}) {
    archive.Number(*value);
    archive.Check(*value >= 0 && *value <= PatchTemplate::kSize);
  }
  archive.Check(patch.valid.x + patch.valid.width <= PatchTemplate::kSize);
  archive.Check(patch.valid.y + patch.valid.height <= PatchTemplate::kSize);
  archive.Check((patch.centre_in_template.array() >= 0.0).all() &&
                (patch.centre_in_template.array() < PatchTemplate::kSize).all());
}

/// What it did in frames of another run says nothing in this one.
template <typename Archive>
void Fields(Archive& archive, Landmark& landmark) {
  archive.Number(landmark.id);
  Fields(archive, landmark.patch);
  std::uint8_t seeded = landmark.seeded ? 1 : 0, known = landmark.known ? 1 : 0;
  archive.Number(seeded);
  archive.Number(known);
  archive.Number(landmark.attempted);
  archive.Number(landmark.matched);
  archive.Number(landmark.recent);
  archive.Check(landmark.matched <= landmark.attempted);
  if constexpr (Archive::kReads) {
    landmark.seeded = seeded != 0;
    if (known != 0) landmark.known.emplace();
  }
  if (!landmark.known) return;
  Fields(archive, landmark.known->point_in_world);
  Fields(archive, landmark.known->world_from_birth);
}

template <typename Archive>
void Fields(Archive& archive, DormantLandmark& dormant) {
  Fields(archive, dormant.landmark);
  archive.Number(dormant.inverse_range_sigma);
  Fields(archive, dormant.covariance_in_world);
  archive.Check(dormant.inverse_range_sigma > 0.0 && !dormant.landmark.known);
}

template <typename Archive>
void Fields(Archive& archive, DescribedPoint& point) {
  for (double& value : point.pixel) {
    auto single = static_cast<float>(value);
    archive.Number(single);
    if constexpr (Archive::kReads) value = single;
  }
  for (int k = 0; k < DescribedPoint::kScales; ++k) {
    std::uint8_t present = point.present[k] ? 1 : 0;
    archive.Number(present);
    if constexpr (Archive::kReads) point.present[k] = present != 0;
    if (present != 0) archive.Block(point.descriptors[k].data(), sizeof(Descriptor));
  }
}

template <typename Archive>
void Fields(Archive& archive, Relocaliser::PlaceView& view) {
  Fields(archive, view.world_from_camera);
  if constexpr (Archive::kReads) view.thumbnail = cv::Mat::zeros(1, kThumbnail, CV_32FC1);
  for (int k = 0; k < kThumbnail; ++k) archive.Number(view.thumbnail.at<float>(k));
  archive.Count(view.points, 48);
  for (ViewPoint& point : view.points) {
    archive.Number(point.id);
    Fields(archive, point.pixel);
    Fields(archive, point.point_in_world);
  }
  if constexpr (Archive::kReads) view.described.resize(view.points.size());
  for (DescribedPoint& point : view.described) Fields(archive, point);
  archive.Count(view.corners.described, 11);
  if constexpr (Archive::kReads) {
    view.corners.bearings.resize(view.corners.described.size());
    view.corners.ranges_m.resize(view.corners.described.size());
  }
  for (std::size_t k = 0; k < view.corners.described.size(); ++k) {
    Fields(archive, view.corners.described[k]);
    Bearing(archive, view.corners.bearings[k]);
    archive.Number(view.corners.ranges_m[k]);
    archive.Check(view.corners.ranges_m[k] >= 0.0);
  }
}

/// A list of things that hold their own name.
template <typename Archive, typename T>
void All(Archive& archive, std::vector<T>& list, std::size_t least_bytes) {
  archive.Count(list, least_bytes);
  for (T& one : list) {
    Fields(archive, one);
    if (!archive.ok()) return;
  }
}

/// A map by keys, in the order of `Sorted`.
template <typename Archive, typename Map>
void ByKey(Archive& archive, Map& map, std::size_t least_bytes) {
  std::vector<typename Map::key_type> keys;
  if constexpr (!Archive::kReads) {
    for (const auto& [key, value] : map) keys.push_back(key);
    std::sort(keys.begin(), keys.end());
  }
  archive.Count(keys, least_bytes);
  for (auto& key : keys) {
    archive.Number(key);
    if (!archive.ok()) return;
    Fields(archive, map[key]);
  }
  archive.Check(map.size() == keys.size());
}

template <typename Archive>
void Fields(Archive& archive, StoredMap& map) {
  Fields(archive, map.lens);
  std::uint8_t metric = map.metric ? 1 : 0;
  archive.Number(metric);
  archive.Number(map.inverse_range);
  archive.Check(map.inverse_range > 0.0);
  if constexpr (Archive::kReads) map.metric = metric != 0;
  All(archive, map.known, PatchTemplate::kSize * PatchTemplate::kSize);
  All(archive, map.at_rest, PatchTemplate::kSize * PatchTemplate::kSize);
  ByKey(archive, map.keyframes.keyframes, 80);
  ByKey(archive, map.keyframes.points, 80);
  All(archive, map.places, kThumbnail * sizeof(float));
}

/// Rising ids, each of a kind that its list is for, with room for those that come after them.
bool Agrees(const StoredMap& map) {
  // The graph counts by keyframe, from its first to its next.
  constexpr KeyframeId kMostKeyframes = 10'000'000;
  constexpr FeatureId kMostFeatures = FeatureId{1} << 48;
  const auto& keyframes = map.keyframes.keyframes;
  if (!keyframes.empty() &&
      (keyframes.begin()->first < 0 || keyframes.rbegin()->first > kMostKeyframes)) {
    return false;
  }
  for (const auto& [id, point] : map.keyframes.points) {
    if (id > kMostFeatures) return false;
  }
  if (!map.known.empty() && map.known.back().id > kMostFeatures) return false;
  FeatureId newest = 0;
  for (const Landmark& landmark : map.known) {
    if (landmark.id <= newest || !landmark.known) return false;
    newest = landmark.id;
  }
  newest = 0;
  for (const DormantLandmark& dormant : map.at_rest) {
    const auto point = map.keyframes.points.find(dormant.landmark.id);
    if (dormant.landmark.id <= newest || point == map.keyframes.points.end()) return false;
    newest = dormant.landmark.id;
  }
  KeyframeGraph check{KeyframeGraphOptions()};
  return check.Load(map.keyframes);
}

}  // namespace

std::string EncodeMap(const StoredMap& map) {
  ArchiveWriter writer;
  // The writer changes nothing: one list of fields serves both directions.
  Fields(writer, const_cast<StoredMap&>(map));
  return writer.Take();
}

absl::StatusOr<StoredMap> DecodeMap(absl::string_view bytes) {
  ArchiveReader reader(bytes);
  StoredMap map;
  Fields(reader, map);
  if (!reader.ok() || !reader.at_end() || !Agrees(map)) {
    return absl::DataLossError("the map is damaged");
  }
  const auto lens = std::make_shared<const CameraModel>(map.lens);
  for (Landmark& landmark : map.known) landmark.patch.camera = lens;
  for (DormantLandmark& dormant : map.at_rest) dormant.landmark.patch.camera = lens;
  return map;
}

}  // namespace saccade
