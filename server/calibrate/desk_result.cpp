#include "server/calibrate/desk_result.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/capture/camera_files/camera_draft.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostErrors = 2000;
constexpr int kShownWidth_px = 800, kJpegQuality = 70;

}  // namespace

std::shared_ptr<const CalibrationResult> DeskResultOf(const LensReport& report) {
  auto result = std::make_shared<CalibrationResult>();
  result->model = std::string(LensOf(report.fit.lens.model).name);
  result->rms_px = report.fit.rms_px;
  result->held_out_rms_px = report.held_out_rms_px;
  for (std::size_t k = 0; k < report.fit.names.size(); ++k) {
    result->parameters.push_back({report.fit.names[k], report.fit.values[k], report.fit.sigmas[k]});
  }
  for (const ViewFit& view : report.fit.views) {
    result->views.push_back({view.frame, view.rms_px, view.rejected, false});
  }
  for (const ViewFit& view : report.held_out) {
    result->views.push_back({view.frame, view.rms_px, false, true});
  }
  const std::size_t every = std::max<std::size_t>(1, (report.errors.size() - 1) / kMostErrors + 1);
  for (std::size_t k = 0; k < report.errors.size(); k += every) {
    const CornerError& error = report.errors[k];
    for (const double value : {error.x, error.y, error.dx, error.dy}) {
      result->residuals_px.push_back(static_cast<float>(value));
    }
  }
  const absl::Status enough = Judge(report);
  result->doubt = std::string(enough.message());
  return result;
}

std::shared_ptr<const CalibrationPicture> DeskPictureOf(const Frame& frame,
                                                        const LiveCalibration::Look& look) {
  auto picture = std::make_shared<CalibrationPicture>();
  picture->frame = frame.id;
  picture->width = frame.grey.cols;
  picture->height = frame.grey.rows;
  picture->taken = look.verdict == ViewPicker::Verdict::kTaken;
  for (const cv::Point2d& corner : look.corners) {
    picture->corners_px.push_back(static_cast<float>(corner.x));
    picture->corners_px.push_back(static_cast<float>(corner.y));
  }
  cv::Mat small = frame.color.empty() ? frame.grey : frame.color;
  if (small.cols > kShownWidth_px) {
    const double scale = static_cast<double>(kShownWidth_px) / small.cols;
    cv::resize(small, small, {}, scale, scale, cv::INTER_AREA);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  picture->jpeg.assign(bytes.begin(), bytes.end());
  return picture;
}

CalibrationState DeskBegin(const std::string& target, const std::string& words) {
  CalibrationState state;
  state.phase = CalibrationState::Phase::kShowing;
  state.target = target;
  state.target_words = words;
  state.advice = "show the whole board";
  state.enough_views = ViewPicker::kEnoughViews;
  state.columns = ViewPicker::kColumns;
  state.rows = ViewPicker::kRows;
  state.counts.assign(ViewPicker::kColumns * ViewPicker::kRows, 0);
  return state;
}

}  // namespace saccade
