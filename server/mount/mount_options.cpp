#include "server/mount/mount_options.hpp"

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <cmath>
#include <set>
#include <toml.hpp>

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

/// Reads keys out of one table and remembers which are left. The first problem is kept.
class TableReader {
 public:
  TableReader(const toml::value& table, std::string prefix)
      : table_(table), prefix_(std::move(prefix)) {
    for (const auto& [key, value] : table.as_table()) left_.insert(key);
  }

  void Number(const std::string& key, double scale, double& out) {
    if (const toml::value* value = Take(key)) Read(*value, key, scale, out);
  }
  void Sign(const std::string& key, int& out) {
    double number = out;
    Number(key, 1.0, number);
    out = number == 1.0 || number == -1.0 ? static_cast<int>(number) : 0;
  }
  void Vector(const std::string& key, Eigen::Vector3d& out) {
    const toml::value* value = Take(key);
    if (value == nullptr) return;
    if (!value->is_array() || value->as_array().size() != 3) {
      return Say(key, "is not three numbers; give for example [0.0, 0.02, 0.0]");
    }
    for (std::size_t k = 0; k < 3; ++k) {
      Read(value->as_array()[k], key, 1.0, out(static_cast<Eigen::Index>(k)));
    }
  }
  const toml::value* Take(const std::string& key) {
    return left_.erase(key) > 0 ? &table_.at(key) : nullptr;
  }
  void Say(const std::string& key, const std::string& problem) {
    if (status_.ok()) {
      status_ = absl::InvalidArgumentError(absl::StrCat(prefix_, ".", key, ": ", problem));
    }
  }
  absl::Status Finish(const char* known) {
    if (!left_.empty()) Say(*left_.begin(), absl::StrCat("unknown key; known: ", known));
    return status_;
  }

 private:
  void Read(const toml::value& value, const std::string& key, double scale, double& out) {
    if (value.is_floating()) {
      out = scale * value.as_floating();
    } else if (value.is_integer()) {
      out = scale * static_cast<double>(value.as_integer());
    } else {
      Say(key, "is not a number");
    }
  }

  const toml::value& table_;
  const std::string prefix_;
  std::set<std::string> left_;
  absl::Status status_;
};

absl::StatusOr<MountJoint> JointNamed(const toml::value& value) {
  for (int k = 0; k < kMountJoints; ++k) {
    if (value.is_string() && value.as_string().str == kNames[k]) return static_cast<MountJoint>(k);
  }
  return absl::InvalidArgumentError(
      "mount_model.order: give pan, elevation and cyclotorsion, each once, from the base outwards");
}

absl::Status ReadOrder(const toml::value& value, MountOptions& options) {
  if (!value.is_array() || value.as_array().size() != kMountJoints) {
    return absl::InvalidArgumentError("mount_model.order: give a list of three joint names");
  }
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    const absl::StatusOr<MountJoint> joint = JointNamed(value.as_array()[k]);
    if (!joint.ok()) return joint.status();
    options.order[k] = *joint;
  }
  return absl::OkStatus();
}

absl::Status ReadJoint(const toml::value& table, const std::string& name, JointOptions& joint) {
  TableReader reader(table, "mount_model." + name);
  reader.Vector("axis", joint.axis);
  if (joint.axis.norm() > 0) joint.axis.normalize();
  reader.Vector("offset_m", joint.offset_m);
  reader.Number("min_deg", kDegree, joint.min_rad);
  reader.Number("max_deg", kDegree, joint.max_rad);
  reader.Number("max_rate_deg_s", kDegree, joint.max_rate_rad_s);
  reader.Number("max_acceleration_deg_s2", kDegree, joint.max_acceleration_rad_s2);
  reader.Sign("encoder_sign", joint.encoder_sign);
  reader.Number("encoder_zero_deg", kDegree, joint.encoder_zero_rad);
  return reader.Finish(
      "axis, offset_m, min_deg, max_deg, max_rate_deg_s, max_acceleration_deg_s2, encoder_sign, "
      "encoder_zero_deg");
}

absl::Status ReadMount(const toml::value& table, MountOptions& options) {
  TableReader reader(table, "mount_model");
  if (const toml::value* order = reader.Take("order")) {
    if (const absl::Status status = ReadOrder(*order, options); !status.ok()) return status;
  }
  reader.Number("encoder_sigma_deg", kDegree, options.encoder_sigma_rad);
  reader.Number("command_latency_ms", 1e-3, options.command_latency_s);
  for (int k = 0; k < kMountJoints; ++k) {
    const toml::value* joint = reader.Take(kNames[k]);
    if (joint == nullptr) continue;
    if (!joint->is_table()) {
      reader.Say(kNames[k], "is not a table");
      continue;
    }
    const absl::Status status =
        ReadJoint(*joint, kNames[k], options.of(static_cast<MountJoint>(k)));
    if (!status.ok()) return status;
  }
  return reader.Finish(
      "order, encoder_sigma_deg, command_latency_ms, and the tables pan, elevation, cyclotorsion");
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
  return InRange("command_latency_ms", 1e3 * command_latency_s, 0, 500);
}

absl::Status MountOptions::LoadToml(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return absl::NotFoundError(absl::StrCat(file.string(), ": no such file; give one that exists"));
  }
  MountOptions read = *this;
  try {
    const toml::value root = toml::parse(file.string());
    if (!root.contains("mount_model")) return absl::OkStatus();
    if (!root.at("mount_model").is_table()) {
      return absl::InvalidArgumentError(
          absl::StrCat(file.string(), ": mount_model is not a table"));
    }
    absl::Status status = ReadMount(root.at("mount_model"), read);
    if (status.ok()) status = read.Validate();
    if (!status.ok()) {
      return absl::Status(status.code(), absl::StrCat(file.string(), ": ", status.message()));
    }
  } catch (const std::exception& problem) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", problem.what()));
  }
  *this = read;
  return absl::OkStatus();
}

}  // namespace saccade
