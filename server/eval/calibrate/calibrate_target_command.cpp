#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <cmath>
#include <iostream>

#include "server/capture/camera_file.hpp"
#include "server/capture/camera_yaml.hpp"
#include "server/eval/calibrate/lens_report.hpp"
#include "server/eval/calibrate/source_pictures.hpp"
#include "server/eval/calibrate/target_views.hpp"
#include "server/eval/calibrate/walls_fit.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/output_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

/// The pictures that are named, and how many a second there are of them (0: unknown).
absl::StatusOr<PictureSet> Pictures(const CalibrateTargetArguments& arguments, double& fps) {
  if (arguments.images.empty() == arguments.source.empty()) {
    return absl::InvalidArgumentError(
        "give --images DIR or --source URI (v4l2:DEVICE, file:VIDEO, dataset:DIR, sim:...), one of "
        "them");
  }
  if (!arguments.images.empty()) return PicturesOfFolder(arguments.images);
  return PicturesOfSource(arguments.source, arguments.frames, arguments.seconds, fps);
}

/// As named, or the sheet whose description lies beside the pictures.
std::string TargetOf(const CalibrateTargetArguments& arguments) {
  const std::filesystem::path own = arguments.images / "aprilgrid.yaml";
  if (!arguments.target.empty() || arguments.images.empty() || !MayExist(own)) {
    return arguments.target;
  }
  return "aprilgrid:" + own.string();
}

/// Bayes' information criterion of a fit: less is better.
double Information(const LensReport& report, std::size_t corners) {
  const double n = 2.0 * static_cast<double>(corners);
  return n * std::log(report.fit.rms_px * report.fit.rms_px) +
         static_cast<double>(report.fit.values.size()) * std::log(n);
}

/// By the model that is asked for, or the better of both by what it explains.
absl::StatusOr<LensReport> FitBest(const TargetViews& seen, const std::string& source,
                                   const std::string& lens) {
  ViewPicker picker(seen.size);
  std::size_t corners = 0;
  for (const BoardView& view : seen.views) {
    picker.Take(view);
    corners += view.corners.size();
  }
  std::vector<LensModel> models = {LensModel::kBrownConrady, LensModel::kKannalaBrandt};
  if (lens == "brown_conrady") models = {LensModel::kBrownConrady};
  if (lens == "kannala_brandt") models = {LensModel::kKannalaBrandt};
  absl::StatusOr<LensReport> best = absl::UnknownError("");
  for (const LensModel model : models) {
    absl::StatusOr<LensReport> report =
        Calibrate(source, picker, seen.target, seen.size, model, false);
    const bool better =
        !best.ok() || (report.ok() && Information(*report, corners) < Information(*best, corners));
    if (better) best = std::move(report);
  }
  return best;
}

/// Written only if it can be read.
absl::Status WriteCamera(const std::filesystem::path& out, const std::string& text) {
  if (absl::Status put = WriteFileAtomically(out, text); !put.ok()) return put;
  const absl::StatusOr<CameraIntrinsics> read = LoadCamera(out);
  if (read.ok()) return absl::OkStatus();
  std::error_code error;
  std::filesystem::remove(out, error);
  return absl::FailedPreconditionError(
      absl::StrCat("the lens found is none that can be (", read.status().message(),
                   "); take pictures with the target at all edges, tilted each way"));
}

absl::Status CalibrateWalls(const PictureSet& pictures, const CalibrateTargetArguments& arguments,
                            double fps) {
  const std::string file = arguments.target.substr(arguments.target.find(':') + 1);
  const absl::StatusOr<WallSquares> walls = LoadWallSquares(file);
  if (!walls.ok()) return walls.status();
  absl::StatusOr<WallsFit> fit = FitWalls(pictures, *walls, arguments.border_bits);
  if (!fit.ok()) return fit.status();
  if (fps > 0) fit->lens.fps = fps;
  std::cout << (arguments.json ? WallsJson(*fit).dump(2) + "\n" : WallsText(*fit));
  return WriteCamera(
      arguments.out,
      CameraYaml(fit->lens, absl::StrCat("squares on walls (", file, "), ", fit->views.size(),
                                         " views of ", pictures.source)));
}

}  // namespace

absl::Status CalibrateTargetCommand(const CalibrateTargetArguments& arguments) {
  if (MayExist(arguments.out)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out: ", arguments.out.string(), " exists; name a new file"));
  }
  double fps = 0;
  const absl::StatusOr<PictureSet> pictures = Pictures(arguments, fps);
  if (!pictures.ok()) return pictures.status();
  if (absl::StartsWith(arguments.target, "walls:")) {
    return CalibrateWalls(*pictures, arguments, fps);
  }
  const absl::StatusOr<TargetViews> seen =
      FindTarget(*pictures, TargetOf(arguments), arguments.border_bits);
  if (!seen.ok()) return seen.status();
  absl::StatusOr<LensReport> report = FitBest(*seen, pictures->source, arguments.lens);
  if (!report.ok()) return report.status();
  if (fps > 0) report->fit.lens.fps = fps;
  std::cout << (arguments.json ? ReportJson(*report).dump(2) + "\n" : ReportText(*report));
  if (const absl::Status enough = Judge(*report); !enough.ok()) {
    std::cerr << "warning: " << enough.message() << "\n";
  }
  return WriteCamera(arguments.out, CameraYaml(report->fit.lens, CameraFileHeader(*report)));
}

}  // namespace saccade
