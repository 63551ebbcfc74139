#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "server/calibrate/target.hpp"
#include "server/markers/tag_grid.hpp"

namespace saccade {

/// "6x6:0.088:0.3", or a file of Kalibr's. InvalidArgument, NotFound.
absl::StatusOr<TagGrid> TagGridOf(const std::string& text);

/// Sheets of tags, as MakeLensTarget has them.
absl::StatusOr<std::unique_ptr<LensTarget>> MakeAprilGrid(const std::string& text, int border_bits);
absl::StatusOr<std::unique_ptr<LensTarget>> MakeArucoGrid(const std::string& text);

}  // namespace saccade
