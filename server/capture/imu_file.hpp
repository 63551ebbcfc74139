#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

#include "server/capture/imu_feed.hpp"

namespace saccade {

/// Reads `NANOSECONDS,wx,wy,wz,ax,ay,az` [rad/s, m/s^2] line by line; # begins a comment (EuRoC).
///   NotFound         no such file
///   InvalidArgument  columns, numbers, order or units are wrong: file, line, remedy
absl::StatusOr<ImuTrack> LoadImuSamples(const std::filesystem::path& file);

/// The unit of a data set: `imu.csv` beside camera.yaml, whose T_body_camera tells where it is, or
/// EuRoC's mav0/imu0. `imu.yaml` (or imu0/sensor.yaml) may tell its noise, by EuRoC's names:
/// gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density,
/// accelerometer_random_walk. Null: there is none, or nobody says where it is (told in the log).
///   InvalidArgument  a file is wrong: file, line, remedy
absl::StatusOr<std::shared_ptr<ImuFeed>> LoadImu(const std::filesystem::path& folder);

}  // namespace saccade
