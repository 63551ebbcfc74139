#include "server/mount/drivers/v4l2_head.hpp"

#include <absl/strings/str_cat.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

#include "server/mount/fixed_joint.hpp"
#include "shared/geometry/angle.hpp"
#include "shared/io/option_table.hpp"
#include "shared/io/toml_table.hpp"

namespace saccade {
namespace {

constexpr double kArcSecond = kDegree / 3600.0;  // unit of the absolute controls

const OptionTable<V4l2Options>& Table() {
  using O = V4l2Options;
  static const OptionTable<O> table = {
      {"update_hz", &O::update_hz, 1, 200, "commands a second: each is a USB control transfer"},
      {"read_back", &O::read_back, 0, 1, "believe what the camera says of its position"},
      {"relative_unit_deg", &O::relative_unit_deg, 1e-4, 10,
       "what a unit of relative controls turns"},
      {"reckoned_sigma_deg", &O::reckoned_sigma_deg, 0, 10, "of a reckoned angle"},
      {"zoom", &O::zoom, -1, 1, "of the range, set once at the start; -1: left alone"},
      {"retry_ms", &O::retry_s, 5, 60'000, "between attempts to connect, doubled up to", 1e-3},
      {"max_retry_ms", &O::max_retry_s, 5, 60'000, "that", 1e-3},
  };
  return table;
}

}  // namespace

absl::Status V4l2Options::Validate() const {
  if (zoom != -1 && !(zoom >= 0 && zoom <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("v4l2.zoom: ", zoom, "; give a number from 0 to 1, or leave it out"));
  }
  if (absl::Status valid = Table().Validate(*this, "v4l2."); !valid.ok()) return valid;
  return CheckRange("v4l2.max_retry_ms", 1e3 * max_retry_s, 1e3 * retry_s, 60'000);
}

std::string V4l2Options::Describe() {
  return absl::StrCat("[v4l2]\n", Table().Describe(V4l2Options()));
}

absl::Status V4l2Options::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(
      file, "v4l2", [](TomlTable& table, V4l2Options& options) { Table().Read(table, options); },
      *this);
}

absl::StatusOr<std::unique_ptr<V4l2Head>> V4l2Head::Open(const V4l2Options& options,
                                                         const MountOptions& mount,
                                                         std::unique_ptr<VideoDevice> device) {
  std::unique_ptr<V4l2Head> head(new V4l2Head(options, mount, std::move(device)));
  absl::Status found = head->FindAxis(MountJoint::kPan, V4L2_CID_PAN_ABSOLUTE,
                                      V4L2_CID_PAN_RELATIVE, V4L2_CID_PAN_RESET);
  if (!found.ok()) return found;
  found = head->FindAxis(MountJoint::kElevation, V4L2_CID_TILT_ABSOLUTE, V4L2_CID_TILT_RELATIVE,
                         V4L2_CID_TILT_RESET);
  if (!found.ok()) return found;
  FixJoint(head->mount_.of(MountJoint::kCyclotorsion));
  if (!head->axes_[0] && !head->axes_[1]) {
    return absl::FailedPreconditionError(
        absl::StrCat(options.device,
                     ": this camera can neither pan nor tilt; use crop: to steer a part of its "
                     "picture instead"));
  }
  if (!options.read_back) {
    head->mount_.encoder_sigma_rad =
        std::max(head->mount_.encoder_sigma_rad, options.reckoned_sigma_deg * kDegree);
  }
  if (options.zoom >= 0) {
    if (absl::Status zoomed = head->SetZoom(options.zoom); !zoomed.ok()) return zoomed;
  }
  return head;
}

absl::Status V4l2Head::FindAxis(MountJoint joint, std::uint32_t absolute, std::uint32_t relative,
                                std::uint32_t reset) {
  std::optional<Axis>& axis = axes_[static_cast<std::size_t>(joint)];
  for (const std::uint32_t id : {absolute, relative}) {
    const absl::StatusOr<std::optional<V4l2Controls::Range>> range = controls_.Query(id);
    if (!range.ok()) return range.status();
    if (!range->has_value() || (*range)->most <= (*range)->least) continue;
    axis = Axis{.absolute = id == absolute,
                .id = id,
                .range = **range,
                .unit_rad = id == absolute ? kArcSecond : options_.relative_unit_deg * kDegree,
                .sent = std::nullopt};
    break;
  }
  JointOptions& options = mount_.of(joint);
  if (!axis) {
    FixJoint(options);
    return absl::OkStatus();
  }
  if (axis->absolute) {
    Narrow(options, *axis);
    const absl::StatusOr<std::int32_t> now = controls_.Get(axis->id);
    if (absl::IsUnavailable(now.status())) return now.status();
    if (now.ok()) angles_rad_(static_cast<int>(joint)) = options.FromRaw(*now * axis->unit_rad);
    return absl::OkStatus();
  }
  // Steps are counted from where a reset leaves it; without one from where it happens to be.
  axis->sent = 0;
  const absl::StatusOr<std::optional<V4l2Controls::Range>> has_reset = controls_.Query(reset);
  if (!has_reset.ok()) return has_reset.status();
  return has_reset->has_value() ? controls_.Set({{reset, 1}}) : absl::OkStatus();
}

void V4l2Head::Narrow(JointOptions& joint, const Axis& axis) const {
  const double one = joint.FromRaw(axis.range.least * axis.unit_rad);
  const double other = joint.FromRaw(axis.range.most * axis.unit_rad);
  joint.min_rad = std::clamp(std::min(one, other), joint.min_rad, 0.0);
  joint.max_rad = std::clamp(std::max(one, other), 0.0, joint.max_rad);
}

std::int32_t V4l2Head::ValueFor(const JointOptions& joint, const Axis& axis,
                                double angle_rad) const {
  const double raw = joint.ToRaw(std::clamp(angle_rad, joint.min_rad, joint.max_rad));
  if (!axis.absolute) return static_cast<std::int32_t>(std::lround(raw / axis.unit_rad));
  const double steps = (raw / axis.unit_rad - axis.range.least) / axis.range.step;
  const double last =
      std::floor((static_cast<double>(axis.range.most) - axis.range.least) / axis.range.step);
  const double step = std::clamp(std::round(steps), 0.0, last);
  return static_cast<std::int32_t>(axis.range.least + step * axis.range.step);
}

absl::Status V4l2Head::Observe(Timestamp now_ns) {
  const double dt = last_ns_ ? Seconds(now_ns - *last_ns_) : 0.0;
  last_ns_ = now_ns;
  for (int k = 0; k < kMountJoints; ++k) {
    const std::optional<Axis>& axis = axes_[static_cast<std::size_t>(k)];
    if (!axis) continue;
    const JointOptions& joint = mount_.joints[static_cast<std::size_t>(k)];
    if (options_.read_back && axis->absolute) {
      const absl::StatusOr<std::int32_t> read = controls_.Get(axis->id);
      if (!read.ok()) return read.status();
      angles_rad_(k) = joint.FromRaw(*read * axis->unit_rad);
    } else if (axis->sent) {
      const double most = joint.max_rate_rad_s * dt;
      const double goal = joint.FromRaw(*axis->sent * axis->unit_rad);
      angles_rad_(k) += std::clamp(goal - angles_rad_(k), -most, most);
    }
  }
  return absl::OkStatus();
}

absl::Status V4l2Head::Step(Timestamp now_ns, const Eigen::Vector3d& angles_rad) {
  if (absl::Status seen = Observe(now_ns); !seen.ok()) return seen;
  std::vector<V4l2Controls::Value> values;
  std::array<std::optional<std::int32_t>, kMountJoints> sent;
  for (int k = 0; k < kMountJoints; ++k) {
    const std::optional<Axis>& axis = axes_[static_cast<std::size_t>(k)];
    if (!axis) continue;
    const std::int32_t value =
        ValueFor(mount_.joints[static_cast<std::size_t>(k)], *axis, angles_rad(k));
    if (axis->sent && *axis->sent == value) continue;
    if (axis->absolute) {
      sent[static_cast<std::size_t>(k)] = value;
      values.push_back({axis->id, value});
      continue;
    }
    const std::int32_t by = std::clamp(value - *axis->sent, axis->range.least, axis->range.most);
    sent[static_cast<std::size_t>(k)] = *axis->sent + by;
    values.push_back({axis->id, by});
  }
  if (values.empty()) {  // or nobody would notice that the camera is gone
    const std::uint32_t any = axes_[0] ? axes_[0]->id : axes_[1]->id;
    return controls_.Query(any).status();
  }
  if (absl::Status set = controls_.Set(values); !set.ok()) return set;
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    if (sent[k]) axes_[k]->sent = sent[k];
  }
  return absl::OkStatus();
}

absl::Status V4l2Head::SetZoom(double share) {
  const absl::StatusOr<std::optional<V4l2Controls::Range>> range =
      controls_.Query(V4L2_CID_ZOOM_ABSOLUTE);
  if (!range.ok()) return range.status();
  if (!range->has_value()) {
    return absl::FailedPreconditionError(
        absl::StrCat("v4l2.zoom: ", options_.device, " has no zoom; leave it out"));
  }
  const double width = static_cast<double>((*range)->most) - (*range)->least;
  const double steps = std::round(std::clamp(share, 0.0, 1.0) * width / (*range)->step);
  const auto value = static_cast<std::int32_t>((*range)->least + steps * (*range)->step);
  return controls_.Set({{V4L2_CID_ZOOM_ABSOLUTE, std::min(value, (*range)->most)}});
}

}  // namespace saccade
