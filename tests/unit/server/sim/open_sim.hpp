#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>

#include "server/sim/sim_source.hpp"

namespace saccade {

/// The source of "sim:REST", or null and a test failure.
inline std::unique_ptr<SimSource> OpenSim(const std::string& rest,
                                          const SourceOptions& options = {}) {
  absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::OpenUri(rest, options);
  EXPECT_TRUE(source.ok()) << source.status();
  return source.ok() ? *std::move(source) : nullptr;
}

/// Options for frames first .. end (half open).
inline SourceOptions Frames(std::uint64_t first, std::optional<std::uint64_t> end = std::nullopt) {
  SourceOptions options;
  options.first_frame = first;
  options.end_frame = end;
  return options;
}

}  // namespace saccade
