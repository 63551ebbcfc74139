#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <map>

#include "server/calibrate/grid_pictures.hpp"
#include "server/calibrate/picture_folder.hpp"
#include "server/capture/image_file.hpp"
#include "server/eval/commands.hpp"
#include "server/eval/markers/sighting_csv.hpp"
#include "server/eval/output_file.hpp"
#include "server/markers/marker_detector.hpp"
#include "server/markers/marker_sheet.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

/// The sheet that the pictures show: named, or the folder's own; none is no error.
absl::StatusOr<std::optional<TagGrid>> GridOf(const MarkersArguments& arguments) {
  if (arguments.grid == "none" || arguments.detector == kKollerFamily) return std::nullopt;
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

/// In words, what is no marker and why.
void SayDropped(const std::string& file, const std::vector<MarkerDrop>& dropped) {
  for (const MarkerDrop& drop : dropped) {
    std::cerr << absl::StrFormat("%s: %s%s at %.0f,%.0f is left out: %s\n", file, drop.family,
                                 drop.id < 0 ? std::string(" square") : absl::StrCat(" ", drop.id),
                                 drop.middle.x(), drop.middle.y(), drop.reason);
  }
}

/// Grey, or where the detector asks for it and the file has it, in colour.
cv::Mat ForDetector(const MarkerDetector& detector, const DecodedPicture& picture) {
  return detector.needs_color() ? picture.color : picture.grey;
}

/// Who turned a picture about shall be told why nothing is in it.
void SayIfMirrored(const std::string& file, MarkerDetector& detector, const cv::Mat& picture) {
  const std::size_t there = CountIfMirrored(detector, picture);
  if (there == 0) return;
  std::cerr << file << ": the picture is mirrored: " << there
            << " markers are read in its mirror image, none in it; turn mirroring off where it "
               "was taken\n";
}

/// Each picture by itself.
absl::Status DetectEach(const std::vector<std::filesystem::path>& files, MarkerDetector& detector,
                        OutputFile& out, Tally& tally) {
  for (std::size_t k = 0; k < files.size(); ++k) {
    const absl::StatusOr<DecodedPicture> picture = LoadPicture(files[k]);
    if (picture.ok()) {
      const std::string file = files[k].filename().string();
      const cv::Mat seen = ForDetector(detector, *picture);
      if (seen.empty()) {
        SayUnreadable(absl::InvalidArgumentError(absl::StrCat(
                          files[k].string(), " is grey; koller's squares are read in colour")),
                      tally);
        continue;
      }
      const std::vector<MarkerSighting> sightings = detector.Detect(seen);
      SayDropped(file, detector.dropped());
      if (sightings.empty()) SayIfMirrored(file, detector, seen);
      for (const MarkerSighting& sighting : sightings) out.Write(SightingRow(file, sighting));
      Count(sightings, tally);
    } else {
      SayUnreadable(picture.status(), tally);
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
  const absl::StatusOr<CalibratedLens> fit = pictures->Search(LensModel::kBrownConrady);
  if (!fit.ok()) {
    std::cerr << "the sheet was not searched for: " << fit.status().message() << "\n";
  }
  for (const GridPicture& picture : pictures->pictures()) {
    const std::vector<MarkerSighting>& sightings =
        picture.found ? picture.found->sightings : picture.read;
    for (const MarkerSighting& sighting : sightings)
      out.Write(SightingRow(set->names[picture.number], sighting));
    Count(sightings, tally);
  }
  return out.status();
}

}  // namespace

absl::Status MarkersCommand(const MarkersArguments& arguments) {
  const auto files = PicturesIn(arguments.images);
  if (!files.ok()) return files.status();
  MarkerOptions options{arguments.families, std::max(1, arguments.border_bits), {}};
  if (!arguments.ids.empty()) {
    absl::StatusOr<std::vector<int>> ids = ParseMarkerIds(arguments.ids);
    if (!ids.ok()) return ids.status();
    options.ids = *std::move(ids);
  }
  auto detector = MakeMarkerDetector(arguments.detector, options);
  if (!detector.ok()) return detector.status();
  if ((*detector)->needs_color() && !arguments.grid.empty() && arguments.grid != "none") {
    return absl::InvalidArgumentError("--grid: a sheet is of AprilTags; leave it out with koller");
  }
  const absl::StatusOr<std::optional<TagGrid>> grid = GridOf(arguments);
  if (!grid.ok()) return grid.status();
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  absl::StatusOr<OutputFile> out = OutputFile::Create(arguments.out / "detections.csv");
  if (!out.ok()) return out.status();
  out->Write(kSightingHeader);
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
