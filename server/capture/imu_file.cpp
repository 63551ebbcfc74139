#include "server/capture/imu_file.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/capture/yaml_reader.hpp"
#include "shared/io/log.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{512} << 20;
constexpr absl::string_view kImuForm = "write `NANOSECONDS,wx,wy,wz,ax,ay,az` in rad/s and m/s^2";
constexpr double kFastest_rad_s = 100.0, kHardest_m_s2 = 400.0;  // gyros end at 35, or 70
constexpr double kLightest_m_s2 = 4.0, kHeaviest_m_s2 = 30.0;    // on average, standing or carried
constexpr std::array kNames = {"wx", "wy", "wz", "ax", "ay", "az"};

absl::Status At(const std::filesystem::path& file, int line, absl::string_view problem,
                absl::string_view remedy = kImuForm) {
  return absl::InvalidArgumentError(
      absl::StrCat(file.string(), ":", line, ": ", problem, "; ", remedy));
}

absl::StatusOr<ImuSample> ReadLine(const std::filesystem::path& file, int line,
                                   absl::string_view text) {
  std::vector<absl::string_view> words = absl::StrSplit(text, ',');
  if (words.size() != 1 + kNames.size()) {
    return At(file, line, absl::StrCat("has ", words.size(), " columns, not 7"));
  }
  for (absl::string_view& word : words) word = absl::StripAsciiWhitespace(word);
  ImuSample sample;
  if (!absl::SimpleAtoi(words[0], &sample.time_ns) || sample.time_ns < 0) {
    return At(file, line,
              absl::StrCat("timestamp: '", words[0], "' is not a whole number of nanoseconds"));
  }
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    double value = 0.0;
    if (!absl::SimpleAtod(words[1 + k], &value) || !std::isfinite(value)) {
      return At(file, line, absl::StrCat(kNames[k], ": '", words[1 + k], "' is not a number"));
    }
    const bool turn = k < 3;
    if (std::abs(value) > (turn ? kFastest_rad_s : kHardest_m_s2)) {
      return At(file, line, absl::StrCat(kNames[k], ": ", words[1 + k], " is not plausible"),
                turn ? "give rad/s: degrees times 0.0174533" : "give m/s^2");
    }
    (turn ? sample.angular_velocity_rad_s : sample.acceleration_m_s2)[static_cast<int>(k % 3)] =
        value;
  }
  return sample;
}

/// Of a whole recording: gravity is most of what it feels.
absl::Status CheckUnits(const std::filesystem::path& file, const ImuTrack& samples) {
  double lengths = 0.0;
  for (const ImuSample& sample : samples) {
    lengths += sample.acceleration_m_s2.norm();
  }
  const double mean = lengths / static_cast<double>(samples.size());
  if (mean >= kLightest_m_s2 && mean <= kHeaviest_m_s2) return absl::OkStatus();
  const bool in_g = mean > 0.5 && mean < 2.0;
  return absl::InvalidArgumentError(absl::StrCat(
      file.string(), ": acceleration is ", mean, " on average, and gravity is 9.81 m/s^2; ",
      in_g ? "it is in units of gravity: multiply by 9.80665"
           : "give what the accelerometer says, gravity included, in m/s^2"));
}

std::optional<Rigid3> ToRigid(const std::vector<double>& numbers) {
  if (numbers.size() != 16) return std::nullopt;
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(numbers.data());
  const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
  constexpr double kRounding = 1e-3;
  if (!(turn * turn.transpose()).isIdentity(kRounding) || turn.determinant() < 0.0) {
    return std::nullopt;
  }
  return Rigid3{Eigen::Quaterniond(turn).normalized(), matrix.topRightCorner<3, 1>()};
}

