// The part of FilterState that carries its cameras on in time.
#include <algorithm>
#include <cmath>

#include "server/filter/filter_state.hpp"

namespace saccade {

FilterState::HeadRate FilterState::RateOf(const HeadMotion& head, double dt, const Robot& robot) {
  // Of the joints, seen from the present camera.
  Matrix6d turn = Matrix6d::Identity() / dt;
  turn.topLeftCorner<3, 3>() = robot.motion.world_from_camera.RotationMatrix() / dt;
  HeadRate now;
  now.rate << head.camera_from_next.translation,
      LogQuaternion(head.camera_from_next.rotation);  // its axis is the same before and after
  now.rate = (turn * now.rate).eval();
  now.covariance = turn * head.covariance * turn.transpose();
  return now;
}

void FilterState::ChangeVelocities(double sign, Robot& robot) {
  const int velocities = robot.model->velocities();
  if (velocities < 0) return;
  robot.motion.velocity_m_s += sign * robot.head->rate.head<3>();
  robot.motion.angular_velocity_rad_s += sign * robot.head->rate.tail<3>();
  Island& island = IslandAt(IslandOf(robot.block));
  island.p.AddBlock(At(robot.block) + velocities, robot.head->covariance);
}

CameraMotion FilterState::WholeMotion(RobotId id) const {
  const Robot& robot = Of(id);
  CameraMotion whole = robot.motion;
  whole.velocity_m_s -= whole.world_from_camera.rotation *
                        whole.angular_velocity_rad_s.cross(whole.imu.camera_from_imu.translation);
  if (robot.head) {
    whole.velocity_m_s += robot.head->rate.head<3>();
    whole.angular_velocity_rad_s += robot.head->rate.tail<3>();
  }
  return whole;
}

void FilterState::Follow(const MotionModel::Step& step, Robot& robot) {
  Island& island = IslandAt(IslandOf(robot.block));
  const int at = At(robot.block);
  if (island.checkpoint) island.checkpoint->journal.Add(Journal::Predicted{at, step.f});
  island.p.TransformBlock(at, step.f);
  island.p.AddBlock(at, step.q);
  robot.motion = step.next;
  robot.first_pose = robot.motion.world_from_camera;
}

void FilterState::Predict(double dt, const MotionNoise& noise, const HeadMotion* head, RobotId id) {
  Robot& robot = Of(id);
  if (head != nullptr && !robot.head) {
    robot.head = RateOf(*head, dt, robot);
    ChangeVelocities(-1.0, robot);
  } else if (head == nullptr && robot.head) {
    ChangeVelocities(1.0, robot);
    robot.head.reset();
  }
  constexpr double kLongestStep_s = 1.0 / 30.0;
  constexpr double kMostSteps = 30.0;  // a second; whoever asks for more knows nothing anyway
  const auto steps =
      static_cast<int>(std::clamp(std::ceil(dt / kLongestStep_s - 0.1), 1.0, kMostSteps));
  const bool fej = Fej(IslandOf(robot.block));
  for (int k = 0; k < steps; ++k) {
    const Eigen::Quaterniond& first =
        fej ? robot.first_pose.rotation : robot.motion.world_from_camera.rotation;
    Follow(robot.model->Predict(robot.motion, first, dt / steps, noise), robot);
  }
  if (head == nullptr) return;
  robot.head = RateOf(*head, dt, robot);
  Follow(robot.model->Turn(robot.motion, *head), robot);
}

void FilterState::Inflate(const Matrix12d& extra, RobotId id) {
  const Robot& robot = Of(id);
  IslandAt(IslandOf(robot.block)).p.AddBlock(At(robot.block), robot.model->InState(extra));
}

}  // namespace saccade
