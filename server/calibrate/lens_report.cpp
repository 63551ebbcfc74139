#include "server/calibrate/lens_report.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "shared/version/version.hpp"

namespace saccade {
namespace {

constexpr int kLeastViews = 8;
constexpr double kTilted = 0.22;  // sine of a normal's lean: 13 deg
constexpr int kLeastTilted = 2;
constexpr double kMostFocalSigma = 0.01;    // of the focal length
constexpr double kMostCentreSigma = 0.015;  // of the width
constexpr double kLeastCovered = 0.5;
constexpr double kMostHeldOut = 2.0, kHeldOutSlack_px = 0.2;  // against the fit's own rms

std::size_t Used(const LensReport& report) {
  return static_cast<std::size_t>(
      std::count_if(report.fit.views.begin(), report.fit.views.end(),
                    [](const ViewFit& view) { return !view.rejected; }));
}

absl::Status Thin(const std::string& what, const std::string& remedy) {
  return absl::FailedPreconditionError(
      absl::StrCat("too little to believe: ", what, "; ", remedy, ", and calibrate again"));
}

absl::Status JudgeNumbers(const LensReport& report) {
  const Eigen::VectorXd& sigmas = report.fit.sigmas;
  const double focal = std::max(sigmas[0] / report.fit.values[0], sigmas[1] / report.fit.values[1]);
  if (!(focal < kMostFocalSigma)) {
    return Thin(absl::StrFormat("the focal length is known to %.1f %% only", 100 * focal),
                "show the board nearer, and tilted by 30 degrees in all four directions");
  }
  const double centre = std::max(sigmas[2], sigmas[3]) / report.fit.lens.width;
  if (!(centre < kMostCentreSigma)) {
    return Thin(
        absl::StrFormat("the centre is known to %.1f %% of the picture's width only", 100 * centre),
        "show the board tilted, and at all edges of the picture");
  }
  if (!report.held_out.empty() &&
      report.held_out_rms_px > kMostHeldOut * report.fit.rms_px + kHeldOutSlack_px) {
    return Thin(absl::StrFormat("views left out of the fit miss it by %.2f px, those in it by "
                                "%.2f px",
                                report.held_out_rms_px, report.fit.rms_px),
                "take more views, with the board flat and the camera's focus fixed");
  }
  return absl::OkStatus();
}

void AddErrors(const std::vector<BoardView>& views, LensReport& report) {
  const CameraModel camera(report.fit.lens);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewFit& fit = report.fit.views[v];
    if (fit.rejected) continue;
    cv::Matx33d turn;
    cv::Rodrigues(fit.rotation, turn);
    for (std::size_t k = 0; k < views[v].corners.size(); ++k) {
      const cv::Vec3d at = turn * cv::Vec3d(views[v].points[k]) + fit.translation_m;
      const auto pixel = camera.Project({at[0], at[1], at[2]});
      const cv::Point2d& seen = views[v].corners[k];
      if (pixel) {
        report.errors.push_back({seen.x, seen.y, pixel->x() - seen.x, pixel->y() - seen.y});
      }
    }
  }
}

}  // namespace

absl::StatusOr<LensReport> Calibrate(const std::string& source, const ViewPicker& picker,
                                     const std::string& board, cv::Size picture, LensChoice choice,
                                     bool hold_out, std::stop_token stop) {
  LensReport report;
  report.source = source;
  report.board = board;
  std::vector<BoardView> fitted, held_out;
  for (std::size_t k = 0; k < picker.views().size(); ++k) {
    const bool hold = hold_out && k % 5 == 4 && picker.views().size() >= 10;
    (hold ? held_out : fitted).push_back(picker.views()[k]);
  }
  absl::StatusOr<CalibratedLens> fit = FitLens(fitted, picture, choice, std::move(stop));
  if (!fit.ok()) return fit.status();
  report.fit = *std::move(fit);
  AddErrors(fitted, report);
  std::vector<double> squares;
  for (const BoardView& view : held_out) {
    report.held_out.push_back(FitView(view, report.fit));
    squares.push_back(std::pow(report.held_out.back().rms_px, 2));
  }
  // The median: one held-out view may be what the fit would have rejected.
  if (!squares.empty()) {
    std::nth_element(squares.begin(), squares.begin() + squares.size() / 2, squares.end());
    report.held_out_rms_px = std::sqrt(squares[squares.size() / 2]);
  }
  report.covered = picker.Covered();
  for (int row = 0; row < ViewPicker::kRows; ++row) {
    for (int column = 0; column < ViewPicker::kColumns; ++column) {
      report.counts.push_back(picker.Corners(column, row));
    }
  }
  for (const ViewFit& view : report.fit.views) {
    if (view.rejected) continue;
    report.tilted_x += std::abs(view.normal().x()) > kTilted;
    report.tilted_y += std::abs(view.normal().y()) > kTilted;
  }
  return report;
}

