#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// The little of a recording that these tests need: pictures by number and the truth by time.
class Recording {
 public:
  explicit Recording(const std::string& name)
      : folder_(std::filesystem::path(SACCADE_SOURCE_DIR) / "../shared/data" / name) {
    std::ifstream list(folder_ / "rgb.txt");
    std::string line;
    while (std::getline(list, line)) {
      if (line.empty() || line[0] == '#') continue;
      std::istringstream fields(line);
      double time = 0;
      std::string path;
      fields >> time >> path;
      times_.push_back(time);
      paths_.push_back(path);
    }
    std::ifstream truth(folder_ / "groundtruth.txt");
    while (std::getline(truth, line)) {
      if (line.empty() || line[0] == '#') continue;
      std::istringstream f(line);
      double t = 0;
      Rigid3 p;
      Eigen::Vector4d q;
      f >> t >> p.translation.x() >> p.translation.y() >> p.translation.z() >> q[0] >> q[1] >>
          q[2] >> q[3];
      p.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
      truth_times_.push_back(t);
      truth_.push_back(p);
    }
  }
  bool present() const { return !paths_.empty(); }
  int size() const { return static_cast<int>(paths_.size()); }
  std::string folder() const { return folder_.string(); }
  cv::Mat Image(int frame) const {
    return cv::imread((folder_ / paths_.at(frame)).string(), cv::IMREAD_GRAYSCALE);
  }
  /// world_from_camera, between the two nearest entries.
  Rigid3 Truth(int frame) const {
    const double t = times_.at(frame);
    std::size_t k = 1;
    while (k + 1 < truth_times_.size() && truth_times_[k] < t) ++k;
    const double span = truth_times_[k] - truth_times_[k - 1];
    const double s = span > 0 ? std::clamp((t - truth_times_[k - 1]) / span, 0.0, 1.0) : 0.0;
    return {truth_[k - 1].rotation.slerp(s, truth_[k].rotation),
            (1 - s) * truth_[k - 1].translation + s * truth_[k].translation};
  }

 private:
  std::filesystem::path folder_;
  std::vector<double> times_, truth_times_;
  std::vector<std::string> paths_;
  std::vector<Rigid3> truth_;
};

inline std::shared_ptr<const CameraModel> MakeLens(LensModel model, int width, int height,
                                                   double fx, double fy, double cx, double cy,
                                                   const std::array<double, 5>& distortion) {
  CameraIntrinsics k;
  k.model = model;
  k.width = width;
  k.height = height;
  k.fx = fx;
  k.fy = fy;
  k.cx = cx;
  k.cy = cy;
  k.distortion = distortion;
  return std::make_shared<CameraModel>(k);
}

inline std::shared_ptr<const CameraModel> CheckerboardCamera() {
  return MakeLens(LensModel::kBrownConrady, 752, 480, 420.506712, 420.61094, 355.208298, 250.336787,
                  {-0.296681, 0.080857, 0, 0, 0});
}
inline std::shared_ptr<const CameraModel> DeskCamera() {
  return MakeLens(LensModel::kRadial1, 320, 240, 195, 195, 162, 125, {9.0e-6});
}
inline std::shared_ptr<const CameraModel> TumCamera() {
  return MakeLens(LensModel::kBrownConrady, 640, 480, 517.3, 516.5, 318.6, 255.3,
                  {0.2624, -0.9531, -0.0054, 0.0026, 1.1633});
}

}  // namespace saccade
