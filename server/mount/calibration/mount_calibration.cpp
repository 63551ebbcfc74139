#include "server/mount/calibration/mount_calibration.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "server/mount/calibration/calibration_fit.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastPictures = 100, kLeastReadings = 100;
constexpr double kMoved_rad = 4 * kDegree;  // a joint that moved less says nothing of its axis
constexpr double kOutlier_rad = 2 * kDegree;
constexpr double kWorstRms_rad = 2 * kDegree;
constexpr double kMostOutliers = 0.2;
constexpr double kMostDelay_s = 0.4;
constexpr double kShiftCost = 0.01, kFlipCost = 1e-3;
constexpr double kLeastLimit_rad = 1e-6;  // zero is always within

absl::Status Bad(const std::string& what) {
  return absl::FailedPreconditionError(absl::StrCat("calibrate-mount: ", what));
}

/// Signs and zeros are a matter of choice: a joint turned over is one with its axis reversed, and
/// another zero turns the axes before it. Chosen are those that bring the axes nearest to `wanted`.
/// The first joint's zero cannot be seen at all, and stays.
struct Choice {
  std::array<double, kMountJoints> signs{1, 1, 1}, shifts{0, 0, 0};
  double cost = 1e300;
};

std::array<Eigen::Vector3d, kMountJoints> Axes(const MountChain& chain, const Choice& choice) {
  std::array<Eigen::Vector3d, kMountJoints> axes;
  for (std::size_t k = 0; k < kMountJoints; ++k) axes[k] = choice.signs[k] * chain.axes[k];
  const Eigen::Matrix3d last = ExpSo3(-choice.shifts[2] * axes[2]);
  const Eigen::Matrix3d middle = ExpSo3(-choice.shifts[1] * axes[1]);
  axes[0] = last * (middle * axes[0]);
  axes[1] = last * axes[1];
  return axes;
}

double Distance(const MountChain& chain, const Choice& choice,
                const std::array<Eigen::Vector3d, kMountJoints>& wanted) {
  const auto axes = Axes(chain, choice);
  double sum = 0;
  for (std::size_t k = 0; k < kMountJoints; ++k) sum += (axes[k] - wanted[k]).squaredNorm();
  return sum;
}

/// Shifts by coordinate descent from a coarse grid.
void ChooseShifts(const MountChain& chain, const std::array<Eigen::Vector3d, kMountJoints>& wanted,
                  Choice& choice) {
  constexpr double kGrid = 15 * kDegree;
  for (double step = kGrid; step > 1e-10; step *= 0.5) {
    bool better = true;
    for (int round = 0; better && round < 200; ++round) {
      better = false;
      for (std::size_t k = 1; k < kMountJoints; ++k) {
        for (const double by : {-step, step}) {
          if (!chain.moved[k]) continue;
          Choice other = choice;
          other.shifts[k] += by;
          other.cost = Distance(chain, other, wanted);
          if (other.cost >= choice.cost) continue;
          choice = other;
          better = true;
        }
      }
    }
  }
}

Choice Choose(const MountChain& chain, const std::array<Eigen::Vector3d, kMountJoints>& wanted) {
  Choice best;
  for (unsigned bits = 0; bits < 8; ++bits) {
    Choice one;
    bool possible = true;
    for (std::size_t k = 0; k < kMountJoints; ++k) {
      if ((bits >> k & 1) == 0) continue;
      one.signs[k] = -1;
      possible &= chain.moved[k];
    }
    if (!possible) continue;
    one.cost = Distance(chain, one, wanted);
    ChooseShifts(chain, wanted, one);
    // Half a turn of the last joint reverses the two before it: of equals, what is nearest to now.
    for (std::size_t k = 0; k < kMountJoints; ++k) {
      one.cost += kShiftCost * one.shifts[k] * one.shifts[k] + (one.signs[k] < 0 ? kFlipCost : 0);
    }
    if (one.cost < best.cost) best = one;
  }
  return best;
}

absl::Status CheckData(const CalibrationData& data) {
  if (data.pictures.size() < kLeastPictures) {
    return Bad(absl::StrCat(
        "the camera was tracked in only ", data.pictures.size(), " pictures, ", kLeastPictures,
        " are needed; give it a scene with texture and light, and stand still"));
  }
  if (data.readings.size() < kLeastReadings) {
    return Bad(absl::StrCat("the encoders gave only ", data.readings.size(),
                            " readings; see what the mount's status says"));
  }
  return absl::OkStatus();
}

