#pragma once

#include "server/markers/koller_code.hpp"
#include "server/markers/square_sampler.hpp"

namespace saccade {

/// How far the edges of a square's red cells are from where they must be.
struct KollerEdges {
  double worst_cells = 0, rms_cells = 0;
};

/// Looks at every edge between red and black: what red is within a third of a cell to either hand
/// tells where the edge is, however blurred it is. `red`: row by row from the sampler's first
/// corner. `black`: Redness() of what is black there [grey levels].
KollerEdges LookAtEdges(const SquareSampler& square, const KollerCells& red, double black);

}  // namespace saccade
