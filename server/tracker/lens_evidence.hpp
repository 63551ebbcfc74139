#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/filter/filter_state.hpp"
#include "server/tracker/frame_matcher.hpp"
#include "server/tracker/lens_fit.hpp"

namespace saccade {

struct LensEvidenceOptions {
  int views = 12;                // of one fit; each shares half of them with the fit before
  double least_step_rad = 0.03;  // between two: turned, and gone against the distance seen
  /// Of a fit that speaks against the file: what the stretch grows by from the centre to the corner
  /// (LensFit::stretch[1]). Right files of seven recordings stay below 0.055 in each fit; a lens
  /// whose distortion was left out shows 0.1 to 0.3.
  double least_growth = 0.07;
  double least_sigmas = 3.0;
  int fits = 7;      // looked at...
  int agreeing = 5;  // ...of which so many must speak against it, in the same direction
};

/// Whether residuals say that the lens file is wrong: they grow with the radius, in one direction,
/// over a stretch of many views. What a wrong focal length does is mostly taken up by depths and
/// turns (measured: 10 % too long moves the fitted focal length by less than right files scatter),
/// so only what grows with the radius counts. Never touches the filter: fits run on a thread of
/// their own, on copies. All calls from one thread.
class LensEvidence {
 public:
  explicit LensEvidence(const LensEvidenceOptions& options) : options_(options) {}

  /// A frame that was tracked: a view, if the camera has moved on since the last.
  void Add(const CameraModel& camera, const FilterState& filter, const FrameMatches& matches);
  /// The verdict of one fit; nothing: it failed.
  void Judge(const std::optional<LensFit>& fit);
  /// The map was thrown away: views of it do not go with later ones. The verdict stays: the lens
  /// is the same.
  void ForgetViews();
  /// Returns when no fit runs (for a process that forks); it is judged with the next view.
  void WaitForFit() const {
    if (running_.valid()) running_.wait();
  }
  /// Waits for the fit that runs, and judges it.
  void Wait();

  /// What the stretch grows by from the centre to the corner, in the median, if the file does not
  /// fit; nothing: no evidence.
  std::optional<double> Growth() const;

 private:
  LensEvidenceOptions options_;
  std::vector<LensView> views_;
  std::map<FeatureId, Eigen::Vector3d> points_in_world_;  // of views_, newest estimates
  std::future<std::optional<LensFit>> running_;
  std::deque<double> growths_;  // of the newest fits; 0: it says nothing against the file
};

/// "The lens file does not fit: residuals grow with the radius (...)."
std::string LensWords(double growth);

}  // namespace saccade
