#include "server/sim/sim_truth.hpp"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace saccade {

std::string ToJsonLine(const SimTruth& truth) {
  using nlohmann::json;
  const Eigen::Vector3d& t = truth.world_from_camera.translation;
  const Eigen::Quaterniond& q = truth.world_from_camera.rotation;
  json line = {
      {"frame", truth.frame},
      {"capture_time_ns", truth.capture_time_ns},
      {"world_from_camera",
       {{"translation_m", {t.x(), t.y(), t.z()}}, {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}}},
      {"head",
       {{"pan_rad", truth.head.pan_rad},
        {"elevation_rad", truth.head.elevation_rad},
        {"cyclotorsion_rad", truth.head.cyclotorsion_rad}}},
      {"objects", json::array()}};
  for (const SimObject& object : truth.objects) {
    const Eigen::Vector3d& p = object.point_in_world;
    line["objects"].push_back(
        {{"name", object.name},
         {"point_in_world_m", {p.x(), p.y(), p.z()}},
         {"pixel", object.pixel ? json::array({object.pixel->x(), object.pixel->y()}) : json()},
         {"visible", object.visible}});
  }
  return line.dump();
}

absl::StatusOr<std::unique_ptr<SimTruthWriter>> SimTruthWriter::Open(
    const std::filesystem::path& file) {
  std::ofstream stream(file, std::ios::trunc);
  if (!stream) {
    return absl::NotFoundError(absl::StrCat("--sim-truth ", file.string(), ": cannot be written (",
                                            std::strerror(errno),
                                            "); give a file in a folder that exists"));
  }
  return std::unique_ptr<SimTruthWriter>(new SimTruthWriter(std::move(stream), file));
}

absl::Status SimTruthWriter::Write(const SimTruth& truth) {
  stream_ << ToJsonLine(truth) << '\n' << std::flush;
  if (stream_) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("--sim-truth ", file_.string(), ": writing failed; is the disk full?"));
}

}  // namespace saccade
