#include "server/mount/mount_options.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "shared/geometry/angle.hpp"
#include "shared/io/option_table.hpp"
#include "shared/io/toml_table.hpp"

namespace saccade {
namespace {

constexpr const char* kNames[] = {"pan", "elevation", "cyclotorsion"};
constexpr double kMaxOffset_m = 1.0;

const OptionTable<JointOptions>& JointTable() {
  using O = JointOptions;
  static const OptionTable<O> table = {
      {"axis", &O::axis, 0, 0, "that it turns about, right-handed, in the link before it"},
      {"offset_m", &O::offset_m, 0, 0, "from this axis to the next, or to the optic centre"},
      {"min_deg", &O::min_rad, -720, 0, "limit", kDegree},
      {"max_deg", &O::max_rad, 0, 720, "limit", kDegree},
      {"max_rate_deg_s", &O::max_rate_rad_s, 1, 3600, "of the motor", kDegree},
      {"max_acceleration_deg_s2", &O::max_acceleration_rad_s2, 10, 1e6, "of the motor", kDegree},
      {"encoder_sign", &O::encoder_sign, -1, 1, "raw = sign * angle + zero; 1 or -1"},
      {"encoder_zero_deg", &O::encoder_zero_rad, -360, 360, "raw angle at zero", kDegree},
  };
  return table;
}

const OptionTable<MountOptions>& MountTable() {
  using O = MountOptions;
  static const OptionTable<O> table = {
      {"encoder_sigma_deg", &O::encoder_sigma_rad, 0, 10, "of one reading", kDegree},
      {"encoder_delay_ms", &O::encoder_delay_s, -500, 500,
       "time stamps of readings against those of pictures; drivers take it off", 1e-3},
      {"command_latency_ms", &O::command_latency_s, 0, 500, "from command to first motion", 1e-3},
  };
  return table;
}

absl::Status Bad(const std::string& field, const std::string& value, const std::string& remedy) {
  return absl::InvalidArgumentError(absl::StrCat("mount_model.", field, ": ", value, "; ", remedy));
}

// What a range of one number cannot say.
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
  return JointTable().Validate(joint, absl::StrCat("mount_model.", name, "."));
}

std::string OrderLine(const MountOptions& options) {
  return absl::StrFormat("order = [\"%s\", \"%s\", \"%s\"]", ToString(options.order[0]),
                         ToString(options.order[1]), ToString(options.order[2]));
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

void ReadMount(TomlTable& table, MountOptions& options) {
  ReadOrder(table, options);
  MountTable().Read(table, options);
  for (int k = 0; k < kMountJoints; ++k) {
    if (std::optional<TomlTable> joint = table.Table(kNames[k])) {
      JointOptions& out = options.of(static_cast<MountJoint>(k));
      JointTable().Read(*joint, out);
      if (out.axis.norm() > 0) out.axis.normalize();
      joint->Finish().IgnoreError();  // kept by the file
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
  return MountTable().Validate(*this, "mount_model.");
}

absl::Status MountOptions::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(file, "mount_model", ReadMount, *this);
}

std::string ToToml(const MountOptions& options) {
  std::string text =
      absl::StrCat("[mount_model]\n", OrderLine(options), "\n", MountTable().ToToml(options));
  for (const MountJoint which : options.order) {
    absl::StrAppend(&text, "\n[mount_model.", ToString(which), "]\n",
                    JointTable().ToToml(options.of(which)));
  }
  return text;
}

std::string MountOptions::Describe() {
  const MountOptions defaults;
  std::string text =
      absl::StrCat("[mount_model]\n",
                   absl::StrFormat("%-44s # %s\n", OrderLine(defaults), "from the base outwards"),
                   MountTable().Describe(defaults));
  for (const MountJoint which : defaults.order) {
    absl::StrAppend(&text, "[mount_model.", ToString(which), "]\n",
                    JointTable().Describe(defaults.of(which)));
  }
  return text;
}

}  // namespace saccade
