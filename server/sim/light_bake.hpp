#pragma once

#include <Eigen/Dense>
#include <vector>

#include "server/sim/surface.hpp"

namespace saccade {

/// A rectangle that gives light: centre, half edges, the direction it faces, radiant exitance.
struct AreaLight {
  Eigen::Vector3f centre, half_u, half_v, normal;
  Eigen::Vector3f rgb;  // linear
  int samples = 3;      // per edge
};

/// Lays the patches' light samples out in one atlas and fills it: shadowed light of `lights`, once
/// bounced off every surface (spec: soft, with contact shadows), on `threads` threads.
/// Same input, same atlas to the bit.
void BakeLight(const std::vector<AreaLight>& lights, int threads, RoomScene& scene);

}  // namespace saccade
