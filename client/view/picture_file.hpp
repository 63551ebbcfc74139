#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "shared/scene/annotation.hpp"

namespace saccade::view {

/// How wide a picture is pinned up where nothing else is said [m].
inline constexpr double kPictureM = 0.2;

/// A PNG or JPEG, or a `page` of a PDF (from 1), as it is sent: as PNG where that fits into a
/// mebibyte, else as JPEG, else smaller. Coded anew whatever it was, so that what a camera wrote
/// into its file, such as where it was taken, stays here. Any thread; blocks while a page is drawn.
///   NotFound, InvalidArgument, FailedPrecondition  in words for a person
absl::StatusOr<PicturePtr> LoadPicture(const std::string& file, int page = 1);

}  // namespace saccade::view
