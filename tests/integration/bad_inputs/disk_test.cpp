// A disk that is full: edits are refused, what was answered stays.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "client/net/connection.hpp"
#include "tests/integration/bad_inputs/table.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::disk_test {
namespace {

AnnotationDraft Draft(int number) {
  AnnotationDraft draft;
  draft.text = std::string(480, 'x') + std::to_string(number);
  draft.target = PointTarget{{0, 0, 1}};
  return draft;
}

TEST(FullDisk, EditsAreRefusedAndWhatWasAnsweredStays) {
  TemporaryFolder folder;
  WriteSmallDataset(folder / "set", {.frames = 60});
  const std::string disk = folder / "disk";
  std::filesystem::create_directories(disk);
  // A file system of its own, seen by this server alone and gone with it.
  const RunResult can = RunProgram(
      {"/usr/bin/unshare", "-m", "/bin/mount", "-t", "tmpfs", "-o", "size=64k", "none", disk});
  if (can.exit_code != 0) GTEST_SKIP() << "cannot mount a small disk here: " << can.err;
  Process server({"/usr/bin/unshare", "-m", "/bin/sh", "-c",
                  "mount -t tmpfs -o size=400k none " + disk +
                      " && exec " SACCADE_SERVER_PROGRAM
                      " --grpc 127.0.0.1:0 --http 127.0.0.1:0 --source dataset:" +
                      (folder / "set") + " --data-dir " + disk});
  const auto ready = server.WaitForLine("\"ready\"", std::chrono::seconds(20));
  ASSERT_TRUE(ready) << server.err();
  const auto at = ready->find("127.0.0.1:", ready->find("\"grpc\""));
  const std::string grpc = ready->substr(at, ready->find('"', at) - at);
  net::ConnectionOptions options;
  options.server = grpc;
  auto connection = net::Connection::Create(options);
  ASSERT_TRUE(connection.ok());

  std::vector<std::string> answered;
  absl::Status refused;
  for (int i = 0; i < 2000 && refused.ok(); ++i) {
    const absl::StatusOr<Annotation> created = (*connection)->CreateAnnotation(Draft(i));
    if (created.ok()) answered.push_back(created->id);
    refused = created.status();
  }
  Row("disk",
      "full disk under the data base (after " + std::to_string(answered.size()) + " annotations)",
      refused.ToString(), !refused.ok() && answered.size() > 10);
  // At once: the refused edit was taken back before it was answered.
  const auto all = (*connection)->ListAnnotations();
  ASSERT_TRUE(all.ok()) << all.status();
  const std::size_t listed = all->size();
  std::size_t found = 0;
  for (const Annotation& annotation : *all) {
    found += std::count(answered.begin(), answered.end(), annotation.id) ? 1 : 0;
  }
  Row("disk", "list after that",
      std::to_string(listed) + " listed, " + std::to_string(answered.size()) + " answered",
      found == answered.size() && listed == answered.size());
  const absl::Status status = (*connection)->GetStatus().status();
  Row("disk", "status after that", status.ok() ? "still serves" : status.ToString(), status.ok());
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(std::chrono::seconds(5)), 0) << server.err();
}

}  // namespace
}  // namespace saccade::testing::disk_test
