#include "server/calibrate/calibration_desk.hpp"

#include <absl/strings/str_cat.h>

#include <utility>

#include "server/calibrate/camera_output.hpp"
#include "server/calibrate/desk_result.hpp"
#include "server/capture/camera_text.hpp"

namespace saccade {
namespace {

using Phase = CalibrationState::Phase;

constexpr std::size_t kMostOrders = 16;
constexpr std::size_t kFirstFitViews = 6, kFitEveryViews = 3;

}  // namespace

CalibrationDesk::CalibrationDesk(Options options)
    : options_(std::move(options)), thread_([this](std::stop_token stop) { Run(stop); }) {}

void CalibrationDesk::OnFrame(const std::shared_ptr<const Frame>& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (!showing_) return;
    newest_ = frame;
  }
  changed_.notify_one();
}

void CalibrationDesk::Stop() {
  std::deque<Order> left;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    left.swap(orders_);
  }
  for (const Order& order : left) order(absl::UnavailableError("the server is shutting down"));
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
  DropQuickFit();
}

std::shared_ptr<const CalibrationState> CalibrationDesk::state() const {
  std::shared_ptr<const CalibrationState> state;
  {
    const std::lock_guard lock(mutex_);
    state = state_;
  }
  if (!state->picture || options_.may_show(state->picture->frame)) return state;
  auto hidden = std::make_shared<CalibrationState>(*state);
  hidden->picture = nullptr;
  return hidden;
}

void CalibrationDesk::Submit(Order order) {
  absl::Status cut_off;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) {
      cut_off = absl::UnavailableError("the server is shutting down");
    } else if (orders_.size() >= kMostOrders) {
      cut_off = absl::ResourceExhaustedError("calibration: too much is asked of it; try again");
    } else {
      orders_.push_back(std::move(order));
    }
  }
  if (cut_off.ok()) {
    changed_.notify_one();
  } else {
    order(cut_off);
  }
}

void CalibrationDesk::StartCalibration(std::string target, std::string lens, DoneEmpty done) {
  Submit([this, target = std::move(target), lens = std::move(lens),
          done = std::move(done)](const absl::Status& cut_off) {
    cut_off.ok() ? Begin(target, lens, done) : done(cut_off);
  });
}

void CalibrationDesk::FinishCalibration(DoneEmpty done) {
  Submit([this, done = std::move(done)](const absl::Status& cut_off) {
    if (!cut_off.ok()) return done(cut_off);
    if (live_ == nullptr || state()->phase != Phase::kShowing) {
      return done(absl::FailedPreconditionError(
          "calibration: nothing is being shown to the camera; start one"));
    }
    finish_ = true;
    done(absl::OkStatus());
  });
}

void CalibrationDesk::StopCalibration(DoneEmpty done) {
  Submit([this, done = std::move(done)](const absl::Status& cut_off) {
    if (!cut_off.ok()) return done(cut_off);
    DropQuickFit();
    live_ = nullptr;
    target_ = nullptr;
    Publish({});
    done(absl::OkStatus());
  });
}

void CalibrationDesk::SaveCalibration(Done<std::string> done) {
  Submit([this, done = std::move(done)](const absl::Status& cut_off) {
    done(cut_off.ok() ? Save() : absl::StatusOr<std::string>(cut_off));
  });
}

void CalibrationDesk::Run(std::stop_token stop) {
  pthread_setname_np(pthread_self(), "calibrate");
  while (!stop.stop_requested()) {
    Order order;
    std::shared_ptr<const Frame> frame;
    {
      std::unique_lock lock(mutex_);
      const auto due = [this] { return !orders_.empty() || newest_ != nullptr; };
      if (!changed_.wait(lock, stop, due)) return;
      if (!orders_.empty()) {
        order = std::move(orders_.front());
        orders_.pop_front();
      } else {
        frame = std::exchange(newest_, nullptr);
      }
    }
    if (order) order(absl::OkStatus());
    if (frame) Look(*frame);
    if (finish_) FinalFit(stop);
  }
}

void CalibrationDesk::Begin(const std::string& target, const std::string& lens,
                            const DoneEmpty& done) {
  if (!lens.empty() && lens != "brown_conrady" && lens != "kannala_brandt") {
    return done(absl::InvalidArgumentError(absl::StrCat(
        "lens: '", lens, "' is none; give brown_conrady, kannala_brandt or leave it empty")));
  }
  // A file would be one of the server's.
  if (target.find('/') != std::string::npos) {
    return done(absl::InvalidArgumentError(
        "target: names a file; write the sheet itself, as in aprilgrid:6x6:0.088:0.3"));
  }
  absl::StatusOr<std::unique_ptr<LensTarget>> made = MakeLensTarget(target);
  if (!made.ok()) return done(made.status());
  DropQuickFit();
  live_ = nullptr;
  target_ = *std::move(made);
  lens_ = lens;
  fitted_views_ = 0;
  finish_ = false;
  Publish(DeskBegin(target, target_->words()));
  done(absl::OkStatus());
}

