// Follows the pose of the wearer's camera: a line per pose, as it is published.
//
//   follow_pose [HOST:PORT [POSES]]
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <variant>

#include "client/net/connection.hpp"

namespace {

const char* ToString(saccade::TrackingStatus status) {
  switch (status) {
    case saccade::TrackingStatus::kInitialising:
      return "initialising";
    case saccade::TrackingStatus::kTracking:
      return "tracking";
    case saccade::TrackingStatus::kCoasting:
      return "coasting";
    case saccade::TrackingStatus::kLost:
      return "lost";
    case saccade::TrackingStatus::kRelocalising:
      return "relocalising";
  }
  return "unknown";
}

// frame status metric|relative x y z qx qy qz qw: world_from_camera, metres where the world is
// metric.
void Print(const saccade::MapSnapshot& pose) {
  const Eigen::Vector3d& p = pose.world_from_camera.translation;
  const Eigen::Quaterniond& q = pose.world_from_camera.rotation;
  std::printf("%llu %s %s %.4f %.4f %.4f %.5f %.5f %.5f %.5f\n",
              static_cast<unsigned long long>(pose.frame_id), ToString(pose.status),
              pose.metric ? "metric" : "relative", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  std::fflush(stdout);
}

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "follow_pose: %s\n", status.ToString().c_str());
  return EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  saccade::net::ConnectionOptions options;
  options.display_name = "follow_pose";
  options.role = saccade::net::Role::kViewer;  // sees everything, changes nothing
  if (argc > 1) options.server = argv[1];
  // 0: until the server goes away.
  const std::uint64_t wanted = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;

  const auto connection = saccade::net::Connection::Create(options);
  if (!connection.ok()) return Fail(connection.status());
  std::uint64_t seen = 0;
  const absl::Status ended = (*connection)->Watch([&](const saccade::net::WatchEvent& event) {
    const auto* pose = std::get_if<saccade::MapSnapshot>(&event);
    if (pose == nullptr) return true;  // statistics, who is there, marks
    Print(*pose);
    return ++seen != wanted;
  });
  return ended.ok() ? EXIT_SUCCESS : Fail(ended);
}
