#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/filter/filter_state.hpp"
#include "server/markers/square_search.hpp"
#include "server/markers/square_watch.hpp"
#include "server/scene/light_fit.hpp"
#include "server/scene/sight.hpp"
#include "server/tracker/carried_squares.hpp"
#include "server/tracker/landmark_options.hpp"
#include "server/tracker/marker_fit.hpp"
#include "server/tracker/square_doubts.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// Squares beside the natural features of a tracker, in its filter: those whose place is given, and
/// those of one family that are mapped as they are seen (environment markers, slam-spec 7).
///
/// A detector on a thread of its own says which squares an earlier picture showed. From then on
/// the sides of each are searched for in every frame, which costs some tenths of a millisecond. One
/// thread calls.
class SquareLandmarks {
 public:
  /// Errors as LandmarkOptions::Validate, LoadSquares, MakeDetector.
  static absl::StatusOr<std::unique_ptr<SquareLandmarks>> Create(const LandmarkOptions& options);

  /// See FrameTracker.
  void SetSight(std::shared_ptr<const Sight> sight) { sight_ = std::move(sight); }
  void SetCarried(std::shared_ptr<const CarriedSquareList> carried);
  SceneLight light() const { return light_.light(); }
  /// The map was thrown away.
  void Reset();
  /// A frame begins: takes what the detector has seen, and gives it this picture. `eager`: every
  /// picture, for somebody who is lost.
  void Look(const Frame& frame, bool eager);
  /// What Look() has waited [ms].
  double waited_ms() const { return waited_ms_; }
  double detector_ms() const { return detector_ms_; }  // of an answer in this frame; 0: none

  /// Whether the squares of the map are to give the world its frame.
  bool has_known() const { return !known_.squares.empty(); }
  /// Where the camera was in the picture of the newest answer, by squares of known place and, in
  /// `filter`, of mapped ones. `with_known`: the former's world is the map's.
  std::optional<SquaresPose> FindCamera(const CameraModel& camera, bool with_known,
                                        const FilterState& filter) const;

  /// Searches this frame, `with_known` as above. `pose`: where the camera is taken to be, to within
  /// `covariance` [position (world), rotation]; `motion` for the rolling shutter.
  void Search(const Frame& frame, const Rigid3& pose, const Matrix6d& covariance,
              const CameraMotion& motion, bool with_known, const FilterState& filter);
  void ForgetSearch();
  /// What was found, for the filter.
  const std::vector<Observation>& found() const { return found_; }
  int attempted() const { return attempted_; }
  /// The pose that what was found speaks for, from `start`, itself known to `covariance`.
  std::optional<Rigid3> PoseByFound(const CameraModel& camera, const Rigid3& start,
                                    const Matrix6d& covariance, const FilterState& filter) const;

  /// Remembers where the camera was in the newest frame, for squares that the detector tells of.
  void Record(Timestamp time_ns, const Rigid3& world_from_camera);
  /// Poses of earlier pictures, found elsewhere, in a map that begins.
  void RecordStart(const std::vector<std::pair<Timestamp, Rigid3>>& poses);
  /// What a metre is in the map, where the squares of unknown place tell it surely enough.
  /// Squares that disagree with the others about it are told of, and not mapped.
  std::optional<double> FindMetre(const CameraModel& camera);
  /// Puts squares into the filter whose place the views tell; the map must be metric.
  /// At most `most` squares are tried, in turn.
  void Place(const CameraModel& camera, int most, FilterState& filter);
  /// The world is another: poses that were remembered mean nothing any more.
  void ForgetViews();
  /// The same with another unit of length.
  void ScaleViews(double by);

  /// Where a mapped square is; nothing before it has a place.
  std::optional<Rigid3> PoseOf(const std::string& family, int id, const FilterState& filter) const;
  /// What became of the corners of the squares of known place in this frame, four each.
  const std::vector<FeatureState>& StatesOfKnown() const { return known_states_; }
  bool sees_unplaced() const { return !views_.empty(); }
  std::size_t mapped() const { return mapped_.size(); }
  void Wait() const { watch_.Wait(); }

 private:
  using Key = std::pair<std::string, int>;
  struct Mapped {
    CloneId marker = 0;
    double side_m = 0;
  };

  /// A square to be searched for.
  struct Sought {
    Rigid3 world_from_square;
    std::array<Eigen::Vector3d, 4> corners;  // in the square
    double border_share;
    CloneId marker = 0;  // in the filter; 0: its place is known
  };

  SquareLandmarks(const LandmarkOptions& options, SquareMap known,
                  std::unique_ptr<MarkerDetector> detector);
  void Take(const CameraModel& camera, const SquareWatch::Seen& seen);
  bool IsCarried(const std::string& family, int id) const;
  /// Whether a square is as large as the map's metre has it; tells of one that is not.
  bool HasItsSize(const CameraModel& camera, const Key& key);
  void SearchOne(const Frame& frame, const Rigid3& pose, const Matrix6d& covariance,
                 const CameraMotion& motion, double readout_s, const Sought& sought,
                 std::array<FeatureState, 4>& states);
  std::vector<MarkerView> PosedViews(const std::vector<MarkerView>& views) const;

  const LandmarkOptions options_;
  const SquareMap known_;
  std::shared_ptr<const Sight> sight_;  // null: nothing is known to be in the way
  std::shared_ptr<const CarriedSquareList> carried_ = std::make_shared<const CarriedSquareList>();
  SquareWatch watch_;
  SquareDoubts doubts_;
  std::set<Key> misprinted_;  // of another size than said: not mapped
  LightFit light_;
  std::vector<PaperSeen> papers_;                 // of this frame
  std::vector<MarkerSighting> newest_;            // of the newest answer, in this frame
  std::map<Key, std::vector<MarkerView>> views_;  // of squares without a place; poses by poses_
  std::map<Timestamp, Rigid3> poses_;             // world from camera
  Key last_tried_;
  std::map<Key, Mapped> mapped_;
  std::vector<Observation> found_;
  std::vector<FeatureState> known_states_;
  std::vector<double> known_shares_;  // BorderShare of each
  double mapped_share_ = 0;           // of those that are mapped
  std::int64_t frames_ = 0;
  int attempted_ = 0;
  double waited_ms_ = 0, detector_ms_ = 0;
};

}  // namespace saccade
