#include "server/mount/mount_options.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "server/mount/toml_table.hpp"

namespace saccade {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr const char* kNames[] = {"pan", "elevation", "cyclotorsion"};
constexpr double kMaxOffset_m = 1.0;

absl::Status Bad(const std::string& field, const std::string& value, const std::string& remedy) {
  return absl::InvalidArgumentError(absl::StrCat("mount_model.", field, ": ", value, "; ", remedy));
}

absl::Status InRange(const std::string& field, double value, double least, double most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return Bad(field, absl::StrCat(value), absl::StrCat("give a number from ", least, " to ", most));
}

absl::Status ValidateJoint(const std::string& name, const JointOptions& joint) {
  if (!(std::abs(joint.axis.norm() - 1.0) < 1e-6)) {
    return Bad(name + ".axis", absl::StrCat("length ", joint.axis.norm()), "give a unit vector");
  }
  if (!(joint.offset_m.norm() <= kMaxOffset_m)) {
    return Bad(name + ".offset_m", absl::StrCat("length ", joint.offset_m.norm(), " m"),
               absl::StrCat("give metres, at most ", kMaxOffset_m));
  }
  if (joint.encoder_sign != 1 && joint.encoder_sign != -1) {
    return Bad(name + ".encoder_sign", absl::StrCat(joint.encoder_sign), "give 1 or -1");
  }
  if (!(joint.min_rad < joint.max_rad)) {
    return Bad(name + ".min_deg", absl::StrCat(joint.min_rad / kDegree),
               absl::StrCat("give less than max_deg, which is ", joint.max_rad / kDegree));
  }
  for (const absl::Status& status :
       {InRange(name + ".min_deg", joint.min_rad / kDegree, -720, 0),
        InRange(name + ".max_deg", joint.max_rad / kDegree, 0, 720),
        InRange(name + ".max_rate_deg_s", joint.max_rate_rad_s / kDegree, 1, 3600),
        InRange(name + ".max_acceleration_deg_s2", joint.max_acceleration_rad_s2 / kDegree, 10,
                1e6),
        InRange(name + ".encoder_zero_deg", joint.encoder_zero_rad / kDegree, -360, 360)}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void ReadOrder(TomlTable& table, MountOptions& options) {
  std::vector<std::string> names(options.order.size());
  for (std::size_t k = 0; k < names.size(); ++k) names[k] = ToString(options.order[k]);
  table.Texts("order", names);
  bool known = names.size() == options.order.size();
  for (std::size_t k = 0; known && k < names.size(); ++k) {
    const auto found = std::find(std::begin(kNames), std::end(kNames), names[k]);
    known = found != std::end(kNames);
    if (known) options.order[k] = static_cast<MountJoint>(found - std::begin(kNames));
  }
  if (!known) {
    table.Say("order", "give pan, elevation and cyclotorsion, each once, from the base outwards");
  }
}

void ReadJoint(TomlTable& table, JointOptions& joint) {
  table.Vector("axis", joint.axis);
  if (joint.axis.norm() > 0) joint.axis.normalize();
  table.Vector("offset_m", joint.offset_m);
  table.Number("min_deg", kDegree, joint.min_rad);
  table.Number("max_deg", kDegree, joint.max_rad);
  table.Number("max_rate_deg_s", kDegree, joint.max_rate_rad_s);
  table.Number("max_acceleration_deg_s2", kDegree, joint.max_acceleration_rad_s2);
  double sign = joint.encoder_sign;
  table.Number("encoder_sign", 1.0, sign);
  joint.encoder_sign = std::abs(sign) == 1.0 ? static_cast<int>(sign) : 0;
  table.Number("encoder_zero_deg", kDegree, joint.encoder_zero_rad);
  table.Finish().IgnoreError();  // kept by the file
}

void ReadMount(TomlTable& table, MountOptions& options) {
  ReadOrder(table, options);
  table.Number("encoder_sigma_deg", kDegree, options.encoder_sigma_rad);
  table.Number("encoder_delay_ms", 1e-3, options.encoder_delay_s);
  table.Number("command_latency_ms", 1e-3, options.command_latency_s);
  for (int k = 0; k < kMountJoints; ++k) {
    if (std::optional<TomlTable> joint = table.Table(kNames[k])) {
      ReadJoint(*joint, options.of(static_cast<MountJoint>(k)));
    }
  }
}

}  // namespace

const char* ToString(MountJoint joint) { return kNames[static_cast<int>(joint)]; }

std::array<JointOptions, kMountJoints> MountOptions::DefaultJoints() {
  std::array<JointOptions, kMountJoints> joints;
  joints[0].axis = Eigen::Vector3d::UnitY();
  // One turn each way: a target is held past the wearer's back while he turns round.
  joints[0].min_rad = -360 * kDegree;
  joints[0].max_rad = 360 * kDegree;
  joints[1].axis = Eigen::Vector3d::UnitX();
  joints[1].min_rad = -80 * kDegree;
  joints[1].max_rad = 80 * kDegree;
  joints[2].axis = Eigen::Vector3d::UnitZ();
  joints[2].min_rad = -50 * kDegree;
  joints[2].max_rad = 50 * kDegree;
  return joints;
}

absl::Status MountOptions::Validate() const {
  std::set<MountJoint> once(order.begin(), order.end());
  if (once.size() != kMountJoints) {
    return Bad("order", "a joint twice", "give pan, elevation and cyclotorsion, each once");
  }
  for (int k = 0; k < kMountJoints; ++k) {
    const absl::Status status = ValidateJoint(kNames[k], joints[static_cast<std::size_t>(k)]);
    if (!status.ok()) return status;
  }
  const absl::Status sigma = InRange("encoder_sigma_deg", encoder_sigma_rad / kDegree, 0, 10);
  if (!sigma.ok()) return sigma;
  const absl::Status delay = InRange("encoder_delay_ms", 1e3 * encoder_delay_s, -500, 500);
  if (!delay.ok()) return delay;
  return InRange("command_latency_ms", 1e3 * command_latency_s, 0, 500);
}

absl::Status MountOptions::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(file, "mount_model", ReadMount, *this);
}

}  // namespace saccade
