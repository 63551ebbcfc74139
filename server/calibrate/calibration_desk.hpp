#pragma once

#include <absl/status/status.h>

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "server/calibrate/live_calibration.hpp"
#include "server/capture/frame.hpp"
#include "server/pipeline/calibration.hpp"

namespace saccade {

/// Calibrates the camera of a running server from its own frames, while it goes on with all else.
/// One thread looks at the newest frame, another finds a lens in between. Thread safe.
class CalibrationDesk final : public CalibrationPort {
 public:
  struct Options {
    std::string source;             // URI, for reports
    std::filesystem::path keep_as;  // where SaveCalibration writes; empty: nowhere
    /// Whether people may see a frame.
    std::function<bool(FrameId)> may_show = [](FrameId) { return true; };
  };

  explicit CalibrationDesk(Options options);
  ~CalibrationDesk() override { Stop(); }

  /// Keeps the newest. Costs nothing while nothing is calibrated.
  void OnFrame(const std::shared_ptr<const Frame>& frame);
  /// Gives up what is being fitted. What was not begun is answered Unavailable.
  void Stop();

  std::shared_ptr<const CalibrationState> state() const override;
  void StartCalibration(std::string target, std::string lens, DoneEmpty done) override;
  void FinishCalibration(DoneEmpty done) override;
  void StopCalibration(DoneEmpty done) override;
  absl::StatusOr<CalibrationFile> File(const std::string& form) const override;
  void SaveCalibration(Done<std::string> done) override;

 private:
  /// A calibration that is done: the report, and that of the lens without k3, which Kalibr needs.
  struct Result {
    LensReport report;
    std::optional<LensReport> without_k3;
    double fps = 30;
  };
  using Order = std::function<void(const absl::Status& cut_off)>;  // cut off: to be answered so

  void Submit(Order order);
  void Run(std::stop_token stop);
  void Begin(const std::string& target, const std::string& lens, const DoneEmpty& done);
  void Look(const Frame& frame);
  void StartQuickFit();
  void TakeQuickFit();
  void DropQuickFit();
  void FinalFit(std::stop_token stop);
  absl::StatusOr<std::string> Save();
  void Publish(CalibrationState next);

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Order> orders_;
  std::shared_ptr<const Frame> newest_;
  bool showing_ = false, stopped_ = false;
  std::shared_ptr<const CalibrationState> state_ = std::make_shared<const CalibrationState>();
  std::shared_ptr<const Result> result_;

  // The desk's thread.
  std::unique_ptr<LensTarget> target_;  // until the first frame says how large pictures are
  std::unique_ptr<LiveCalibration> live_;
  std::string lens_;
  double fps_ = 30;
  std::size_t fitted_views_ = 0;
  std::uint64_t revision_ = 0;
  std::stop_source quick_stop_;
  std::future<absl::StatusOr<LensReport>> quick_fit_;
  bool finish_ = false;

  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace saccade
