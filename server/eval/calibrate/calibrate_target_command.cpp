#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <cmath>
#include <iostream>

#include "server/capture/camera_file.hpp"
#include "server/capture/camera_yaml.hpp"
#include "server/eval/calibrate/grid_pictures.hpp"
#include "server/eval/calibrate/lens_report.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/markers/picture_folder.hpp"
#include "server/eval/output_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Files = std::vector<std::filesystem::path>;

void SayProgress(const std::string& step, std::size_t done, std::size_t all) {
  if (done % 20 == 0 || done == all) std::cerr << step << ": " << done << " of " << all << "\n";
}

/// What the pictures showed.
struct Seen {
  std::vector<BoardView> views;
  std::string board;  // in words
  cv::Size size;
};

absl::StatusOr<Seen> SeeChessboard(const Files& files, const std::string& pattern_text) {
  const std::vector<std::string> parts = absl::StrSplit(pattern_text, ':');
  double square_m = 0;
  if (parts.size() != 2 || !absl::SimpleAtod(parts[1], &square_m)) {
    return absl::InvalidArgumentError(
        "--target: give a chessboard's inner corners and the side of a square in metres, as in "
        "chessboard:9x6:0.04");
  }
  const absl::StatusOr<BoardPattern> pattern = ParseBoard(parts[0], square_m);
  if (!pattern.ok()) return pattern.status();
  Seen seen{{}, pattern->Words(), {}};
  for (std::size_t k = 0; k < files.size(); ++k) {
    const absl::StatusOr<cv::Mat> grey = LoadGrey(files[k]);
    SayProgress("reading", k + 1, files.size());
    if (grey.ok() && seen.size.empty()) seen.size = grey->size();
    if (!grey.ok() || grey->size() != seen.size) {
      std::cerr << "left out: "
                << (grey.ok() ? files[k].string() + ": is of another size than those before"
                              : std::string(grey.status().message()))
                << "\n";
      continue;
    }
    BoardView view{k, static_cast<Timestamp>(k) * 1'000'000'000, FindBoard(*grey, *pattern),
                   pattern->Points()};
    if (view.corners.empty()) {
      std::cerr << "left out: " << files[k].string() << ": no whole board in view\n";
    } else {
      seen.views.push_back(std::move(view));
    }
  }
  return seen;
}

absl::StatusOr<Seen> SeeGrid(const Files& files, const TagGrid& grid, int border_bits) {
  const int border = border_bits > 0 ? border_bits : BorderBitsOf(files, grid);
  absl::StatusOr<TagFamily> family = TagFamily::Make(grid.family, border);
  if (!family.ok()) return family.status();
  std::vector<std::unique_ptr<MarkerDetector>> detectors;
  for (const char* name : {"apriltag", "aruco"}) {
    auto detector = MakeMarkerDetector(name, {{grid.family}, border});
    if (!detector.ok()) return detector.status();
    detectors.push_back(*std::move(detector));
  }
  GridPictures pictures(grid, *std::move(family), SayProgress);
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (absl::Status read = pictures.Read(files[k], detectors); !read.ok()) {
      std::cerr << "left out: " << read.message() << "\n";
    }
    SayProgress("reading", k + 1, files.size());
  }
  const absl::StatusOr<LensFit> fit = pictures.Search(LensModel::kBrownConrady);
  if (!fit.ok()) return fit.status();
  return Seen{
      pictures.Views(),
      absl::StrCat("aprilgrid of ", grid.columns, " x ", grid.rows, ", ", grid.side_m, " m"),
      pictures.size()};
}

absl::StatusOr<Seen> See(const Files& files, const CalibrateTargetArguments& arguments) {
  absl::string_view rest = arguments.target;
  if (absl::ConsumePrefix(&rest, "chessboard:")) return SeeChessboard(files, std::string(rest));
  const std::filesystem::path own = arguments.images / "aprilgrid.yaml";
  if (arguments.target.empty() && MayExist(own)) {
    const absl::StatusOr<TagGrid> grid = LoadTagGrid(own);
    return grid.ok() ? SeeGrid(files, *grid, arguments.border_bits) : grid.status();
  }
  if (absl::ConsumePrefix(&rest, "aprilgrid:")) {
    const std::string text(rest);
    const absl::StatusOr<TagGrid> grid = MayExist(text) ? LoadTagGrid(text) : ParseTagGrid(text);
    return grid.ok() ? SeeGrid(files, *grid, arguments.border_bits) : grid.status();
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "--target: '", arguments.target,
      "' is none; give chessboard:9x6:0.04, aprilgrid:6x6:0.088:0.3 or aprilgrid:FILE.yaml"));
}

/// Bayes' information criterion of a fit: less is better.
double Information(const LensReport& report, std::size_t corners) {
  const double n = 2.0 * static_cast<double>(corners);
  return n * std::log(report.fit.rms_px * report.fit.rms_px) +
         static_cast<double>(report.fit.values.size()) * std::log(n);
}

/// By the model that is asked for, or the better of both by what it explains.
absl::StatusOr<LensReport> FitBest(const Seen& seen, const CalibrateTargetArguments& arguments) {
  ViewPicker picker(seen.size);
  std::size_t corners = 0;
  for (const BoardView& view : seen.views) {
    picker.Take(view);
    corners += view.corners.size();
  }
  std::vector<LensModel> models = {LensModel::kBrownConrady, LensModel::kKannalaBrandt};
  if (arguments.lens == "brown_conrady") models = {LensModel::kBrownConrady};
  if (arguments.lens == "kannala_brandt") models = {LensModel::kKannalaBrandt};
  absl::StatusOr<LensReport> best = absl::UnknownError("");
  for (const LensModel model : models) {
    absl::StatusOr<LensReport> report =
        Calibrate(arguments.images.string(), picker, seen.board, seen.size, model, false);
    const bool better =
        !best.ok() || (report.ok() && Information(*report, corners) < Information(*best, corners));
    if (better) best = std::move(report);
  }
  return best;
}

}  // namespace

absl::Status CalibrateTargetCommand(const CalibrateTargetArguments& arguments) {
  if (MayExist(arguments.out)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out: ", arguments.out.string(), " exists; name a new file"));
  }
  const absl::StatusOr<Files> files = PicturesIn(arguments.images);
  if (!files.ok()) return files.status();
  const absl::StatusOr<Seen> seen = See(*files, arguments);
  if (!seen.ok()) return seen.status();
  const absl::StatusOr<LensReport> report = FitBest(*seen, arguments);
  if (!report.ok()) return report.status();
  std::cout << (arguments.json ? ReportJson(*report).dump(2) + "\n" : ReportText(*report));
  if (const absl::Status enough = Judge(*report); !enough.ok()) {
    std::cerr << "warning: " << enough.message() << "\n";
  }
  const std::string text = CameraYaml(report->fit.lens, CameraFileHeader(*report));
  if (absl::Status put = WriteFileAtomically(arguments.out, text); !put.ok()) return put;
  const absl::StatusOr<CameraIntrinsics> read = LoadCamera(arguments.out);
  if (read.ok()) return absl::OkStatus();
  std::error_code error;
  std::filesystem::remove(arguments.out, error);
  return absl::FailedPreconditionError(
      absl::StrCat("the lens found is none that can be (", read.status().message(),
                   "); take pictures with the target at all edges, tilted each way"));
}

}  // namespace saccade
