#include "server/filter/motion_model.hpp"

namespace saccade {
namespace {

class StandingStillModel final : public MotionModel {
 public:
  StandingStillModel() : MotionModel(6, -1) {}

  CameraMotion Plus(const CameraMotion& motion, const Errors& error) const override {
    Vector12d all = Vector12d::Zero();
    all.head<6>() = error;
    return saccade::Plus(motion, all);
  }
  Errors Minus(const CameraMotion& to, const CameraMotion& from) const override {
    return saccade::Minus(to, from).head<6>();
  }
  Step Predict(const CameraMotion& motion, const Eigen::Quaterniond&, double,
               const MotionNoise&) const override {
    return {motion, Square::Identity(6, 6), Square::Zero(6, 6)};
  }
  Step Turn(const CameraMotion& motion, const HeadMotion& head) const override {
    const MotionJacobians by = LineariseHead(motion, head);
    return {TurnHead(motion, head.camera_from_next), by.f.topLeftCorner<6, 6>(),
            by.q.topLeftCorner<6, 6>()};
  }
  Errors OfScale(const Errors& error) const override {
    Errors lengths = Errors::Zero(6);
    lengths.head<3>() = error.head<3>();
    return lengths;
  }
  void ByOrigin(const CameraMotion& motion, const Rigid3& origin,
                Eigen::Ref<Eigen::MatrixXd> rows) const override {
    PoseByOrigin(motion.world_from_camera, origin, rows);
  }
  Square InMovedWorld(const Eigen::Matrix3d& turn) const override {
    Square by = Square::Identity(6, 6);
    by.topLeftCorner<3, 3>() = turn;
    return by;
  }
};

}  // namespace

const MotionModel& StandingStill() {
  static const StandingStillModel model;
  return model;
}

}  // namespace saccade
