#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <thread>

#include "client/cli/commands.hpp"
#include "client/cli/text.hpp"

namespace saccade::cli {
namespace {

// The server gives the head up 500 ms after the last heartbeat: whoever interrupts this stops it.
constexpr std::chrono::milliseconds kProgressPoll(100);

// Progress goes to stderr, as JSON where answers are.
void SayProgress(const Options& options, int tenths) {
  std::cerr << (options.json ? Dump({{"calibrating", 0.1 * tenths}}) + "\n"
                             : absl::StrFormat("calibrating: %d %%\n", 10 * tenths));
}

absl::StatusOr<MountCalibrationReport> Wait(const Options& options, net::Connection& connection,
                                            const std::string& lease_id) {
  int said = -1;
  while (true) {
    const absl::StatusOr<net::Lease> lease = connection.AcquireLease(lease_id);
    if (!lease.ok()) return lease.status();
    absl::StatusOr<MountCalibrationReport> report = connection.GetMountCalibration();
    if (!report.ok() || !report->running) return report;
    const int tenths = static_cast<int>(10 * report->share);
    if (tenths != said) SayProgress(options, tenths);
    said = tenths;
    std::this_thread::sleep_for(kProgressPoll);
  }
}

absl::Status Show(const Options& options, const MountCalibrationReport& report) {
  if (!report.problem.empty()) return absl::FailedPreconditionError(report.problem);
  if (!options.out.empty()) {
    const std::string file = absl::StrCat("# Written by saccade calibrate-mount\n", report.toml);
    if (absl::Status written = WriteFile(options.out, file); !written.ok()) return written;
  }
  if (options.json) {
    std::cout << Dump(ToJson(report)) << "\n";
    return absl::OkStatus();
  }
  std::cout << CalibrationText(report);
  if (options.out.empty()) {
    std::cout << "\n" << report.toml;
  } else {
    std::cout << options.out << ": written; start the server with --config " << options.out
              << ", or put the table into its file\n";
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RunCalibrateMount(const Options& options, net::Connection& connection) {
  std::error_code ignored;
  if (!options.out.empty() && std::filesystem::exists(options.out, ignored)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out: ", options.out, " exists; name a new file"));
  }
  const absl::StatusOr<std::string> lease = TakeLease(connection);
  if (!lease.ok()) return lease.status();
  const absl::StatusOr<GazeSnapshot> begun = connection.CalibrateMount();
  if (!begun.ok()) {
    connection.ReleaseLease().IgnoreError();
    return begun.status();
  }
  const absl::StatusOr<MountCalibrationReport> report = Wait(options, connection, *lease);
  connection.ReleaseLease().IgnoreError();
  if (!report.ok()) return report.status();
  return Show(options, *report);
}

}  // namespace saccade::cli
