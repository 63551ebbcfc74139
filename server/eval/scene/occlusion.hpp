#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>

namespace saccade {

/// Pixels of virtual things in a picture.
struct MaskCounts {
  std::int64_t both = 0, either = 0;
  double Iou() const {
    return either == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(either);
  }
  void Add(const MaskCounts& other) {
    both += other.both;
    either += other.either;
  }
};

struct OcclusionSummary {
  int pictures = 0;
  int partly_hidden = 0;         // at least a tenth of the thing is hidden, and a tenth is seen
  MaskCounts seen, hidden;       // over all pictures
  MaskCounts seen_without_bias;  // the same pictures against rays that know no kOcclusionBias_m
  double worst_seen_iou = 1;     // of pictures with at least 2000 pixels seen
  double worst_hidden_iou = 1;   // and hidden
};

/// T33: `count` pictures of the simulated room (`sim:desk`) with something virtual in each, partly
/// behind walls, desk and what lies on it. What SceneView draws is held against rays cast through
/// each pixel: into the room by server/sim's RayCaster, into the thing by brute force; what is
/// nearer than the room and kOcclusionBias_m is seen. Writes
/// DIR/occlusion.csv, DIR/report.json and the first eight pictures.
absl::StatusOr<OcclusionSummary> RunOcclusion(std::uint64_t seed, int count,
                                              const std::filesystem::path& out);

}  // namespace saccade
