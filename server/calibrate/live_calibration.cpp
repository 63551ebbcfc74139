#include "server/calibrate/live_calibration.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {
namespace {

constexpr int kRounds = 2;

}  // namespace

LiveCalibration::Look LiveCalibration::Offer(std::uint64_t frame, Timestamp time_ns,
                                             const cv::Mat& grey) {
  BoardView view{frame, time_ns, {}, {}};
  target_->Find(grey, view);
  Look look{view.corners, std::nullopt, ""};
  if (!view.corners.empty()) look.verdict = picker_.Offer(view);
  if (look.verdict == ViewPicker::Verdict::kTaken && target_->refines()) {
    pictures_.push_back(grey.clone());  // a source may use its buffer again
  }
  look.next = picker_.Advice();
  if (!look.verdict) {
    look.next = absl::StrCat(target_->missing(), ": show it without glare; ", look.next);
  } else if (look.verdict == ViewPicker::Verdict::kMoving) {
    look.next = "hold it still; " + look.next;
  }
  return look;
}

absl::StatusOr<LensReport> LiveCalibration::Fit(const std::string& source, const LensWish& wish) {
  refined_.reset();
  absl::StatusOr<LensReport> report = FitBest(source, picker_, target_->words(), picture_, wish);
  for (int round = 0; round < kRounds && report.ok() && target_->refines(); ++round) {
    const CameraModel camera(report->fit.lens);
    ViewPicker refined(picture_);
    for (std::size_t k = 0; k < picker_.views().size(); ++k) {
      BoardView view = picker_.views()[k];
      if (target_->Refine(pictures_[k], camera, view)) refined.Take(view);
    }
    report = FitBest(source, refined, target_->words(), picture_, wish);
    refined_ = std::move(refined);
  }
  return report;
}

absl::StatusOr<LensReport> LiveCalibration::FitAgain(const std::string& source,
                                                     const LensWish& wish) const {
  return FitBest(source, refined_ ? *refined_ : picker_, target_->words(), picture_, wish);
}

}  // namespace saccade
