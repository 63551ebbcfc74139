#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <map>

#include "server/eval/calibrate/grid_pictures.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/markers/picture_folder.hpp"
#include "server/eval/output_file.hpp"
#include "server/markers/marker_detector.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr char kHeader[] =
    "file,family,id,x0,y0,x1,y1,x2,y2,x3,y3,variance0,variance1,variance2,variance3\n";

std::string Row(const std::filesystem::path& file, const MarkerSighting& sighting) {
  std::string row = absl::StrCat(file.filename().string(), ",", sighting.family, ",", sighting.id);
  for (const Eigen::Vector2d& corner : sighting.corners) {
    absl::StrAppendFormat(&row, ",%.4f,%.4f", corner.x(), corner.y());
  }
  for (const double variance : sighting.variance_px2)
    absl::StrAppendFormat(&row, ",%.6g", variance);
  return row + "\n";
}

/// The sheet that the pictures show: named, or the folder's own; none is no error.
absl::StatusOr<std::optional<TagGrid>> GridOf(const MarkersArguments& arguments) {
  if (arguments.grid == "none") return std::nullopt;
  const std::filesystem::path own = arguments.images / "aprilgrid.yaml";
  if (arguments.grid.empty() && !MayExist(own)) return std::nullopt;
  const absl::StatusOr<TagGrid> grid = arguments.grid.empty()     ? LoadTagGrid(own)
                                       : MayExist(arguments.grid) ? LoadTagGrid(arguments.grid)
                                                                  : ParseTagGrid(arguments.grid);
  if (!grid.ok()) return grid.status();
  return *grid;
}

struct Tally {
  std::map<std::string, std::size_t> of_family;
  std::size_t pictures = 0, with_markers = 0, unreadable = 0;
};

void Count(const std::vector<MarkerSighting>& sightings, Tally& tally) {
  tally.with_markers += !sightings.empty();
  ++tally.pictures;
  for (const MarkerSighting& sighting : sightings) ++tally.of_family[sighting.family];
}

void SayUnreadable(const absl::Status& problem, Tally& tally) {
  std::cerr << "left out: " << problem.message() << "\n";
  ++tally.unreadable;
}

void SayProgress(const std::string& step, std::size_t done, std::size_t all) {
  if (done % 50 == 0 || done == all) std::cerr << step << ": " << done << " of " << all << "\n";
}

/// Each picture by itself.
absl::Status DetectEach(const std::vector<std::filesystem::path>& files, MarkerDetector& detector,
                        OutputFile& out, Tally& tally) {
  for (std::size_t k = 0; k < files.size(); ++k) {
    const absl::StatusOr<cv::Mat> grey = LoadGrey(files[k]);
    if (grey.ok()) {
      const std::vector<MarkerSighting> sightings = detector.Detect(*grey);
      for (const MarkerSighting& sighting : sightings) out.Write(Row(files[k], sighting));
      Count(sightings, tally);
    } else {
      SayUnreadable(grey.status(), tally);
    }
    SayProgress("reading", k + 1, files.size());
  }
  return out.status();
}

/// With what is known of the sheet: the second step.
absl::Status DetectGrid(const TagGrid& grid, const MarkersArguments& arguments, OutputFile& out,
                        Tally& tally) {
  const absl::StatusOr<PictureSet> set = PicturesOfFolder(arguments.images);
  if (!set.ok()) return set.status();
  absl::StatusOr<GridPictures> pictures =
      GridPictures::Read(*set, grid, arguments.border_bits, arguments.detector, SayProgress,
                         [&](const absl::Status& why) { SayUnreadable(why, tally); });
  if (!pictures.ok()) return pictures.status();
  const absl::StatusOr<LensFit> fit = pictures->Search(LensModel::kBrownConrady);
  if (!fit.ok()) {
    std::cerr << "the sheet was not searched for: " << fit.status().message() << "\n";
  }
  for (const GridPicture& picture : pictures->pictures()) {
    const std::vector<MarkerSighting>& sightings =
        picture.found ? picture.found->sightings : picture.read;
    for (const MarkerSighting& sighting : sightings)
      out.Write(Row(set->names[picture.number], sighting));
    Count(sightings, tally);
  }
  return out.status();
}

}  // namespace

absl::Status MarkersCommand(const MarkersArguments& arguments) {
  const auto files = PicturesIn(arguments.images);
  if (!files.ok()) return files.status();
  auto detector = MakeMarkerDetector(arguments.detector,
                                     {arguments.families, std::max(1, arguments.border_bits)});
  if (!detector.ok()) return detector.status();
  const absl::StatusOr<std::optional<TagGrid>> grid = GridOf(arguments);
  if (!grid.ok()) return grid.status();
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  absl::StatusOr<OutputFile> out = OutputFile::Create(arguments.out / "detections.csv");
  if (!out.ok()) return out.status();
  out->Write(kHeader);
  Tally tally;
  const absl::Status done = *grid ? DetectGrid(**grid, arguments, *out, tally)
                                  : DetectEach(*files, **detector, *out, tally);
  if (!done.ok()) return done;
  if (absl::Status closed = out->Close(); !closed.ok()) return closed;
  std::cout << tally.pictures << " pictures, " << tally.with_markers << " with markers";
  for (const auto& [family, count] : tally.of_family) std::cout << "; " << count << " " << family;
  std::cout << "; " << (arguments.out / "detections.csv").string() << "\n";
  if (tally.pictures == 0) {
    return absl::DataLossError(absl::StrCat("--images: none of the ", tally.unreadable,
                                            " pictures in ", arguments.images.string(),
                                            " can be read"));
  }
  return absl::OkStatus();
}

}  // namespace saccade
