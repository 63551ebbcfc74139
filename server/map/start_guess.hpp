#pragma once

#include "server/map/start_adjustment.hpp"

namespace saccade {

/// A camera that only turned, and everything equally far: turns are fitted to the rays. In the
/// scale of `problem`.
StartProblem GuessTurns(const StartProblem& problem);

/// The other way to read the same pictures: near is far, ways are reversed, and the camera turns so
/// that what it looks at stays where it is. With little parallax, adjustment stays on the side that
/// it starts from.
StartProblem Reversed(const StartProblem& problem);

}  // namespace saccade