void CalibrationDesk::Look(const Frame& frame) {
  CalibrationState next = *state();
  if (next.phase != Phase::kShowing || !options_.may_show(frame.id)) return;
  if (live_ == nullptr) {
    live_ = std::make_unique<LiveCalibration>(std::move(target_), frame.grey.size());
    fps_ = frame.camera->intrinsics().fps;
  }
  if (frame.grey.size() != live_->picture()) {
    next.phase = Phase::kFailed;
    next.problem = "the camera's pictures changed their size; start again";
    return Publish(std::move(next));
  }
  const LiveCalibration::Look look = live_->Offer(frame.id, frame.capture_time_ns, frame.grey);
  const ViewPicker& picker = live_->picker();
  next.advice = look.next;
  next.views = static_cast<int>(picker.views().size());
  next.covered = picker.Covered();
  for (std::size_t k = 0; k < next.counts.size(); ++k) {
    const int at = static_cast<int>(k);
    next.counts[k] = picker.Corners(at % ViewPicker::kColumns, at / ViewPicker::kColumns);
  }
  next.picture = DeskPictureOf(frame, look);
  Publish(std::move(next));
  TakeQuickFit();
  finish_ = finish_ || picker.Complete();
  if (!finish_) StartQuickFit();
}

void CalibrationDesk::StartQuickFit() {
  const std::size_t views = live_->picker().views().size();
  if (quick_fit_.valid() || views < kFirstFitViews || views < fitted_views_ + kFitEveryViews) {
    return;
  }
  fitted_views_ = views;
  quick_stop_ = {};
  LensWish wish{lens_, CameraTextForm::kSaccade, /*hold_out=*/false};
  wish.stop = quick_stop_.get_token();
  quick_fit_ = std::async(
      std::launch::async,
      [picker = live_->picker(), size = live_->picture(), wish, words = live_->target().words(),
       source = options_.source] { return FitBest(source, picker, words, size, wish); });
}

void CalibrationDesk::TakeQuickFit() {
  using namespace std::chrono_literals;
  if (!quick_fit_.valid() || quick_fit_.wait_for(0s) != std::future_status::ready) return;
  const absl::StatusOr<LensReport> report = quick_fit_.get();
  if (!report.ok()) return;  // more views may do
  CalibrationState next = *state();
  next.result_revision = ++revision_;
  next.result = DeskResultOf(*report);
  Publish(std::move(next));
}

void CalibrationDesk::DropQuickFit() {
  quick_stop_.request_stop();
  if (quick_fit_.valid()) quick_fit_.wait();
  quick_fit_ = {};
}

void CalibrationDesk::FinalFit(std::stop_token stop) {
  finish_ = false;
  DropQuickFit();
  CalibrationState next = *state();
  next.phase = Phase::kFitting;
  next.advice = "";
  Publish(next);
  LensWish wish{lens_, CameraTextForm::kSaccade, /*hold_out=*/true};
  wish.stop = stop;
  absl::StatusOr<LensReport> report = live_->Fit(options_.source, wish);
  if (stop.stop_requested()) return;
  if (!report.ok()) {
    next.phase = Phase::kFailed;
    next.problem = std::string(report.status().message());
    return Publish(std::move(next));
  }
  auto result = std::make_shared<Result>();
  result->fps = fps_;
  if (report->fit.lens.model == LensModel::kBrownConrady) {
    wish.lens = "brown_conrady";
    wish.form = CameraTextForm::kKalibr;
    absl::StatusOr<LensReport> without = live_->FitAgain(options_.source, wish);
    if (without.ok()) result->without_k3 = *std::move(without);
  }
  next.phase = Phase::kDone;
  next.result_revision = ++revision_;
  next.result = DeskResultOf(*report);
  result->report = *std::move(report);
  {
    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
  }
  Publish(std::move(next));
}

absl::StatusOr<CalibrationFile> CalibrationDesk::File(const std::string& form) const {
  const absl::StatusOr<CameraTextForm> wanted = ParseCameraTextForm(form);
  if (!wanted.ok()) return wanted.status();
  std::shared_ptr<const Result> result;
  {
    const std::lock_guard lock(mutex_);
    if (state_->phase == Phase::kDone) result = result_;
  }
  if (result == nullptr) {
    return absl::FailedPreconditionError("calibration: there is no result yet; start one");
  }
  const bool without_k3 = *wanted == CameraTextForm::kKalibr && result->without_k3;
  const LensReport& report = without_k3 ? *result->without_k3 : result->report;
  CameraIntrinsics lens = report.fit.lens;
  lens.fps = result->fps;
  absl::StatusOr<std::string> text = CameraText(*wanted, lens, CameraFileHeader(report));
  if (!text.ok()) return text.status();
  return CalibrationFile{std::string(FileNameOf(*wanted)), *std::move(text)};
}

absl::StatusOr<std::string> CalibrationDesk::Save() {
  const absl::StatusOr<CalibrationFile> file = File("saccade");
  if (!file.ok()) return file.status();
  CalibrationState next = *state();
  if (!next.result->doubt.empty()) return absl::FailedPreconditionError(next.result->doubt);
  if (options_.keep_as.empty()) {
    return absl::FailedPreconditionError(
        "calibration: this server has nowhere to keep it; download the file, and start the server "
        "with --camera FILE");
  }
  if (absl::Status put = KeepCameraFile(options_.keep_as, file->text); !put.ok()) return put;
  next.saved_as = options_.keep_as.string();
  Publish(next);
  return next.saved_as;
}

void CalibrationDesk::Publish(CalibrationState next) {
  const std::lock_guard lock(mutex_);
  showing_ = next.phase == Phase::kShowing;
  if (!showing_) newest_ = nullptr;
  state_ = std::make_shared<const CalibrationState>(std::move(next));
}

}  // namespace saccade
