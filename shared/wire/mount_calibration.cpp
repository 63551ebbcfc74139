#include <absl/strings/str_cat.h>

#include <cmath>

#include "shared/wire/gaze.hpp"

namespace saccade::wire {

v1::MountCalibration ToProto(const MountCalibrationReport& report) {
  v1::MountCalibration message;
  message.set_running(report.running);
  message.set_share(report.share);
  message.set_problem(report.problem);
  message.set_toml(report.toml);
  for (const MountCalibrationReport::Joint& joint : report.joints) {
    v1::MountCalibration::Joint& out = *message.add_joints();
    out.set_name(joint.name);
    out.set_moved(joint.moved);
    out.set_range_rad(joint.range_rad);
    out.set_turned_rad(joint.turned_rad);
    out.set_axis_sigma_rad(joint.axis_sigma_rad);
    out.set_sign_flipped(joint.sign_flipped);
    out.set_zero_shift_rad(joint.zero_shift_rad);
  }
  message.set_orientation_rms_before_rad(report.orientation_rms_before_rad);
  message.set_orientation_rms_rad(report.orientation_rms_rad);
  message.set_orientation_max_rad(report.orientation_max_rad);
  message.set_position_rms_m(report.position_rms_m);
  message.set_encoder_delay_s(report.encoder_delay_s);
  message.set_command_latency_s(report.command_latency_s);
  message.set_pictures(static_cast<std::uint32_t>(report.pictures));
  message.set_outliers(static_cast<std::uint32_t>(report.outliers));
  return message;
}

absl::StatusOr<MountCalibrationReport> FromProto(const v1::MountCalibration& message,
                                                 absl::string_view field) {
  MountCalibrationReport report;
  report.running = message.running();
  report.share = message.share();
  report.problem = message.problem();
  report.toml = message.toml();
  for (const v1::MountCalibration::Joint& joint : message.joints()) {
    report.joints.push_back({.name = joint.name(),
                             .moved = joint.moved(),
                             .range_rad = joint.range_rad(),
                             .turned_rad = joint.turned_rad(),
                             .axis_sigma_rad = joint.axis_sigma_rad(),
                             .sign_flipped = joint.sign_flipped(),
                             .zero_shift_rad = joint.zero_shift_rad()});
  }
  report.orientation_rms_before_rad = message.orientation_rms_before_rad();
  report.orientation_rms_rad = message.orientation_rms_rad();
  report.orientation_max_rad = message.orientation_max_rad();
  report.position_rms_m = message.position_rms_m();
  report.encoder_delay_s = message.encoder_delay_s();
  report.command_latency_s = message.command_latency_s();
  report.pictures = static_cast<int>(message.pictures());
  report.outliers = static_cast<int>(message.outliers());
  for (const double number :
       {report.share, report.orientation_rms_before_rad, report.orientation_rms_rad,
        report.orientation_max_rad, report.position_rms_m, report.encoder_delay_s,
        report.command_latency_s}) {
    if (std::isfinite(number)) continue;
    return absl::InvalidArgumentError(absl::StrCat(field, ": its numbers must be finite"));
  }
  return report;
}

}  // namespace saccade::wire
