#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "server/overlay/painter.hpp"
#include "shared/marks/strokes.hpp"

namespace saccade {

struct ColoredLabel {
  const Label* label = nullptr;
  cv::Scalar color;  // BGR
};

/// Draws the 48 labels nearest the middle of the picture, nearest on top, each inside the picture
/// as a whole. A text of up to three short lines is always whole. Of the longer ones, that nearest
/// the middle is whole if it is within 0.3 of the picture's height from it; the others show three
/// lines and an ellipsis: to read one, look at it.
void DrawLabels(std::vector<ColoredLabel> labels, cv::Mat& picture, Painter& painter);

}  // namespace saccade
