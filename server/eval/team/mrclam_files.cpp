#include "server/eval/team/mrclam_files.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "server/eval/team/number_table.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Path = std::filesystem::path;

constexpr Timestamp kTruthGap_ns = 300'000'000;

Timestamp TimeOf(double seconds) { return std::llround(seconds * 1e6) * 1000; }

/// Rows of `columns` numbers whose first is a time that never goes back.
absl::StatusOr<std::vector<NumberRow>> LoadTimed(const Path& file, int columns, const char* what) {
  absl::StatusOr<std::vector<NumberRow>> rows = LoadNumbers(file, columns, what);
  if (!rows.ok()) return rows;
  double last = 0;
  for (const NumberRow& row : *rows) {
    const double time_s = row.values[0];
    if (!(time_s >= last && time_s < 9e9)) {
      return BadLine(file, row.line,
                     absl::StrCat("its time is before the line above or not in seconds since 1970; "
                                  "sort the lines by time"));
    }
    last = time_s;
  }
  return rows;
}

absl::StatusOr<int> Whole(const Path& file, int line, const char* name, double value) {
  if (value >= 0 && value < 1e6 && value == std::floor(value)) return static_cast<int>(value);
  return BadLine(file, line, absl::StrCat(name, " ", value, " is not a whole number from 0"));
}

/// Bar code -> subject.
absl::StatusOr<std::map<int, int>> LoadCodes(const Path& file) {
  const auto rows = LoadNumbers(file, 2, "subject, bar code");
  if (!rows.ok()) return rows.status();
  std::map<int, int> codes, subjects;
  for (const NumberRow& row : *rows) {
    const auto subject = Whole(file, row.line, "subject", row.values[0]);
    const auto code = Whole(file, row.line, "bar code", row.values[1]);
    if (!subject.ok()) return subject.status();
    if (!code.ok()) return code.status();
    if (!codes.emplace(*code, *subject).second || !subjects.emplace(*subject, *code).second) {
      return BadLine(file, row.line,
                     "its subject or bar code was given before; give each one once");
    }
  }
  return codes;
}

absl::StatusOr<std::map<int, Eigen::Vector2d>> LoadLandmarks(const Path& file) {
  const auto rows = LoadNumbers(file, 5, "subject, x, y [m], their sigmas [m]");
  if (!rows.ok()) return rows.status();
  std::map<int, Eigen::Vector2d> landmarks;
  for (const NumberRow& row : *rows) {
    const auto subject = Whole(file, row.line, "subject", row.values[0]);
    if (!subject.ok()) return subject.status();
    if (!landmarks.emplace(*subject, Eigen::Vector2d(row.values[1], row.values[2])).second) {
      return BadLine(file, row.line,
                     absl::StrCat("landmark ", *subject, " was given before; give it once"));
    }
  }
  return landmarks;
}

absl::Status LoadSights(const Path& file, int robot, const std::map<int, int>& codes,
                        MrclamData& data) {
  const auto rows = LoadTimed(file, 4, "time [s], bar code, range [m], bearing [rad]");
  if (!rows.ok()) return rows.status();
  for (const NumberRow& row : *rows) {
    const auto code = Whole(file, row.line, "bar code", row.values[1]);
    if (!code.ok()) return code.status();
    if (row.values[2] < 0) {
      return BadLine(file, row.line, absl::StrCat("range ", row.values[2], " m is negative"));
    }
    const auto subject = codes.find(*code);
    if (subject == codes.end()) {
      ++data.unknown_codes;
      continue;
    }
    data.robots[static_cast<std::size_t>(robot - 1)].sights.push_back(
        {TimeOf(row.values[0]), subject->second, {row.values[2], row.values[3]}});
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MrclamData> LoadMrclam(const std::filesystem::path& folder) {
  MrclamData data;
  const auto codes = LoadCodes(folder / "Barcodes.dat");
  if (!codes.ok()) return codes.status();
  absl::StatusOr<std::map<int, Eigen::Vector2d>> landmarks =
      LoadLandmarks(folder / "Landmark_Groundtruth.dat");
  if (!landmarks.ok()) return landmarks.status();
  data.landmarks = *std::move(landmarks);
  for (int robot = 1;
       robot == 1 || MayExist(folder / absl::StrCat("Robot", robot, "_Odometry.dat")); ++robot) {
    MrclamRobot& one = data.robots.emplace_back();
    const auto file = [&](const char* kind) {
      return folder / absl::StrCat("Robot", robot, "_", kind, ".dat");
    };
    const auto odometry = LoadTimed(file("Odometry"), 3,
                                    "time [s], forward velocity [m/s], angular velocity [rad/s]");
    if (!odometry.ok()) return odometry.status();
    for (const NumberRow& row : *odometry) {
      one.odometry.push_back({TimeOf(row.values[0]), {row.values[1], row.values[2]}});
    }
    if (absl::Status read = LoadSights(file("Measurement"), robot, *codes, data); !read.ok()) {
      return read;
    }
    if (!MayExist(file("Groundtruth"))) continue;
    const auto truth = LoadTimed(file("Groundtruth"), 4, "time [s], x, y [m], heading [rad]");
    if (!truth.ok()) return truth.status();
    for (const NumberRow& row : *truth) {
      one.truth.push_back({TimeOf(row.values[0]), {row.values[1], row.values[2], row.values[3]}});
    }
  }
  for (const auto& [subject, place] : data.landmarks) {
    if (subject <= static_cast<int>(data.robots.size())) {
      return absl::InvalidArgumentError(
          absl::StrCat((folder / "Landmark_Groundtruth.dat").string(), ": subject ", subject,
                       " is a robot; landmarks have numbers after those of the robots"));
    }
  }
  return data;
}

std::optional<Eigen::Vector3d> TruthAt(const std::vector<MrclamTruth>& truth, Timestamp time_ns) {
  const auto after =
      std::upper_bound(truth.begin(), truth.end(), time_ns,
                       [](Timestamp time, const MrclamTruth& line) { return time < line.time_ns; });
  if (after == truth.begin() || after == truth.end()) return std::nullopt;
  const MrclamTruth &a = *std::prev(after), &b = *after;
  if (b.time_ns - a.time_ns > kTruthGap_ns) return std::nullopt;
  const double part = Seconds(time_ns - a.time_ns) / Seconds(b.time_ns - a.time_ns);
  Eigen::Vector3d pose = a.pose;
  pose.head<2>() += part * (b.pose - a.pose).head<2>();
  pose.z() += part * std::remainder(b.pose.z() - a.pose.z(), 2 * M_PI);
  return pose;
}

}  // namespace saccade
