#include "server/calibrate/target_views.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <functional>
#include <iostream>

#include "server/calibrate/grid_pictures.hpp"
#include "server/calibrate/target.hpp"
#include "server/calibrate/target_grid.hpp"

namespace saccade {
namespace {

void SayProgress(const std::string& step, std::size_t done, std::size_t all) {
  if (done % 20 == 0 || done == all) std::cerr << step << ": " << done << " of " << all << "\n";
}

void SayLeftOut(absl::string_view why) { std::cerr << "left out: " << why << "\n"; }

/// Each picture by itself.
TargetViews FindInEach(const PictureSet& pictures, LensTarget& target) {
  TargetViews seen{{}, target.words(), {}};
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const absl::StatusOr<cv::Mat> grey = pictures.load(k);
    SayProgress("reading", k + 1, pictures.size());
    if (!grey.ok()) {
      SayLeftOut(grey.status().message());
      continue;
    }
    if (seen.size.empty()) seen.size = grey->size();
    if (grey->size() != seen.size) {
      SayLeftOut(absl::StrCat(pictures.names[k], ": is of another size than those before"));
      continue;
    }
    BoardView view;
    view.frame = k;
    view.time_ns = static_cast<Timestamp>(k) * 1'000'000'000;
    target.Find(*grey, view);
    if (view.corners.empty()) {
      SayLeftOut(absl::StrCat(pictures.names[k], ": ", target.missing()));
    } else {
      seen.views.push_back(std::move(view));
    }
  }
  return seen;
}

absl::StatusOr<TargetViews> FindGrid(const PictureSet& pictures, const std::string& text,
                                     int border_bits) {
  const absl::StatusOr<TagGrid> grid = TagGridOf(text);
  if (!grid.ok()) return grid.status();
  absl::StatusOr<GridPictures> read =
      GridPictures::Read(pictures, *grid, border_bits, "apriltag", SayProgress,
                         [](const absl::Status& why) { SayLeftOut(why.message()); });
  if (!read.ok()) return read.status();
  const absl::StatusOr<CalibratedLens> fit = read->Search(LensModel::kBrownConrady);
  if (!fit.ok()) return fit.status();
  return TargetViews{
      read->Views(),
      absl::StrCat("aprilgrid of ", grid->columns, " x ", grid->rows, ", ", grid->side_m, " m"),
      read->size()};
}

}  // namespace

absl::StatusOr<TargetViews> FindTarget(const PictureSet& pictures, const std::string& target,
                                       int border_bits) {
  absl::string_view rest = target;
  if (absl::ConsumePrefix(&rest, "aprilgrid:")) {
    return FindGrid(pictures, std::string(rest), border_bits);
  }
  const absl::StatusOr<std::unique_ptr<LensTarget>> made = MakeLensTarget(target, border_bits);
  if (!made.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--", made.status().message(),
                     target.find(':') == std::string::npos ? ", or walls:FILE.yaml" : ""));
  }
  return FindInEach(pictures, **made);
}

}  // namespace saccade
