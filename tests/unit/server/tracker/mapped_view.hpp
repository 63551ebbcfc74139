#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "server/map/map.hpp"
#include "server/tracker/frame_matcher.hpp"

namespace saccade::testing {

/// A filter and a map of features started by hand, and matches to go with them: what rules are
/// asked about, without any picture.
class MappedView {
 public:
  MappedView() : filter(FilterOptions()) {
    filter.Reset(CameraMotion(), 1e-8 * Matrix12d::Identity());
  }

  /// Starts a feature ahead of the camera in `clone`; its inverse range is 1 / m, known to
  /// `relative_sigma`.
  FeatureId Plant(CloneId clone, double relative_sigma) {
    FeatureBirth birth;
    birth.id = map.in_use().NextId();
    const double turn = 0.02 * static_cast<double>(birth.id % 17) - 0.16;
    birth.bearing = Eigen::Vector3d(std::sin(turn), 0.0, std::cos(turn));
    birth.bearing_covariance = 1e-8 * Eigen::Matrix3d::Identity();
    birth.inverse_range_sigma = relative_sigma;
    EXPECT_TRUE(filter.AddFeature(clone, birth).ok());
    Landmark landmark;
    landmark.id = birth.id;
    map.in_use().Add(landmark);
    return birth.id;
  }

  /// Is in view, searched, found and believed.
  void See(FeatureId id) {
    LandmarkMatch match;
    match.id = id;
    match.point = filter.Point(id);
    match.searched = match.found = true;
    match.weight = 1.0;
    Put(match);
  }
  void SeeKnown(FeatureId id, const Eigen::Vector3d& point_in_world) {
    LandmarkMatch match;
    match.id = id;
    match.point = point_in_world;
    match.searched = match.found = true;
    match.weight = 1.0;
    Put(match);
  }
  /// Keeps the present frame as a keyframe, as the tracker does after births.
  void Keep() { map.AddKeyframe(filter, 1.0, 1e-3, {}); }
  /// The camera goes `metres` to the side.
  void Walk(double metres) {
    CameraMotion motion;
    motion.world_from_camera.translation.x() = metres;
    filter.ResetCamera(motion, 1e-8 * Matrix12d::Identity());
  }
  Landmark& Of(FeatureId id) { return *map.in_use().Find(id); }

  FilterState filter;
  Map map;
  FrameMatches matches;

 private:
  void Put(const LandmarkMatch& match) {
    matches.in_view.push_back(match);
    ++matches.attempted;
    ++matches.accepted;
  }
};

}  // namespace saccade::testing
