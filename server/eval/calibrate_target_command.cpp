#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <iostream>

#include "server/calibrate/best_lens.hpp"
#include "server/calibrate/camera_output.hpp"
#include "server/calibrate/lens_report.hpp"
#include "server/calibrate/target_views.hpp"
#include "server/calibrate/walls_fit.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/source_pictures.hpp"
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

ViewPicker PickerOf(const TargetViews& seen) {
  ViewPicker picker(seen.size);
  for (const BoardView& view : seen.views) picker.Take(view);
  return picker;
}

absl::Status CalibrateWalls(const PictureSet& pictures, const CalibrateTargetArguments& arguments,
                            CameraTextForm form, double fps) {
  const std::string file = arguments.target.substr(arguments.target.find(':') + 1);
  const absl::StatusOr<WallSquares> walls = LoadWallSquares(file);
  if (!walls.ok()) return walls.status();
  absl::StatusOr<WallsFit> fit = FitWalls(pictures, *walls, arguments.border_bits);
  if (!fit.ok()) return fit.status();
  if (fps > 0) fit->lens.fps = fps;
  std::cout << (arguments.json ? WallsJson(*fit).dump(2) + "\n" : WallsText(*fit));
  return WriteCameraFile(arguments.out, form, fit->lens,
                         absl::StrCat("squares on walls (", file, "), ", fit->views.size(),
                                      " views of ", pictures.source));
}

}  // namespace

absl::Status CalibrateTargetCommand(const CalibrateTargetArguments& arguments) {
  const absl::StatusOr<CameraTextForm> form = ParseCameraTextForm(arguments.form);
  if (!form.ok()) return form.status();
  if (absl::Status possible = CheckCameraOut(arguments.out); !possible.ok()) return possible;
  double fps = 0;
  const absl::StatusOr<PictureSet> pictures = Pictures(arguments, fps);
  if (!pictures.ok()) return pictures.status();
  if (absl::StartsWith(arguments.target, "walls:")) {
    return CalibrateWalls(*pictures, arguments, *form, fps);
  }
  const absl::StatusOr<TargetViews> seen =
      FindTarget(*pictures, TargetOf(arguments), arguments.border_bits);
  if (!seen.ok()) return seen.status();
  absl::StatusOr<LensReport> report =
      FitBest(pictures->source, PickerOf(*seen), seen->target, seen->size,
              {arguments.lens, *form, /*hold_out=*/false});
  if (!report.ok()) return report.status();
  if (fps > 0) report->fit.lens.fps = fps;
  std::cout << (arguments.json ? ReportJson(*report).dump(2) + "\n" : ReportText(*report));
  if (const absl::Status enough = Judge(*report); !enough.ok()) {
    std::cerr << "warning: " << enough.message() << "\n";
  }
  return WriteCameraFile(arguments.out, *form, report->fit.lens, CameraFileHeader(*report));
}

}  // namespace saccade
