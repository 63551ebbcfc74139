#pragma once

#include <absl/status/status.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/markers/square_watch.hpp"
#include "shared/scene/map_snapshot.hpp"
#include "shared/scene/marker_pose.hpp"

namespace saccade {

/// A square marker that moves, with something of the scene fixed to it.
struct CarriedSquare {
  std::string family;
  int id = 0;
  double side_m = 0;  // of its black border

  bool operator==(const CarriedSquare&) const = default;
};
using CarriedSquareList = std::vector<CarriedSquare>;

/// InvalidArgument: no detector that looks at grey pictures knows the family, or the family has no
/// such id; says what there is.
absl::Status CheckCarried(const CarriedSquare& square);

/// Where squares are that move, frame by frame. A detector on a thread of its own says which an
/// earlier picture showed; from then on their sides are searched for in every frame, where they
/// would be if they moved on as they did. Of the two poses that one picture of a flat thing has,
/// both are followed; the one is told that the pictures have spoken for. One thread.
class CarriedSquares {
 public:
  /// `waits`: for the detector, so that results do not depend on its speed (offline).
  explicit CarriedSquares(bool waits) : waits_(waits) {}

  /// Which; never null. From the next frame on; others are forgotten.
  void SetWanted(std::shared_ptr<const CarriedSquareList> wanted);
  /// One frame, in order, and what the tracker says of it. `captured_ns`: as MarkerPose::seen_ns is
  /// to have it. Every square that was ever found, of one not seen now its last place; null: none.
  /// In maps without metres none is looked for.
  std::shared_ptr<const std::vector<MarkerPose>> Step(const Frame& frame, Timestamp captured_ns,
                                                      const MapSnapshot& tracked);

 private:
  using Key = std::pair<std::string, int>;
  using Corners = std::array<Eigen::Vector2d, 4>;
  /// One of the two ways in which the pictures can be read.
  struct Reading {
    Rigid3 world_from_marker;
    double cost = 0;  // squares of residuals over their variance, of late
  };
  struct Followed {
    std::array<Reading, 2> readings;
    std::optional<std::size_t> told;  // index of the one that is
    Rigid3 world_from_marker;         // told last
    Timestamp seen_ns = 0;            // MarkerPose's
    Timestamp measured_ns = 0;        // capture clock; 0: never
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
    std::map<Timestamp, Corners> corners;  // of late
    int unseen = 0;                        // looks in a row in which the detector missed it
    bool searched = false;                 // in each frame
  };

  void TakeDetection(const CameraModel& camera, Timestamp captured_offset_ns);
  void Search(const Frame& frame, Timestamp captured_ns, const Rigid3& world_from_camera,
              const CarriedSquare& square, Followed& followed);
  void Measure(const CameraModel& camera, const Rigid3& world_from_camera, Timestamp time_ns,
               Timestamp captured_ns, double side_m, const MarkerSighting& sighting,
               Followed& followed);
  void Publish();

  const bool waits_;
  std::shared_ptr<const CarriedSquareList> wanted_ = std::make_shared<const CarriedSquareList>();
  std::unique_ptr<SquareWatch> watch_;  // null: nothing is wanted
  std::map<Key, Followed> followed_;
  std::map<Timestamp, Rigid3> cameras_;  // of late
  std::uint64_t generation_ = 0, revision_ = 0;
  std::int64_t frames_ = 0;
  std::shared_ptr<const std::vector<MarkerPose>> told_;
};

}  // namespace saccade
