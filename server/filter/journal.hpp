#pragma once

#include <Eigen/Dense>
#include <variant>
#include <vector>

#include "server/filter/motion_model.hpp"

namespace saccade {

/// A pixel's Jacobian by what of a point is in the state.
using PointColumns = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 3>;

/// What happened to the errors of an island of the state since a checkpoint: enough to carry a
/// correction that is found late on to the present, as if it had been known at the checkpoint.
///
/// An update turns an error e into e - K H e, a prediction the camera's into F e; elements come and
/// go. Carrying a correction through costs O(n m) an update, n numbers, m measurement rows. A
/// correction that skipped this would be taken twice: the updates since have seen it, too.
class Journal {
 public:
  /// K H = gain * (L^-1 H), L = I if `factor` is empty; rows of `gain` that were taken only partly
  /// are scaled already.
  struct Updated {
    Eigen::MatrixXd gain;    // n x m
    Eigen::MatrixXd factor;  // m x m, lower triangle; or empty
    /// H e, from an error e (n) to m numbers.
    struct Rows {
      int camera = 0, clone = -1, point = -1, readout = -1;  // offsets
      Eigen::Matrix<double, 2, 6> d_camera, d_clone;
      PointColumns d_point;
      Eigen::Vector2d d_readout;
    };
    std::vector<Rows> rows;
  };
  struct Predicted {
    int offset = 0;  // of the camera
    MotionModel::Square f;
  };
  struct Cloned {
    int offset = 0;  // of the pose that was appended once more
  };
  struct Appended {
    int size = 0;  // numbers that know nothing of the rest
  };
  struct Told {
    int offset = 0;  // of a number that was replaced by what is known from elsewhere
  };
  struct Kept {
    std::vector<int> rows;  // that stayed, rising
  };
  using Entry = std::variant<Updated, Predicted, Cloned, Appended, Told, Kept>;

  void Add(Entry entry) { entries_.push_back(std::move(entry)); }
  std::size_t size() const { return entries_.size(); }
  /// `step` in the state at the checkpoint to a step in the present one.
  Eigen::VectorXd Carry(Eigen::VectorXd step) const;

 private:
  std::vector<Entry> entries_;
};

}  // namespace saccade
