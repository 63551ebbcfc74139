#include "shared/scene/surface_snapshot.hpp"

#include <random>

namespace saccade {

std::uint64_t FirstSurfaceEdition() {
  return std::uint64_t{std::random_device()()} << 20 | std::uint64_t{1} << 19;
}

}  // namespace saccade