absl::Status Judge(const LensReport& report) {
  const std::size_t used = Used(report);
  if (used < kLeastViews) {
    return Thin(absl::StrCat(used, " views of the board that differ and fit, of ", kLeastViews),
                "show the whole board for longer, at other places and tilts");
  }
  if (report.tilted_x < kLeastTilted || report.tilted_y < kLeastTilted) {
    return Thin(absl::StrCat("the board was hardly ",
                             report.tilted_x < kLeastTilted ? "turned to the left or right"
                                                            : "tilted forwards or backwards",
                             " (a board seen straight on does not determine the focal length)"),
                "tilt it by 30 degrees, each side once towards the camera");
  }
  if (report.covered < kLeastCovered) {
    return Thin(
        absl::StrFormat("the board was in %.0f %% of the picture only", 100 * report.covered),
        "move it to all edges and corners");
  }
  return JudgeNumbers(report);
}

std::string ReportText(const LensReport& report) {
  std::string text = absl::StrFormat(
      "%d views fitted, %d rejected, %d held out; rms %.3f px, held out %.3f px; %.0f %% of the "
      "picture; tilted %d to a side, %d forwards or backwards\n",
      Used(report), report.fit.views.size() - Used(report), report.held_out.size(),
      report.fit.rms_px, report.held_out_rms_px, 100 * report.covered, report.tilted_x,
      report.tilted_y);
  for (std::size_t k = 0; k < report.fit.names.size(); ++k) {
    absl::StrAppendFormat(&text, "  %-3s %12.5f  +- %.5f\n", report.fit.names[k],
                          report.fit.values[k], report.fit.sigmas[k]);
  }
  absl::StrAppend(&text, "corners in each part of the picture:\n");
  for (std::size_t k = 0; k < report.counts.size(); ++k) {
    absl::StrAppendFormat(&text, "%6d%s", report.counts[k],
                          k % ViewPicker::kColumns == ViewPicker::kColumns - 1 ? "\n" : "");
  }
  absl::StrAppend(&text, "views (frame: rms):");
  for (const ViewFit& view : report.fit.views) {
    absl::StrAppendFormat(&text, " %d: %.3f%s", view.frame, view.rms_px,
                          view.rejected ? " (rejected)" : "");
  }
  for (const ViewFit& view : report.held_out) {
    absl::StrAppendFormat(&text, " %d: %.3f (held out)", view.frame, view.rms_px);
  }
  return absl::StrCat(text, "\n");
}

nlohmann::ordered_json ReportJson(const LensReport& report) {
  nlohmann::ordered_json parameters, views = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < report.fit.names.size(); ++k) {
    parameters[report.fit.names[k]] = {{"value", report.fit.values[k]},
                                       {"sigma", report.fit.sigmas[k]}};
  }
  for (const ViewFit& view : report.fit.views) {
    views.push_back({{"frame", view.frame},
                     {"rms_px", view.rms_px},
                     {"use", view.rejected ? "rejected" : "fitted"}});
  }
  for (const ViewFit& view : report.held_out) {
    views.push_back({{"frame", view.frame}, {"rms_px", view.rms_px}, {"use", "held_out"}});
  }
  return {{"rms_px", report.fit.rms_px},
          {"held_out_rms_px", report.held_out_rms_px},
          {"covered", report.covered},
          {"tilted_to_a_side", report.tilted_x},
          {"tilted_forwards_or_backwards", report.tilted_y},
          {"parameters", parameters},
          {"views", views}};
}

std::string CameraFileHeader(const LensReport& report) {
  std::string sigmas;
  for (std::size_t k = 0; k < report.fit.names.size(); ++k) {
    absl::StrAppendFormat(&sigmas, "%s%s %.3g", k == 0 ? "" : ", ", report.fit.names[k],
                          report.fit.sigmas[k]);
  }
  return absl::StrFormat(
      "Made by saccade %s from %s\n"
      "# %s; %d views, rms %.3f px; %d held out, %.3f px\n"
      "# one sigma: %s",
      Version(), report.source, report.board, Used(report), report.fit.rms_px,
      report.held_out.size(), report.held_out_rms_px, sigmas);
}

}  // namespace saccade
