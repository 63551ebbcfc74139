#pragma once

#include <vector>

#include "server/map/bundle_costs.hpp"
#include "server/map/start_adjustment.hpp"

namespace saccade {

/// From the errors that Ceres counts (half turns in the world, tangents of the bearings that it
/// began with) to those of StartSolution.
Eigen::MatrixXd ToOurErrors(const StartProblem& found, const std::vector<BearingOf>& bearings,
                            const Eigen::MatrixXd& covariance);

/// Takes the direction of scale out of an information matrix: what it would do to the inverse
/// ranges on the whole is held.
void HoldScale(const StartProblem& found, Eigen::MatrixXd& information);

/// All but the margin. `residuals`: of points (3 each) and sightings (2 each), the loss applied.
StartEvidence Weigh(const StartProblem& found, const Eigen::MatrixXd& covariance,
                    const Eigen::VectorXd& residuals);

/// Whether the camera goes the same way in both.
bool GoAlike(const StartProblem& a, const StartProblem& b);

}  // namespace saccade
