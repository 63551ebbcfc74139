#include "server/markers/marker_detector.hpp"

#include <absl/strings/str_cat.h>

#include "server/markers/apriltag_detector.hpp"
#include "server/markers/aruco_detector.hpp"
#include "server/markers/koller_code.hpp"
#include "server/markers/koller_detector.hpp"

namespace saccade {
namespace {

constexpr int kMostArucoBorder = 4;

absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeApriltag(
    const std::vector<std::string>& families, int border_bits) {
  std::vector<TagFamily> made;
  for (const std::string& name : families) {
    absl::StatusOr<TagFamily> family = TagFamily::Make(name, border_bits);
    if (!family.ok()) return family.status();
    made.push_back(*std::move(family));
  }
  return std::make_unique<ApriltagDetector>(std::move(made));
}

absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeAruco(const std::vector<std::string>& families,
                                                          int border_bits) {
  if (border_bits < 1 || border_bits > kMostArucoBorder) {
    return absl::InvalidArgumentError(
        absl::StrCat("border-bits: ", border_bits, " is not between 1 and ", kMostArucoBorder));
  }
  std::vector<ArucoFamily> made;
  for (const std::string& name : families) {
    absl::StatusOr<ArucoFamily> family = MakeArucoFamily(name);
    if (!family.ok()) return family.status();
    made.push_back(*std::move(family));
  }
  return std::make_unique<ArucoDetector>(std::move(made), border_bits);
}

absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeKoller(const std::vector<std::string>& families,
                                                           const MarkerOptions& options) {
  for (const int id : options.ids) {
    if (id >= 0 && id < kKollerIds) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("ids: koller has 0 to ", kKollerIds - 1, ", not ", id));
  }
  for (const std::string& name : families) {
    if (name == kKollerFamily) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("family: koller finds no '", name, "'; there is ", kKollerFamily));
  }
  if (options.border_bits != 1) {
    return absl::InvalidArgumentError("border-bits: koller's squares have one frame; leave it out");
  }
  return std::make_unique<KollerDetector>(options.ids);
}

}  // namespace

std::vector<std::string> KnownFamilies(absl::string_view detector) {
  if (detector == "apriltag") return {"apriltag36h11", "apriltag25h9"};
  if (detector == "koller") return {kKollerFamily};
  // Two dictionaries of one size and maker share their first codes: the smaller is the safer guess.
  return {"apriltag36h11", "apriltag25h9",  "aruco_7x7_250",
          "aruco_6x6_250", "aruco_5x5_250", "aruco_original"};
}

std::size_t CountIfMirrored(MarkerDetector& detector, const cv::Mat& picture) {
  if (picture.empty() || detector.needs_color()) return 0;
  cv::Mat mirrored;
  cv::flip(picture, mirrored, 1);
  return detector.Detect(mirrored).size();
}

absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeMarkerDetector(absl::string_view name,
                                                                   const MarkerOptions& options) {
  const std::vector<std::string> families =
      options.families.empty() ? KnownFamilies(name) : options.families;
  if (name == "apriltag") return MakeApriltag(families, options.border_bits);
  if (name == "aruco") return MakeAruco(families, options.border_bits);
  if (name == "koller") return MakeKoller(families, options);
  return absl::InvalidArgumentError(
      absl::StrCat("detector: there is no '", name, "'; there are apriltag, aruco, koller"));
}

}  // namespace saccade
