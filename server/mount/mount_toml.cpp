#include "server/mount/mount_toml.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

namespace saccade {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::string Number(double value) {
  std::string text = absl::StrFormat("%.12g", value);
  // TOML tells integers from floats; either is read, but one kind looks better.
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string Vector(const Eigen::Vector3d& v) {
  return absl::StrCat("[", Number(v.x()), ", ", Number(v.y()), ", ", Number(v.z()), "]");
}

}  // namespace

std::string ToToml(const MountOptions& options) {
  std::string text = absl::StrFormat("[mount_model]\norder = [\"%s\", \"%s\", \"%s\"]\n",
                                     ToString(options.order[0]), ToString(options.order[1]),
                                     ToString(options.order[2]));
  const auto add = [&text](const char* key, const std::string& value) {
    absl::StrAppend(&text, key, " = ", value, "\n");
  };
  add("encoder_sigma_deg", Number(options.encoder_sigma_rad / kDegree));
  add("encoder_delay_ms", Number(1e3 * options.encoder_delay_s));
  add("command_latency_ms", Number(1e3 * options.command_latency_s));
  for (const MountJoint which : options.order) {
    const JointOptions& joint = options.of(which);
    absl::StrAppend(&text, "\n[mount_model.", ToString(which), "]\n");
    add("axis", Vector(joint.axis));
    add("offset_m", Vector(joint.offset_m));
    add("min_deg", Number(joint.min_rad / kDegree));
    add("max_deg", Number(joint.max_rad / kDegree));
    add("max_rate_deg_s", Number(joint.max_rate_rad_s / kDegree));
    add("max_acceleration_deg_s2", Number(joint.max_acceleration_rad_s2 / kDegree));
    add("encoder_sign", absl::StrCat(joint.encoder_sign));
    add("encoder_zero_deg", Number(joint.encoder_zero_rad / kDegree));
  }
  return text;
}

}  // namespace saccade