/// Pictures that the readings cover whatever the delay turns out to be.
std::vector<CalibrationData::Picture> Covered(const CalibrationData& data,
                                              const AngleTrack& track) {
  const auto margin = static_cast<Timestamp>(1e9 * kMostDelay_s);
  std::vector<CalibrationData::Picture> covered;
  for (const CalibrationData::Picture& picture : data.pictures) {
    if (picture.time_ns - margin >= track.begin_ns() &&
        picture.time_ns + margin <= track.end_ns()) {
      covered.push_back(picture);
    }
  }
  return covered;
}

/// The base's pose that fits best to a chain otherwise given, from the picture in the middle.
void PlaceBase(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
               MountChain& chain) {
  const CalibrationData::Picture& middle = pictures[pictures.size() / 2];
  chain.world_from_mount = {};
  chain.world_from_mount =
      middle.world_from_camera * chain.WorldFromCamera(track.At(middle.time_ns)).Inverse();
}

double RmsRotation(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
                   const MountChain& chain) {
  double sum = 0;
  for (const auto& picture : pictures) sum += RotationResidual(chain, track, picture).squaredNorm();
  return std::sqrt(sum / static_cast<double>(pictures.size()));
}

/// What the model of before leaves unexplained, its base placed as well as can be.
double RmsBefore(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
                 MountChain chain, double angle_sigma_rad) {
  chain.moved.fill(false);
  PlaceBase(pictures, track, chain);
  MountChain placed = FitChain(pictures, track, chain, angle_sigma_rad, false).chain;
  placed.delay_s = 0;
  return RmsRotation(pictures, track, placed);
}

/// From Send to the motion, by which shift the readings fit the demands best. Nothing moved or
/// demanded: no answer.
std::optional<double> CommandLag(const CalibrationData& data) {
  constexpr double kStep_s = 1e-3, kLeast_s = -0.1, kMost_s = 0.5;
  const AngleTrack track(data.readings,
                         {MountJoint::kPan, MountJoint::kElevation, MountJoint::kCyclotorsion});
  double best = -1, least = 0;
  for (double lag = kLeast_s; lag < kMost_s; lag += kStep_s) {
    double cost = 0;
    std::size_t count = 0;
    for (const CalibrationData::Demand& demand : data.demands) {
      const Timestamp at = demand.time_ns + static_cast<Timestamp>(1e9 * lag);
      if (at < track.begin_ns() || at > track.end_ns()) continue;
      cost += (track.At(at) - demand.angles_rad).squaredNorm();
      ++count;
    }
    if (count < kLeastReadings) continue;
    cost /= static_cast<double>(count);
    if (best >= kLeast_s && cost >= least) continue;
    best = lag;
    least = cost;
  }
  return best < kLeast_s ? std::nullopt : std::optional<double>(best);
}

void Report(const std::vector<CalibrationData::Picture>& pictures, const AngleTrack& track,
            const MountChain& chain, bool metric, MountCalibration& result) {
  double squares = 0, position = 0;
  int inliers = 0;
  for (const auto& picture : pictures) {
    const double off = RotationResidual(chain, track, picture).norm();
    if (off > kOutlier_rad) {
      ++result.outliers;
      continue;
    }
    ++inliers;
    squares += off * off;
    result.orientation_max_rad = std::max(result.orientation_max_rad, off);
    const auto delay = static_cast<Timestamp>(std::llround(1e9 * chain.delay_s));
    const Rigid3 predicted = chain.WorldFromCamera(track.At(picture.time_ns + delay));
    position += (predicted.translation - picture.world_from_camera.translation).squaredNorm();
  }
  result.pictures = static_cast<int>(pictures.size());
  if (inliers == 0) return;
  result.orientation_rms_rad = std::sqrt(squares / inliers);
  if (metric) result.position_rms_m = std::sqrt(position / inliers);
}

