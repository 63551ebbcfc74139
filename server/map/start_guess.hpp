#pragma once

#include <optional>

#include "server/map/start_adjustment.hpp"

namespace saccade {

/// A camera that only turned, and everything equally far: turns are fitted to the rays. In the
/// scale of `problem`.
StartProblem GuessTurns(const StartProblem& problem);

/// The other way to read the same pictures: near is far, ways are reversed, and the camera turns so
/// that what it looks at stays where it is. With little parallax, adjustment stays on the side that
/// it starts from.
StartProblem Reversed(const StartProblem& problem);

/// Pictures of a plane can be read two ways however large the parallax is: the second has the plane
/// across the first one's way, and the camera goes along the first one's normal (Ma et al., An
/// Invitation to 3-D Vision, 5.3.3). A plane is fitted to the points; what it induces between the
/// first and the other keyframes is taken apart the other way. Nothing: the plane has no other
/// side.
std::optional<StartProblem> OtherPlane(const StartProblem& problem);

}  // namespace saccade
