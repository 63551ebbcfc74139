#pragma once

#include <absl/status/statusor.h>

#include <opencv2/core.hpp>
#include <string>

#include "shared/scene/annotation.hpp"

namespace saccade {

/// A file that somebody wants to pin up. Nothing of it is believed, and nothing allocated for it,
/// before its header was read: a PNG or JPEG of at most kMaxPictureBytes and kMaxPictureSide a
/// side, whole, of no more passes than pictures have. Then it is decoded, so that what is kept can
/// be drawn. InvalidArgument after "draft.picture: ". Up to half a second.
absl::StatusOr<PicturePtr> ReadPictureFile(std::string bytes);

/// To be drawn: BGR, at most `max_side` px a side, upright; empty if it cannot be decoded.
cv::Mat DecodePicture(const Picture& picture, int max_side);

}  // namespace saccade
