#include "server/calibrate/lens_fit.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>

namespace saccade {
namespace {

using Views = std::vector<const BoardView*>;

constexpr double kStartHuber_px = 5, kLeastHuber_px = 0.1;
constexpr int kStartIterations = 20, kIterations = 60, kFitRounds = 6;
// A view this much worse than the median is another matter than noise.
constexpr double kViewOutlier = 3.0, kLeastOutlier_px = 0.15;
constexpr double kWorstRms_px = 3.0;
constexpr double kNoCost = 1e300;  // nothing found

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

double Rms(const Eigen::VectorXd& residuals) {
  return std::sqrt(2 * residuals.squaredNorm() / static_cast<double>(residuals.size()));
}

/// Focal lengths to begin with: from the homographies, and across what lenses there are.
std::vector<double> FocalGuesses(const Views& views, cv::Size picture) {
  std::vector<double> guesses;
  for (const double share : {0.3, 0.45, 0.7, 1.1, 1.8}) guesses.push_back(share * picture.width);
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> corners;
  for (const BoardView* view : views) {
    points.emplace_back(view->points.begin(), view->points.end());
    corners.emplace_back(view->corners.begin(), view->corners.end());
  }
  const cv::Mat matrix = cv::initCameraMatrix2D(points, corners, picture, 1.0);
  const double focal = matrix.at<double>(0, 0);
  if (focal > 0.1 * picture.width && focal < 20.0 * picture.width) guesses.push_back(focal);
  return guesses;
}

/// The best beginning: focal length and first coefficient alone are free, the centre in the middle.
LensProblem::State Begin(const LensProblem& problem, const Views& views, cv::Size picture) {
  LensProblem::State best;
  best.cost = kNoCost;
  std::vector<bool> some(problem.parameters(), false);
  some[0] = some[1] = some[4] = true;
  for (const double focal : FocalGuesses(views, picture)) {
    LensProblem::State state;
    state.lens = Eigen::VectorXd::Zero(problem.parameters());
    state.lens.head<4>() << focal, focal, 0.5 * (picture.width - 1), 0.5 * (picture.height - 1);
    bool posed = true;
    for (const BoardView* view : views) {
      BoardPose pose = BoardPose::Zero();
      posed = posed && problem.StartPose(state.lens, *view, pose);
      state.poses.push_back(pose);
    }
    if (!posed) continue;
    problem.Minimise(views, some, kStartHuber_px, kStartIterations, state);
    if (state.cost < best.cost) best = state;
  }
  return best;
}

CameraIntrinsics LensOf(const Eigen::VectorXd& values, LensModel model, cv::Size picture) {
  CameraIntrinsics lens;
  lens.model = model;
  lens.width = picture.width;
  lens.height = picture.height;
  lens.fx = values[0];
  lens.fy = values[1];
  lens.cx = values[2];
  lens.cy = values[3];
  for (Eigen::Index k = 4; k < values.size(); ++k) lens.distortion[k - 4] = values[k];
  return lens;
}

std::vector<std::string> NamesOf(LensChoice choice) {
  const bool fisheye = choice.model == LensModel::kKannalaBrandt;
  if (fisheye) return {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  if (!choice.k3) return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"};
  return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
}

/// Leaves out views that fit far worse than the others, together with their poses; false: none.
bool RejectViews(const LensProblem& problem, const LensProblem::State& state, Views& views,
                 std::vector<std::size_t>& indices, std::vector<BoardPose>& poses) {
  std::vector<double> rms;
  for (std::size_t v = 0; v < views.size(); ++v) {
    rms.push_back(Rms(problem.Residuals(state.lens, state.poses[v], *views[v], nullptr, nullptr)));
  }
  const double most = std::max(kLeastOutlier_px, kViewOutlier * Median(rms));
  Views kept;
  std::vector<std::size_t> kept_indices;
  poses.clear();
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (rms[v] > most) continue;
    kept.push_back(views[v]);
    kept_indices.push_back(indices[v]);
    poses.push_back(state.poses[v]);
  }
  const bool fewer = kept.size() < views.size();
  views = std::move(kept);
  indices = std::move(kept_indices);
  return fewer;
}

void Put(const BoardPose& pose, ViewFit& view) {
  view.rotation = {pose[0], pose[1], pose[2]};
  view.translation_m = {pose[3], pose[4], pose[5]};
}

/// Huber's width for the residuals there are: three sigmas of their median.
double HuberOf(const LensProblem& problem, const Views& views, const LensProblem::State& state) {
  std::vector<double> lengths;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto residuals =
        problem.Residuals(state.lens, state.poses[v], *views[v], nullptr, nullptr);
    for (Eigen::Index k = 0; k < residuals.size(); k += 2) {
      lengths.push_back(residuals.segment<2>(k).norm());
    }
  }
  return std::max(kLeastHuber_px, 3.0 * Median(lengths) / 1.177);  // Rayleigh's median
}

/// The lens, and which views it was fitted to.
struct Solution {
  LensProblem::State state;
  Views used;
  std::vector<std::size_t> indices;  // of `used`, in all views
  double huber_px = kStartHuber_px;
};

/// Nothing if no beginning leads anywhere.
std::optional<Solution> Solve(const LensProblem& problem, const std::vector<BoardView>& views,
                              cv::Size picture) {
  Solution solution;
  for (const BoardView& view : views) {
    solution.indices.push_back(solution.used.size());
    solution.used.push_back(&view);
  }
  solution.state = Begin(problem, solution.used, picture);
  if (!(solution.state.cost < kNoCost)) return std::nullopt;
  const std::vector<bool> all(problem.parameters(), true);
  for (int round = 0; round < kFitRounds; ++round) {
    problem.Minimise(solution.used, all, solution.huber_px, kIterations, solution.state);
    solution.huber_px = HuberOf(problem, solution.used, solution.state);
    std::vector<BoardPose> poses;
    const bool fewer = RejectViews(problem, solution.state, solution.used, solution.indices, poses);
    solution.state.poses = std::move(poses);
    if (!fewer && round > 0) break;
  }
  problem.Minimise(solution.used, all, solution.huber_px, kIterations, solution.state);
  return solution;
}

/// One entry for each view: how it fits, or that it was left out, and how it would have.
void DescribeViews(const LensProblem& problem, const Solution& solution,
                   const std::vector<BoardView>& views, CalibratedLens& fit) {
  for (const BoardView& view : views) {
    fit.views.push_back(FitView(view, fit));
    fit.views.back().rejected = true;
  }
  double squares = 0;
  for (std::size_t v = 0; v < solution.used.size(); ++v) {
    ViewFit& view = fit.views[solution.indices[v]];
    Put(solution.state.poses[v], view);
    view.rejected = false;
    view.rms_px = Rms(problem.Residuals(solution.state.lens, solution.state.poses[v],
                                        *solution.used[v], nullptr, nullptr));
    squares += view.rms_px * view.rms_px;
  }
  fit.rms_px = std::sqrt(squares / static_cast<double>(solution.used.size()));
}

}  // namespace

