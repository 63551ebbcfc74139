#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/pipeline/commands.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What was found of a lens so far, or in the end.
struct CalibrationResult {
  struct Parameter {
    std::string name;
    double value = 0, sigma = 0;
  };
  struct View {
    FrameId frame = 0;
    double rms_px = 0;
    bool rejected = false, held_out = false;
  };
  std::string model;
  double rms_px = 0, held_out_rms_px = 0;
  std::vector<Parameter> parameters;
  std::vector<View> views;
  std::vector<float> residuals_px;  // x, y, dx, dy of each corner
  std::string doubt;                // why it is not to be believed; empty: it is
};

/// The picture that was last looked at.
struct CalibrationPicture {
  FrameId frame = 0;
  int width = 0, height = 0;
  std::string jpeg;
  std::vector<float> corners_px;  // x, y
  bool taken = false;
};

/// A calibration as it is now.
struct CalibrationState {
  enum class Phase { kIdle, kShowing, kFitting, kDone, kFailed };
  Phase phase = Phase::kIdle;
  std::string target, target_words, advice, problem, saved_as;
  int views = 0, enough_views = 0, columns = 0, rows = 0;
  double covered = 0;
  std::vector<int> counts;
  std::uint64_t result_revision = 0;
  std::shared_ptr<const CalibrationResult> result;    // null: none yet
  std::shared_ptr<const CalibrationPicture> picture;  // null: none, or it may not be shown
};

struct CalibrationFile {
  std::string name, text;
};

/// Who calibrates the camera. Thread safe, nothing blocks; `done` may be called on any thread.
class CalibrationPort {
 public:
  virtual ~CalibrationPort() = default;

  /// Never null.
  virtual std::shared_ptr<const CalibrationState> state() const = 0;
  /// InvalidArgument: target or lens is none, and what to write.
  virtual void StartCalibration(std::string target, std::string lens, DoneEmpty done) = 0;
  /// FailedPrecondition: nothing is being shown.
  virtual void FinishCalibration(DoneEmpty done) = 0;
  virtual void StopCalibration(DoneEmpty done) = 0;
  /// FailedPrecondition: there is no result, or the form has no words for it.
  virtual absl::StatusOr<CalibrationFile> File(const std::string& form) const = 0;
  /// The file's path. FailedPrecondition: no result, one that is not to be believed, or nowhere to
  /// keep it.
  virtual void SaveCalibration(Done<std::string> done) = 0;
};

}  // namespace saccade
