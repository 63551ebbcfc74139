#include "server/team/planar_team.hpp"

#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>

namespace saccade {

absl::Status PlanarTeam::Place(int robot, const Eigen::Vector3d& pose, Timestamp time_ns) {
  if (members_.contains(robot)) {
    return absl::AlreadyExistsError(absl::StrCat("robot ", robot, " is there already"));
  }
  members_[robot];
  AddBlock(robot, pose, options_.start_position_m, options_.start_heading_rad, {}, time_ns);
  return absl::OkStatus();
}

absl::Status PlanarTeam::Join(int robot, Timestamp time_ns) {
  if (members_.contains(robot)) {
    return absl::AlreadyExistsError(absl::StrCat("robot ", robot, " is there already"));
  }
  members_[robot].start.emplace(options_, time_ns);
  return absl::OkStatus();
}

void PlanarTeam::Leave(int robot) {
  const auto member = members_.find(robot);
  if (member == members_.end()) return;
  if (member->second.placed) filter_.Remove(member->second.placed->block()).IgnoreError();
  members_.erase(member);
}

void PlanarTeam::AddBlock(int robot, const Eigen::Vector3d& pose, double position_m,
                          double heading_rad, const PlanarCommand& command, Timestamp time_ns) {
  PlanarVector state = PlanarVector::Zero(), sigma;
  state.head<3>() = pose;
  sigma << position_m, position_m, heading_rad, options_.speed_scale, options_.turn_scale,
      options_.turn_bias_rad_s, options_.range_bias_m, options_.bearing_bias_rad,
      options_.sight_delay_s;
  const PlanarMatrix covariance = sigma.cwiseAbs2().asDiagonal();
  const absl::StatusOr<BlockId> block = filter_.Add(
      absl::StrCat("robot ", robot), TeamBlockKind::kRobot, {std::nullopt, state}, covariance);
  Member& member = members_[robot];
  member.start.reset();
  if (!block.ok()) {  // a pose that is not finite
    members_.erase(robot);
    return;
  }
  member.placed.emplace(*block, time_ns);
  member.placed->Command(command);
}

PlanarTeam::Member* PlanarTeam::Ready(int robot, Timestamp time_ns) {
  const auto found = members_.find(robot);
  if (found == members_.end()) return nullptr;
  if (found->second.placed) found->second.placed->Advance(time_ns, options_, filter_);
  if (found->second.start) found->second.start->Advance(time_ns);
  return &found->second;
}

void PlanarTeam::Odometry(int robot, Timestamp time_ns, const PlanarCommand& command) {
  Member* member = Ready(robot, time_ns);
  if (member == nullptr) return;
  if (member->placed) member->placed->Command(command);
  if (member->start) member->start->Command(command);
}

double PlanarTeam::SinceLast(int robot, int subject, Timestamp time_ns) {
  const auto [last, first] = last_.try_emplace({robot, subject}, time_ns);
  const double since_s = first ? 1e9 : Seconds(time_ns - last->second);
  last->second = time_ns;
  return std::max(since_s, 1e-3);
}

void PlanarTeam::Count(const absl::StatusOr<BlockUpdate>& update, std::size_t& used) {
  if (!update.ok()) {
    ++counts_.refused;
    return;
  }
  ++used;
  if (update->weight < 0.5) ++counts_.doubted;
}

void PlanarTeam::SeeLandmark(int robot, Timestamp time_ns, int landmark,
                             const Eigen::Vector2d& place, const PlanarSight& sight) {
  Member* member = Ready(robot, time_ns);
  if (member == nullptr) return;
  const double since_s = SinceLast(robot, landmark, time_ns);
  if (member->start) {
    ++counts_.waiting;
    member->start->Sees(sight, place, 0.0);
    Settle(robot, time_ns);
    return;
  }
  PlanarRobot& observer = *member->placed;
  observer.Tell(filter_);
  const std::array blocks = {observer.block()};
  Count(
      filter_.Update(blocks,
                     [&](std::span<const BlockState* const> at) -> std::optional<ObservationModel> {
                       const auto r = ResidualOf(sight, at[0]->numbers, observer.command(), place,
                                                 Eigen::Vector2d::Zero());
                       if (!r) return std::nullopt;
                       return ObservationModel{r->residual, {r->d_observer}};
                     },
                     SightNoise(sight, since_s, options_), {options_.student_dof, 2}),
      counts_.landmarks);
}

void PlanarTeam::SeeRobot(int robot, Timestamp time_ns, int other, const PlanarSight& sight) {
  if (robot == other) return;
  Member* member = Ready(robot, time_ns);
  Member* seen = Ready(other, time_ns);
  if (member == nullptr || seen == nullptr) return;
  const double since_s = SinceLast(robot, other, time_ns);
  if (member->start || seen->start) ++counts_.waiting;
  if (member->start && seen->start) return;
  if (member->start) {
    seen->placed->Tell(filter_);
    const double sigma_m = PositionSigma(*seen->placed);
    const Eigen::Vector2d place = filter_.state(seen->placed->block()).numbers.head<2>();
    member->start->Sees(sight, place, sigma_m);
    return Settle(robot, time_ns);
  }
  PlanarRobot& observer = *member->placed;
  observer.Tell(filter_);
  if (seen->start) {
    const Eigen::Matrix2d noise = SightNoise(sight, 0.0, options_);
    const double heading_rad =
        std::sqrt(filter_.covariance(observer.block())(kHeading, kHeading) + noise(1, 1));
    const double sigma_m = std::sqrt(noise(0, 0)) + sight.range_m * heading_rad;
    seen->start->SeenAt(SeenPlace(observer, sight), std::hypot(sigma_m, PositionSigma(observer)));
    return Settle(other, time_ns);
  }
  PlanarRobot& subject = *seen->placed;
  subject.Tell(filter_);
  const std::array blocks = {observer.block(), subject.block()};
  Count(filter_.Update(
            blocks,
            [&](std::span<const BlockState* const> at) -> std::optional<ObservationModel> {
              const PlanarVector there = at[1]->numbers;
              const auto r = ResidualOf(sight, at[0]->numbers, observer.command(), there.head<2>(),
                                        VelocityOf(there, subject.command()));
              if (!r) return std::nullopt;
              Eigen::Matrix<double, 2, kPlanarDim> d_subject =
                  Eigen::Matrix<double, 2, kPlanarDim>::Zero();
              d_subject.leftCols<2>() = r->d_subject;
              return ObservationModel{r->residual, {r->d_observer, d_subject}};
            },
            SightNoise(sight, since_s, options_), {options_.student_dof, 2}),
        counts_.mutual);
}

Eigen::Vector2d PlanarTeam::SeenPlace(const PlanarRobot& observer, const PlanarSight& sight) const {
  const Eigen::VectorXd& state = filter_.state(observer.block()).numbers;
  const double direction = state[kHeading] + sight.bearing_rad - state[kBearingBias];
  return state.head<2>() + (sight.range_m - state[kRangeBias]) *
                               Eigen::Vector2d(std::cos(direction), std::sin(direction));
}

double PlanarTeam::PositionSigma(const PlanarRobot& robot) const {
  return std::sqrt(0.5 * filter_.covariance(robot.block()).topLeftCorner<2, 2>().trace());
}

void PlanarTeam::Settle(int robot, Timestamp time_ns) {
  const PlanarStart& start = *members_.at(robot).start;
  const std::optional<Eigen::Vector3d> pose = start.Pose();
  if (!pose) return;
  // The clues only say around where: what is known comes from sightings after this, so that nothing
  // counts twice.
  AddBlock(robot, *pose, options_.placed_position_m, options_.placed_heading_rad, start.command(),
           time_ns);
}

std::optional<PlanarTeam::Belief> PlanarTeam::At(int robot, Timestamp time_ns) {
  Member* member = Ready(robot, time_ns);
  if (member == nullptr || !member->placed) return std::nullopt;
  member->placed->Tell(filter_);
  const BlockId block = member->placed->block();
  return Belief{filter_.state(block).numbers, filter_.covariance(block).topLeftCorner<3, 3>()};
}

}  // namespace saccade