absl::Status ReadNoise(const std::filesystem::path& file, ImuNoise& noise) {
  if (!MayExist(file)) return absl::OkStatus();
  YamlReader yaml(file);
  const YamlRange above{0.0, 10.0, true};
  noise.gyro_rad_s_rt_hz = yaml.Number("gyroscope_noise_density", above, noise.gyro_rad_s_rt_hz);
  noise.gyro_walk_rad_s2_rt_hz =
      yaml.Number("gyroscope_random_walk", above, noise.gyro_walk_rad_s2_rt_hz);
  noise.accelerometer_m_s2_rt_hz =
      yaml.Number("accelerometer_noise_density", above, noise.accelerometer_m_s2_rt_hz);
  noise.accelerometer_walk_m_s3_rt_hz =
      yaml.Number("accelerometer_random_walk", above, noise.accelerometer_walk_m_s3_rt_hz);
  return yaml.status();
}

}  // namespace

absl::StatusOr<ImuTrack> LoadImuSamples(const std::filesystem::path& file) {
  const absl::StatusOr<std::string> text = ReadRegularFile(file, kMaxBytes, "inertial samples");
  if (!text.ok()) return text.status();
  ImuTrack samples;
  int line = 0, line_before = 0;
  for (const absl::string_view whole : absl::StrSplit(*text, '\n')) {
    ++line;
    const absl::string_view rest = absl::StripAsciiWhitespace(whole);
    if (rest.empty() || rest.front() == '#') continue;
    const absl::StatusOr<ImuSample> sample = ReadLine(file, line, rest);
    if (!sample.ok()) return sample.status();
    if (!samples.empty() && sample->time_ns <= samples.back().time_ns) {
      return At(file, line,
                absl::StrCat("timestamp ", sample->time_ns, " is not after ",
                             samples.back().time_ns, " of line ", line_before),
                "sort the lines by time, and leave each out that comes twice");
    }
    samples.push_back(*sample);
    line_before = line;
  }
  if (samples.empty()) return At(file, line, "has no sample");
  if (const absl::Status status = CheckUnits(file, samples); !status.ok()) return status;
  return samples;
}

absl::StatusOr<std::shared_ptr<ImuFeed>> LoadImu(const std::filesystem::path& folder) {
  const std::filesystem::path euroc = MayExist(folder / "mav0") ? folder / "mav0" : folder;
  const bool tum = MayExist(folder / "imu.csv");
  const std::filesystem::path file = tum ? folder / "imu.csv" : euroc / "imu0" / "data.csv";
  if (!MayExist(file)) return nullptr;
  absl::StatusOr<ImuTrack> samples = LoadImuSamples(file);
  if (!samples.ok()) return samples.status();
  ImuInfo info;
  const std::filesystem::path noise = tum ? folder / "imu.yaml" : euroc / "imu0" / "sensor.yaml";
  if (const absl::Status status = ReadNoise(noise, info.noise); !status.ok()) return status;
  const std::filesystem::path camera =
      tum ? folder / "camera.yaml" : euroc / "cam0" / "sensor.yaml";
  std::vector<double> numbers;
  if (MayExist(camera)) {
    YamlReader yaml(camera);
    if (yaml.Has("T_body_camera")) numbers = yaml.Numbers("T_body_camera", 16);
    if (yaml.Has("T_BS")) numbers = yaml.Map("T_BS").Numbers("data", 16);
    if (!yaml.status().ok()) return yaml.status();
  }
  if (numbers.empty()) {
    Log(absl::StrCat(file.string(), ": is not used: ", camera.string(),
                     " does not say where the camera is; give T_body_camera, row-major, camera to "
                     "inertial unit"));
    return nullptr;
  }
  const std::optional<Rigid3> imu_from_camera = ToRigid(numbers);
  if (!imu_from_camera) {
    return absl::InvalidArgumentError(
        absl::StrCat(camera.string(), ": ", tum ? "T_body_camera" : "T_BS",
                     ": is no rotation and translation; give [R t; 0 0 0 1], row by row"));
  }
  info.camera_from_imu = imu_from_camera->Inverse();
  return std::make_shared<ImuFeed>(info, *std::move(samples));
}

}  // namespace saccade
