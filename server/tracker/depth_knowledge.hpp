#pragma once

#include "server/filter/filter_state.hpp"

namespace saccade {

/// How well an inverse range has to be known, as sigma over value, by what for. One question; these
/// are its only answers in the tracker.
struct DepthKnowledge {
  static constexpr double kToGuessOthers = 0.3;  // its neighbours are born at about its depth
  static constexpr double kSettled = 0.25;       // the first poses of a map are published
  static constexpr double kToRecognise = 0.2;    // a keyframe shows it to who is lost
  static constexpr double kToRest = 0.1;         // it is found again when it is woken
  static constexpr double kSeededToRest = 0.02;  // the same of a clicked one: a mark waits for it
};

inline bool KnownTo(const FeatureMarginal& marginal, double share) {
  return marginal.inverse_range_sigma <= share * marginal.inverse_range;
}

}  // namespace saccade