Eigen::Vector3d ViewFit::normal() const {
  cv::Matx33d turn;
  cv::Rodrigues(rotation, turn);
  const Eigen::Vector3d z(turn(0, 2), turn(1, 2), turn(2, 2));
  return z.z() < 0 ? Eigen::Vector3d(-z) : z;
}

absl::StatusOr<CalibratedLens> FitLens(const std::vector<BoardView>& views, cv::Size picture,
                                       LensChoice choice, std::stop_token stop) {
  if (views.size() < 3) {
    return absl::FailedPreconditionError(
        absl::StrCat("the board was seen whole in ", views.size(),
                     " views that differ; three are the least that a lens can be found from"));
  }
  const LensProblem problem(choice, std::move(stop));
  const std::optional<Solution> solution = Solve(problem, views, picture);
  CalibratedLens fit;
  if (solution) {
    fit.lens = LensOf(solution->state.lens, choice.model, picture);
    fit.names = NamesOf(choice);
    fit.values = solution->state.lens;
    DescribeViews(problem, *solution, views, fit);
  }
  if (!solution || !(fit.rms_px < kWorstRms_px)) {
    return absl::FailedPreconditionError(
        "no lens explains the views: is the target the one that was named (of a chessboard the "
        "inner corners "
        "count), flat and "
        "stiff, and the lens right (a fisheye is kannala_brandt)?");
  }
  fit.sigmas = problem.Covariance(solution->used, solution->huber_px, solution->state)
                   .diagonal()
                   .cwiseMax(0.0)
                   .cwiseSqrt();
  return fit;
}

ViewFit FitView(const BoardView& view, const CalibratedLens& fit) {
  const LensProblem problem({fit.lens.model, fit.values.size() == 9});
  LensProblem::State state;
  state.lens = fit.values;
  ViewFit out{view.frame, {}, {}, 1e9, false};
  BoardPose pose;
  if (!problem.StartPose(state.lens, view, pose)) return out;
  state.poses = {pose};
  const std::vector<bool> none(problem.parameters(), false);
  problem.Minimise({&view}, none, kStartHuber_px, kIterations, state);
  Put(state.poses[0], out);
  out.rms_px = Rms(problem.Residuals(state.lens, state.poses[0], view, nullptr, nullptr));
  return out;
}

}  // namespace saccade
