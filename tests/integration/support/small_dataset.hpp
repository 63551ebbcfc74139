#pragma once

#include <string>

namespace saccade::testing {

struct SmallDatasetOptions {
  int frames = 90;  // at 30 Hz
  int width = 320, height = 240;
  unsigned seed = 1;
};

/// Writes a data set in TUM layout (rgb.txt, rgb/*.png, camera.yaml): a camera that sways 10 cm to
/// both sides before a textured wall 1.5 m away with a box 0.9 m away. Makes `folder`.
void WriteSmallDataset(const std::string& folder, const SmallDatasetOptions& options = {});

}  // namespace saccade::testing
