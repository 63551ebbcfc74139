#include "server/capture/target_file.hpp"

#include <absl/strings/str_cat.h>

#include <set>

#include "server/capture/image_file.hpp"
#include "server/capture/yaml_reader.hpp"

namespace saccade {
namespace {

constexpr int kMinTemplate_px = 5;
constexpr int kMaxTemplate_px = 101;

// Wide enough for any place that can be walked through; beyond it is a slip of the pen.
constexpr YamlReader::Range kPlace_m{-1e4, 1e4};
constexpr YamlReader::Range kSpeed{-1e3, 1e3};
constexpr YamlReader::Range kSigma{0.0, 1e3};
constexpr YamlReader::Range kPixel{-1e5, 1e5};

Eigen::Vector3d ToVector(const std::vector<double>& numbers) {
  return numbers.size() == 3 ? Eigen::Vector3d(numbers[0], numbers[1], numbers[2])
                             : Eigen::Vector3d::Zero();
}

absl::Status ReadTemplate(const std::filesystem::path& file, cv::Mat* templ) {
  absl::StatusOr<DecodedPicture> picture = LoadPicture(file);
  if (!picture.ok()) return picture.status();
  *templ = picture->grey;
  const int side = templ->cols;
  if (templ->rows != side || side % 2 == 0 || side < kMinTemplate_px || side > kMaxTemplate_px) {
    return absl::InvalidArgumentError(absl::StrCat(
        file.string(), ": template is ", templ->cols, "x", templ->rows,
        "; it must be a square with an odd side from ", kMinTemplate_px, " to ", kMaxTemplate_px));
  }
  return absl::OkStatus();
}

absl::StatusOr<Target> ReadPatches(const std::filesystem::path& file, YamlReader& yaml) {
  yaml.AllowOnly({"type", "points"});
  PatchTarget target;
  std::set<int> ids;
  for (YamlReader& entry : yaml.Maps("points")) {
    entry.AllowOnly({"id", "point_in_world_m", "template"});
    KnownPatch patch;
    patch.id = entry.Integer("id", 0, 1'000'000);
    patch.point_in_world = ToVector(entry.Numbers("point_in_world_m", 3, false, kPlace_m));
    const std::string name = entry.Text("template");
    if (entry.ok() && !ids.insert(patch.id).second) {
      entry.Fail("id", absl::StrCat(patch.id, " occurs twice; number the points differently"));
    }
    if (!entry.ok()) return entry.status();
    const absl::Status read = ReadTemplate(file.parent_path() / name, &patch.templ);
    if (!read.ok()) {
      entry.Fail("template", read.message());
      return entry.status();
    }
    target.points.push_back(std::move(patch));
  }
  if (yaml.ok() && target.points.empty()) yaml.Fail("points", "is empty; list at least one point");
  if (!yaml.ok()) return yaml.status();
  return target;
}

absl::StatusOr<Target> ReadChessboard(YamlReader& yaml) {
  yaml.AllowOnly({"type", "columns", "rows", "square_m", "hint_px"});
  ChessboardTarget target;
  target.columns = yaml.Integer("columns", 3, 100);
  target.rows = yaml.Integer("rows", 3, 100);
  target.square_m = yaml.Number("square_m", {1e-4, 10.0});
  if (yaml.Has("hint_px")) {
    const std::vector<double> hint = yaml.Numbers("hint_px", 6, false, kPixel);
    if (yaml.ok()) {
      target.hint_px = {Eigen::Vector2d(hint[0], hint[1]), Eigen::Vector2d(hint[2], hint[3]),
                        Eigen::Vector2d(hint[4], hint[5])};
    }
  }
  if (!yaml.ok()) return yaml.status();
  return target;
}

}  // namespace

absl::StatusOr<Target> LoadTarget(const std::filesystem::path& file) {
  YamlReader yaml(file);
  const std::string type = yaml.Text("type");
  if (!yaml.ok()) return yaml.status();
  if (type == "patches") return ReadPatches(file, yaml);
  if (type == "chessboard") return ReadChessboard(yaml);
  yaml.Fail("type", absl::StrCat("target type '", type, "' is unknown; use patches or chessboard"));
  return yaml.status();
}

absl::StatusOr<StartPose> LoadStart(const std::filesystem::path& file) {
  YamlReader yaml(file);
  yaml.AllowOnly({"position_m", "position_sigma_m", "orientation_xyzw", "orientation_sigma_rad",
                  "velocity_m_s", "velocity_sigma_m_s", "angular_velocity_rad_s",
                  "angular_velocity_sigma_rad_s"});
  StartPose start;
  start.world_from_camera.translation = ToVector(yaml.Numbers("position_m", 3, false, kPlace_m));
  const std::vector<double> q = yaml.Numbers("orientation_xyzw", 4);
  start.position_sigma_m = yaml.Number("position_sigma_m", kSigma);
  start.orientation_sigma_rad = yaml.Number("orientation_sigma_rad", kSigma);
  start.velocity_m_s = ToVector(yaml.Numbers("velocity_m_s", 3, !yaml.Has("velocity_m_s"), kSpeed));
  start.velocity_sigma_m_s = yaml.Number("velocity_sigma_m_s", kSigma, start.velocity_sigma_m_s);
  start.angular_velocity_rad_s = ToVector(
      yaml.Numbers("angular_velocity_rad_s", 3, !yaml.Has("angular_velocity_rad_s"), kSpeed));
  start.angular_velocity_sigma_rad_s =
      yaml.Number("angular_velocity_sigma_rad_s", kSigma, start.angular_velocity_sigma_rad_s);
  if (!yaml.ok()) return yaml.status();
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1.0) > 1e-3) {
    yaml.Fail("orientation_xyzw", absl::StrCat("has length ", rotation.norm(),
                                               "; give a unit quaternion in the order x y z w"));
    return yaml.status();
  }
  start.world_from_camera.rotation = rotation.normalized();
  return start;
}

}  // namespace saccade
