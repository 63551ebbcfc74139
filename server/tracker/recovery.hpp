#pragma once

#include "server/tracker/tracker_impl.hpp"

namespace saccade {

/// What a relocalisation that is not confirmed is undone to.
struct Tracker::Impl::Backup {
  FilterState filter;
  LandmarkMap map;
  DormantLandmarks dormant;
};

}  // namespace saccade
