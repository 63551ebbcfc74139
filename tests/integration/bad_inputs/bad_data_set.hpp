#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "tests/integration/support/process.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing {

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// A data set of a few frames to spoil.
class BadDataSet : public ::testing::Test {
 protected:
  // A good one that `spoil` breaks, as arguments.
  std::vector<std::string> Spoiled(const std::function<void(const std::filesystem::path&)>& spoil) {
    const std::filesystem::path set = folder_.path() + "/set";
    std::filesystem::remove_all(set);
    WriteSmallDataset(set, {.frames = 5});
    spoil(set);
    return {"--source", "dataset:" + set.string(), "--data-dir", folder_ / "data"};
  }
  TemporaryFolder folder_;
};

}  // namespace saccade::testing
