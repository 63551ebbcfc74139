#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "server/eval/claims.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/run_recorder.hpp"
#include "server/eval/scale_windows.hpp"
#include "server/eval/statistics.hpp"
#include "server/sim/sim_source.hpp"

namespace saccade {

/// When and what an expert clicks in a simulated run.
struct ClickPlan {
  double first_s = 4.0;  // the map has to exist
  double every_s = 4.0;  // between clicks
  double last_s = 50.0;  // so that each is seen for a while
  double delay_s = 0.2;  // a click speaks of the frame this long before
};

/// Sums over one run; those of several runs add up.
struct PixelRunTotals {
  std::uint64_t frames = 0, lost_frames = 0, initialising_frames = 0, coasting_frames = 0;
  std::uint64_t tracked_frames = 0, lost_after_start_frames = 0;
  std::uint64_t false_tracked_frames = 0;  // published as tracked, more than 15 cm from truth
  std::optional<ScaleWindows> scale_windows;
  std::uint64_t anchors = 0, refused_clicks = 0;
  std::uint64_t views = 0;           // (anchor, frame) with truth in view
  std::uint64_t tracking_views = 0;  // of those, anchor state TRACKING
  std::uint64_t drawn_views = 0;
  Sample squared_px, squared_mm_per_m;
  Sample frame_ms;
  ClaimTotals claims;

  void Add(const PixelRunTotals& other);
};

/// One run through pixels: renders, tracks, clicks, compares; writes trajectory.tum,
/// groundtruth.txt, frames.csv, anchors.csv and claims.csv into a folder. Simulated time: nothing
/// depends on how long a frame takes.
class PixelRun {
 public:
  /// `targetless`: the tracker is not told of the chessboard; its map has no metres then.
  static absl::StatusOr<PixelRun> Create(const SimOptions& options, const TrackerArguments& tracker,
                                         const ClickPlan& plan, bool targetless,
                                         const std::filesystem::path& folder);
  PixelRun(PixelRun&&) = default;

  /// The whole run; adds to `totals` and answers with the ATE (SE3) [m], or nothing if fewer than
  /// three frames were tracked.
  absl::StatusOr<std::optional<double>> Run(PixelRunTotals& totals);

 private:
  /// An anchor with the point that was really clicked.
  struct Clicked {
    std::string id;
    int number = 0;
    Eigen::Vector3d true_point = Eigen::Vector3d::Zero();
  };

  PixelRun(std::unique_ptr<SimSource> source, std::unique_ptr<Wearable> wearable,
           RunRecorder recorder, OutputFile truth_file, OutputFile anchors_file,
           const SimOptions& options, const ClickPlan& plan, const std::filesystem::path& folder);
  absl::Status Step(const Frame& frame, PixelRunTotals& totals);
  void ClickIfDue(FrameId now, PixelRunTotals& totals);
  /// A pixel of `frame` that shows a surface, and the point it shows.
  struct SurfacePixel {
    Eigen::Vector2d pixel;
    Eigen::Vector3d point_in_world;
  };
  std::optional<SurfacePixel> PickSurface(FrameId frame);
  void WatchClaims(const Frame& frame, const MapSnapshot& snapshot, bool pose_published);
  void CompareAnchors(const Frame& frame, const MapSnapshot& snapshot, bool pose_published,
                      PixelRunTotals& totals);

  std::unique_ptr<SimSource> source_;
  std::unique_ptr<Wearable> wearable_;
  RunRecorder recorder_;
  OutputFile truth_file_, anchors_file_;
  ClickPlan plan_;
  double fps_;
  std::mt19937_64 rng_;
  std::vector<Clicked> clicked_;
  ClaimLog claims_;
  std::filesystem::path folder_;
  bool metric_ = false;  // of the newest map
  Trajectory truth_;
  std::vector<PosePair> claimed_;  // poses published as tracked, wrong ones too
  int clicks_ = 0;
};

}  // namespace saccade
