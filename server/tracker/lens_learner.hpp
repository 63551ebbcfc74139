#pragma once

#include <atomic>
#include <future>
#include <memory>
#include <optional>

#include "server/capture/target.hpp"
#include "server/features/image_pyramid.hpp"
#include "server/map/map.hpp"
#include "server/tracker/lens_state.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

struct LensLearnerOptions {
  // What is known of a lens that nobody measured: 60 deg across, or what the driver says.
  double focal_share = 0.25;   // sigma
  double centre_share = 0.03;  // of the picture's width
  double k1_sigma = 0.25, k2_sigma = 0.5, k3_sigma = 0.7;
  double tangential_sigma = 0.004;
  double first_s = 0.5;  // of a map, before its keyframes are tried
  double later = 1.5;    // then each time so much later
  double enough = 0.2;   // sigma of the focal length, relative, of a lens that is taken
  /// Errors that all matches share (a shutter's, patches seen from elsewhere) do not average out:
  /// successive lenses scatter by this many of the sigmas that independent errors give. So much are
  /// those larger that are told.
  double shared = 3.0;
  double least_shift_px = 0.1;  // a lens that differs by less is the same one
  double learnt = 0.01;         // sigma of the focal length from which it is as good as measured...
  double learnt_shift_px = 0.5;  // ...if it also stands still
};

/// Learns the lens of a camera that came without one, from the keyframes of the map, while it is
/// tracked (self-calibration: docs/derivations/lens.md).
///
/// The tracker's thread calls; solving runs on another and sees a copy. As with adjustment, a
/// result is taken `adjust_delay` frames later, waited for if need be (offline), or when it is
/// there.
class LensLearner {
 public:
  LensLearner(const TrackerOptions& options, std::shared_ptr<const CameraModel> assumed);
  ~LensLearner() { Stop(); }
  LensLearner(const LensLearner&) = delete;
  LensLearner& operator=(const LensLearner&) = delete;

  /// Before there is a map: another view of a target's board. True while more of them are wanted.
  /// The lens changes as soon as they tell it. On this thread, some 0.1 s now and then.
  bool Study(const ChessboardTarget& target, const ImagePyramid& picture);
  /// The map was thrown away; what was learnt of the lens stays.
  void Reset();
  /// Begins to solve, if it is time to and nothing is being solved. `time_ns`: of the frame.
  void Start(std::int64_t frame, Timestamp time_ns, const Map& map, const FilterState& filter);
  /// A better lens, with the keyframes as it has them; it is lens() from here on.
  std::optional<KeyframeGraph::LensJob> Finish(std::int64_t frame);
  void Wait() const;
  double waited_ms() const { return waited_ms_; }  // by Finish() in this frame

  /// Never null.
  const std::shared_ptr<const CameraModel>& lens() const { return lens_; }
  LensState state() const;

 private:
  void Stop();
  /// Keeps what a solution says; true: the lens is another one now.
  bool Take(const LensBundleSolution& solution, std::size_t views);

  TrackerOptions options_;
  LensLearnerOptions learning_;
  std::shared_ptr<const CameraModel> lens_;
  void SetPrior(LensBundle& bundle) const;

  LensVector assumed_;
  LensMatrix assumed_information_;
  LensVector known_;  // now
  LensMatrix known_covariance_;
  LensBundle board_;  // views of a target before there is a map
  int studied_ = 0;   // pictures
  std::optional<Timestamp> began_ns_;
  double next_s_ = 0.0;
  double last_shift_px_ = 1e9;
  int changes_ = 0;
  std::atomic<bool> stop_ = false;
  KeyframeGraph::LensJob job_;
  std::future<std::optional<LensBundleSolution>> running_;
  std::int64_t started_ = 0;  // frame
  double waited_ms_ = 0.0;
};

/// "Learning the lens: focal length 540 +- 12 px."; empty once it is learnt.
std::string LearningWords(const LensState& state);

}  // namespace saccade
