#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>
#include <vector>

#include "server/map/dormant_landmarks.hpp"
#include "server/map/keyframe_graph.hpp"
#include "server/map/landmark.hpp"
#include "server/map/relocaliser.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// A map without a filter: what a place is recognised by, and followed in once it is. A value: for
/// another thread, a file, another run.
struct StoredMap {
  CameraIntrinsics lens;                 // that its rays, patches and pixels were made with
  bool metric = false;                   // the unit of its world is the metre
  double inverse_range = 1.0;            // typical, of what was in view [1/m]
  std::vector<Landmark> known;           // points of the target, by rising id
  std::vector<DormantLandmark> at_rest;  // by rising id
  KeyframeGraph::Contents keyframes;
  std::vector<Relocaliser::PlaceView> places;
};

/// As bytes, the same on every machine (docs/design/maps.md). Pictures that wait to be described
/// are left out.
std::string EncodeMap(const StoredMap& map);
/// DataLoss: cut short, numbers that cannot be, or parts that name what is not there. What it
/// returns can be used without further checks. Never throws, and never asks for more memory than a
/// few times the bytes it was given.
absl::StatusOr<StoredMap> DecodeMap(absl::string_view bytes);

}  // namespace saccade
