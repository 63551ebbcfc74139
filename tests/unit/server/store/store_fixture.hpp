#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>

#include "server/store/annotation_store.hpp"

namespace saccade::testing {

/// A directory of its own for each test, removed afterwards.
class StoreTest : public ::testing::Test {
 protected:
  StoreTest() {
    std::string name = (std::filesystem::temp_directory_path() / "saccade-store-XXXXXX").string();
    directory_ = ::mkdtemp(name.data());
  }
  ~StoreTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(directory_, ignored);
  }

  std::unique_ptr<AnnotationStore> Open() {
    absl::StatusOr<std::unique_ptr<AnnotationStore>> store = AnnotationStore::Open(directory_);
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }
  std::filesystem::path file() const { return directory_ / "annotations.sqlite"; }

  static AnnotationChange Change(std::uint64_t sequence, const std::string& id,
                                 const std::string& text = "oil") {
    AnnotationChange change;
    change.sequence = sequence;
    change.id = id;
    change.session_id = "s";
    change.request_id = "request-" + std::to_string(sequence);
    change.description = "created note";
    StoredAnnotation stored;
    stored.annotation.id = id;
    stored.annotation.shape = AnnotationShape::kNote;
    stored.annotation.text = text;
    stored.annotation.author = "anna";
    stored.annotation.size_m = 0.07;
    stored.annotation.color_rgba = 0xff8800ff;
    stored.annotation.created_unix_ns = 1'700'000'000'000'000'000 + sequence;
    stored.annotation.revision = 3;
    stored.annotation.anchor.method = AnchorMethod::kPlane;
    stored.annotation.anchor.point_in_world = {0.1, -0.2, 1.0 / 3.0};
    stored.annotation.anchor.covariance_in_world << 1e-4, 1e-5, 0, 1e-5, 2e-4, 0, 0, 0, 3e-4;
    stored.annotation.anchor.error_m = 0.017;
    stored.annotation.ink_offset_m = {{0.1, 0.2, 0.3}, {-1, 0, 1e-9}};
    stored.world_key = "chessboard 9x6 0.04 m";
    change.after = stored;
    return change;
  }

  std::filesystem::path directory_;
};

}  // namespace saccade::testing
