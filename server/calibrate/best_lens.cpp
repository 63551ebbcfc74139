#include "server/calibrate/best_lens.hpp"

#include <cmath>
#include <vector>

namespace saccade {
namespace {

/// Bayes' information criterion of a fit: less is better.
double Information(const LensReport& report, std::size_t corners) {
  const double n = 2.0 * static_cast<double>(corners);
  return n * std::log(report.fit.rms_px * report.fit.rms_px) +
         static_cast<double>(report.fit.values.size()) * std::log(n);
}

}  // namespace

absl::StatusOr<LensReport> FitBest(const std::string& source, const ViewPicker& picker,
                                   const std::string& target, cv::Size picture,
                                   const LensWish& wish) {
  std::size_t corners = 0;
  for (const BoardView& view : picker.views()) corners += view.corners.size();
  std::vector<LensChoice> choices;
  if (wish.lens != "kannala_brandt") {
    choices.emplace_back(LensModel::kBrownConrady, wish.form != CameraTextForm::kKalibr);
  }
  if (wish.lens != "brown_conrady") choices.emplace_back(LensModel::kKannalaBrandt);
  absl::StatusOr<LensReport> best = absl::UnknownError("");
  for (const LensChoice choice : choices) {
    absl::StatusOr<LensReport> report =
        Calibrate(source, picker, target, picture, choice, wish.hold_out, wish.stop);
    const bool better =
        !best.ok() || (report.ok() && Information(*report, corners) < Information(*best, corners));
    if (better) best = std::move(report);
  }
  return best;
}

}  // namespace saccade
