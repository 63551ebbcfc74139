#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include "client/cli/text.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade::cli {
namespace {}  // namespace

nlohmann::json ToJson(const MountCalibrationReport& report) {
  nlohmann::json joints = nlohmann::json::array();
  for (const MountCalibrationReport::Joint& joint : report.joints) {
    joints.push_back({{"name", joint.name},
                      {"moved", joint.moved},
                      {"range_rad", joint.range_rad},
                      {"turned_rad", joint.turned_rad},
                      {"axis_sigma_rad", joint.axis_sigma_rad},
                      {"sign_flipped", joint.sign_flipped},
                      {"zero_shift_rad", joint.zero_shift_rad}});
  }
  return {{"running", report.running},
          {"share", report.share},
          {"problem", report.problem},
          {"joints", std::move(joints)},
          {"orientation_rms_before_rad", report.orientation_rms_before_rad},
          {"orientation_rms_rad", report.orientation_rms_rad},
          {"orientation_max_rad", report.orientation_max_rad},
          {"position_rms_m", report.position_rms_m},
          {"encoder_delay_s", report.encoder_delay_s},
          {"command_latency_s", report.command_latency_s},
          {"pictures", report.pictures},
          {"outliers", report.outliers},
          {"toml", report.toml}};
}

std::string CalibrationText(const MountCalibrationReport& report) {
  std::vector<std::vector<std::string>> rows = {
      {"joint", "moved", "axis turned", "sigma", "encoder", "zero shifted"}};
  for (const MountCalibrationReport::Joint& joint : report.joints) {
    if (!joint.moved) {
      rows.push_back({joint.name, "no", "", "", "", ""});
      continue;
    }
    rows.push_back({joint.name, absl::StrFormat("%.1f deg", joint.range_rad / kDegree),
                    absl::StrFormat("%.2f deg", joint.turned_rad / kDegree),
                    absl::StrFormat("%.3f deg", joint.axis_sigma_rad / kDegree),
                    joint.sign_flipped ? "reversed" : "as it was",
                    absl::StrFormat("%+.2f deg", joint.zero_shift_rad / kDegree + 1e-9)});
  }
  std::string text = Table(rows);
  absl::StrAppend(
      &text,
      absl::StrFormat("orientation: %.2f deg RMS off before, %.2f deg now, at most %.2f deg\n",
                      report.orientation_rms_before_rad / kDegree,
                      report.orientation_rms_rad / kDegree, report.orientation_max_rad / kDegree));
  if (report.position_rms_m > 0) {
    absl::StrAppend(&text, absl::StrFormat("position: %.1f mm RMS\n", 1e3 * report.position_rms_m));
  }
  absl::StrAppend(&text,
                  absl::StrFormat("encoders: %.1f ms late; command to motion: %.1f ms\n"
                                  "pictures: %d, of which %d left out\n",
                                  1e3 * report.encoder_delay_s, 1e3 * report.command_latency_s,
                                  report.pictures, report.outliers));
  return text;
}

}  // namespace saccade::cli