/// Puts what was found into the options' own terms.
void Write(const ChainFit& fit, const Choice& choice, const MountOptions& present, bool metric,
           MountCalibration& result) {
  const auto axes = Axes(fit.chain, choice);
  const Eigen::Matrix3d last = ExpSo3(-choice.shifts[2] * choice.signs[2] * fit.chain.axes[2]);
  const Eigen::Matrix3d middle = ExpSo3(-choice.shifts[1] * choice.signs[1] * fit.chain.axes[1]);
  const std::array<Eigen::Vector3d, kMountJoints> offsets = {
      last * (middle * fit.chain.offsets[0]), last * fit.chain.offsets[1], fit.chain.offsets[2]};
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const MountJoint which = present.order[k];
    JointOptions& joint = result.mount.of(which);
    MountCalibration::Joint& found = result.joints[static_cast<std::size_t>(which)];
    found.turned_rad = std::acos(std::clamp(axes[k].dot(joint.axis), -1.0, 1.0));
    found.axis_sigma_rad = fit.axis_sigma_rad[k];
    found.sign_flipped = choice.signs[k] < 0;
    found.zero_shift_rad = choice.signs[k] * choice.shifts[k];
    joint.axis = axes[k];
    if (metric) joint.offset_m = offsets[k];
    joint.encoder_zero_rad += joint.encoder_sign * found.zero_shift_rad;
    joint.encoder_zero_rad = std::remainder(joint.encoder_zero_rad, 2 * std::numbers::pi);
    // The limits stay where the motor has them, whatever the angles are called now.
    const double shift = choice.shifts[k];
    double least = joint.min_rad, most = joint.max_rad;
    if (found.sign_flipped) {
      joint.encoder_sign = -joint.encoder_sign;
      least = -joint.max_rad;
      most = -joint.min_rad;
    }
    joint.min_rad = std::min(least - shift, -kLeastLimit_rad);
    joint.max_rad = std::max(most - shift, kLeastLimit_rad);
  }
}

}  // namespace

absl::StatusOr<MountCalibration> CalibrateMount(const CalibrationData& data,
                                                const MountOptions& present) {
  if (absl::Status enough = CheckData(data); !enough.ok()) return enough;
  const AngleTrack track(data.readings, present.order);
  const std::vector<CalibrationData::Picture> pictures = Covered(data, track);
  if (pictures.size() < kLeastPictures) {
    return Bad("pictures and readings hardly overlap in time; is the mount's clock the camera's?");
  }
  MountCalibration result;
  result.mount = present;
  MountChain start;
  const Eigen::Vector3d range = track.Range();
  std::array<Eigen::Vector3d, kMountJoints> wanted;
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const JointOptions& joint = present.of(present.order[k]);
    start.axes[k] = wanted[k] = joint.axis;
    start.offsets[k] = joint.offset_m;
    start.moved[k] = range(static_cast<Eigen::Index>(k)) > kMoved_rad;
    MountCalibration::Joint& found = result.joints[static_cast<std::size_t>(present.order[k])];
    found.moved = start.moved[k];
    found.range_rad = range(static_cast<Eigen::Index>(k));
  }
  if (range.maxCoeff() <= kMoved_rad) {
    return Bad(
        absl::StrFormat("no joint moved by more than %.1f deg; see the mount's status and "
                        "its limits",
                        range.maxCoeff() / kDegree));
  }
  result.orientation_rms_before_rad = RmsBefore(pictures, track, start, present.encoder_sigma_rad);
  GuessAxes(pictures, track, start);
  PlaceBase(pictures, track, start);
  const ChainFit fit = FitChain(pictures, track, start, present.encoder_sigma_rad, data.metric);
  Report(pictures, track, fit.chain, data.metric, result);
  if (result.outliers > kMostOutliers * result.pictures ||
      result.orientation_rms_rad > kWorstRms_rad) {
    return Bad(absl::StrFormat(
        "the camera does not turn as the encoders say: %.1f deg RMS, %d of %d pictures off by more "
        "than 2 deg; keep the mount's base still, and check that tracking is good",
        result.orientation_rms_rad / kDegree, result.outliers, result.pictures));
  }
  if (std::abs(fit.chain.delay_s) > kMostDelay_s) {
    return Bad(absl::StrFormat("the encoders seem to be %.0f ms late; check the camera's clock",
                               1e3 * fit.chain.delay_s));
  }
  Write(fit, Choose(fit.chain, wanted), present, data.metric, result);
  result.mount.encoder_delay_s += fit.chain.delay_s;
  result.encoder_delay_s = result.mount.encoder_delay_s;
  result.encoder_delay_sigma_s = fit.delay_sigma_s;
  if (const std::optional<double> lag = CommandLag(data)) {
    // The readings' stamps are late by the delay.
    result.mount.command_latency_s = std::clamp(*lag - fit.chain.delay_s, 0.0, 0.5);
  }
  result.command_latency_s = result.mount.command_latency_s;
  if (absl::Status valid = result.mount.Validate(); !valid.ok()) return valid;
  return result;
}

}  // namespace saccade
