#include "server/eval/trajectory.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/capture/image_list.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxLine = 4096;
constexpr std::size_t kMaxTrajectoryBytes = std::size_t{256} << 20;

absl::StatusOr<StampedPose> ParseLine(absl::string_view line) {
  const std::vector<absl::string_view> fields =
      absl::StrSplit(line, absl::ByAnyChar(" \t,"), absl::SkipEmpty());
  if (fields.size() != 8) {
    return absl::InvalidArgumentError(absl::StrCat("has ", fields.size(), " fields, not 8"));
  }
  StampedPose pose;
  const absl::StatusOr<Timestamp> time = ParseSeconds(fields[0]);
  if (!time.ok()) return time.status();
  pose.time_ns = *time;
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!absl::SimpleAtod(fields[i + 1], &v[i]) || !std::isfinite(v[i])) {
      return absl::InvalidArgumentError(absl::StrCat("field ", i + 2, " is not a finite number"));
    }
  }
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (std::abs(q.norm() - 1.0) > 0.01) {
    return absl::InvalidArgumentError(
        absl::StrCat("the quaternion has length ", q.norm(), ", not 1"));
  }
  pose.world_from_camera = {q.normalized(), {v[0], v[1], v[2]}};
  return pose;
}

}  // namespace

absl::StatusOr<Trajectory> LoadTrajectory(const std::filesystem::path& file) {
  const absl::StatusOr<std::string> whole =
      ReadRegularFile(file, kMaxTrajectoryBytes, "a trajectory");
  if (absl::IsNotFound(whole.status())) {
    return absl::NotFoundError(
        absl::StrCat(file.string(), ": cannot be opened; give a file in TUM format"));
  }
  if (!whole.ok()) return whole.status();
  Trajectory trajectory;
  int line = 0;
  for (const absl::string_view text : absl::StrSplit(*whole, '\n')) {
    ++line;
    const auto at = [&](absl::string_view problem) {
      return absl::InvalidArgumentError(
          absl::StrCat(file.string(), ":", line, ": ", problem,
                       "; write `timestamp tx ty tz qx qy qz qw`, times increasing"));
    };
    if (text.size() > kMaxLine) return at("the line is too long");
    const absl::string_view content = absl::StripAsciiWhitespace(text);
    if (content.empty() || content.front() == '#') continue;
    const absl::StatusOr<StampedPose> pose = ParseLine(content);
    if (!pose.ok()) return at(pose.status().message());
    if (!trajectory.empty() && pose->time_ns <= trajectory.back().time_ns) {
      return at("the time is not after the line before");
    }
    trajectory.push_back(*pose);
  }
  return trajectory;
}

std::string TumLine(const std::string& timestamp, const Rigid3& world_from_camera) {
  const Eigen::Vector3d& t = world_from_camera.translation;
  const Eigen::Quaterniond& q = world_from_camera.rotation;
  return absl::StrFormat("%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", timestamp, t.x(), t.y(), t.z(),
                         q.x(), q.y(), q.z(), q.w());
}

std::optional<Rigid3> PoseAt(const Trajectory& trajectory, Timestamp time_ns, Timestamp max_gap_ns,
                             Timestamp max_distance_ns) {
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), time_ns,
                       [](const StampedPose& pose, Timestamp time) { return pose.time_ns < time; });
  if (after != trajectory.end() && after->time_ns == time_ns) return after->world_from_camera;
  const auto before = after == trajectory.begin() ? trajectory.end() : std::prev(after);
  const bool has_before = before != trajectory.end(), has_after = after != trajectory.end();
  if (has_before && has_after && after->time_ns - before->time_ns <= max_gap_ns) {
    const double part = static_cast<double>(time_ns - before->time_ns) /
                        static_cast<double>(after->time_ns - before->time_ns);
    const Rigid3 &a = before->world_from_camera, &b = after->world_from_camera;
    return Rigid3{a.rotation.slerp(part, b.rotation).normalized(),
                  a.translation + part * (b.translation - a.translation)};
  }
  const StampedPose* nearest = nullptr;
  if (has_before) nearest = &*before;
  if (has_after && (nearest == nullptr || after->time_ns - time_ns < time_ns - nearest->time_ns)) {
    nearest = &*after;
  }
  if (nearest == nullptr || std::abs(nearest->time_ns - time_ns) > max_distance_ns) {
    return std::nullopt;
  }
  return nearest->world_from_camera;
}

Timestamp MedianInterval(const Trajectory& trajectory) {
  if (trajectory.size() < 2) return 0;
  std::vector<Timestamp> intervals;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    intervals.push_back(trajectory[i].time_ns - trajectory[i - 1].time_ns);
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

}  // namespace saccade
