#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <chrono>
#include <fstream>
#include <iostream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "server/eval/commands.hpp"
#include "server/eval/markers/render_score.hpp"
#include "server/eval/markers/sighting_csv.hpp"
#include "server/eval/output_file.hpp"
#include "server/markers/marker_detector.hpp"

namespace saccade {
namespace {

constexpr char kTruthHeader[] =
    "file,family,id,x0,y0,x1,y1,x2,y2,x3,y3,kind,side_px,tilt_deg,tx_m,ty_m,tz_m,qx,qy,qz,qw\n";

std::string FamilyOf(const MarkersArguments& arguments) {
  if (!arguments.families.empty()) return arguments.families.front();
  return arguments.detector == "aruco"      ? "aruco_4x4_50"
         : arguments.detector == "apriltag" ? "apriltag36h11"
                                            : kKollerFamily;
}

int IdsIn(const std::string& family) {
  int ids = 0;
  while (PatternOf(family, ids).ok()) ++ids;
  return ids;
}

std::string TruthRow(const std::string& file, const std::string& family, int id,
                     const SquareRender& truth) {
  std::string row =
      absl::StrCat(file, ",", family, ",", id, CornerColumns(truth.corners), ",", Word(truth.kind));
  const Eigen::Vector3d& t = truth.camera_from_marker.translation;
  const Eigen::Quaterniond& q = truth.camera_from_marker.rotation;
  absl::StrAppendFormat(&row, ",%.3f,%.3f,%.6f,%.6f,%.6f,%.8f,%.8f,%.8f,%.8f\n", truth.side_px,
                        truth.tilt_rad * 180 / std::numbers::pi, t.x(), t.y(), t.z(), q.x(), q.y(),
                        q.z(), q.w());
  return row;
}

absl::Status Keep(const std::filesystem::path& file, const cv::Mat& picture) {
  if (cv::imwrite(file.string(), picture)) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("--out: cannot write ", file.string(),
                                             "; free some space or name another folder"));
}

cv::Mat ForDetector(const MarkerDetector& detector, const SquareRender& render) {
  if (detector.needs_color()) return render.color;
  cv::Mat grey(render.color.size(), CV_8UC1);  // as LoadPicture does
  for (int row = 0; row < grey.rows; ++row) {
    for (int column = 0; column < grey.cols; ++column) {
      const auto& p = render.color.at<cv::Vec3b>(row, column);
      grey.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(0.114 * p[0] + 0.587 * p[1] + 0.299 * p[2] + 0.5);
    }
  }
  return grey;
}

}  // namespace

absl::Status MarkersRenderCommand(const MarkersArguments& arguments) {
  const std::string family = FamilyOf(arguments);
  auto detector = MakeMarkerDetector(arguments.detector, {{family}, 1});
  if (!detector.ok()) return detector.status();
  const absl::StatusOr<MarkerPattern> any = PatternOf(family, 0);
  if (!any.ok()) return any.status();
  const int ids = IdsIn(family);
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  absl::StatusOr<OutputFile> truth = OutputFile::Create(arguments.out / "truth.csv");
  if (!truth.ok()) return truth.status();
  absl::StatusOr<OutputFile> out = OutputFile::Create(arguments.out / "detections.csv");
  if (!out.ok()) return out.status();
  truth->Write(kTruthHeader);
  out->Write(kSightingHeader);
  RenderScore score;
  for (int k = 0; k < arguments.renders; ++k) {
    const int id = static_cast<int>((arguments.seed * 7919 + 104'729 * std::uint64_t(k)) % ids);
    const SquareRender render = RenderSquare(*PatternOf(family, id), arguments.seed, k);
    const std::string file = absl::StrFormat("%06d.png", k);
    const cv::Mat picture = ForDetector(**detector, render);
    const auto start = std::chrono::steady_clock::now();
    const std::vector<MarkerSighting> sightings = (*detector)->Detect(picture);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    score.Add(render, family, id, sightings, took.count());
    truth->Write(TruthRow(file, family, id, render));
    for (const MarkerSighting& sighting : sightings) out->Write(SightingRow(file, sighting));
    if (k < arguments.keep) {
      if (absl::Status kept = Keep(arguments.out / file, render.color); !kept.ok()) return kept;
    }
    if ((k + 1) % 500 == 0) {
      std::cerr << "renders: " << k + 1 << " of " << arguments.renders << "\n";
    }
  }
  if (absl::Status closed = truth->Close(); !closed.ok()) return closed;
  if (absl::Status closed = out->Close(); !closed.ok()) return closed;
  nlohmann::ordered_json report = {
      {"detector", arguments.detector}, {"family", family}, {"seed", arguments.seed}};
  report.update(score.Report());
  const std::filesystem::path file = arguments.out / "report.json";
  if (absl::Status written = WriteFileAtomically(file, report.dump(2) + "\n"); !written.ok()) {
    return written;
  }
  std::cout << absl::StrFormat(
      "%d renders of %s: %.2f %% of those wholly visible found, %.2f %% of those with part of "
      "their border covered, %d wrong; corners' error^2 over variance %.2f; %s\n",
      arguments.renders, family, 100 * score.VisibleFound(), 100 * score.BorderCoveredFound(),
      score.wrong(), score.Nees(), file.string());
  return absl::OkStatus();
}

}  // namespace saccade
