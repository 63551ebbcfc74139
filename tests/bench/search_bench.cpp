#include <absl/strings/str_cat.h>

#include <functional>

#include "server/features/search.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/textured_scene.hpp"

namespace saccade {
namespace {

/// Least time of each item over the repeats, of `work(item)`.
Sample Time(std::size_t items, int repeats, const std::function<void(std::size_t)>& work) {
  LeastTimes least;
  for (int k = 0; k < repeats; ++k) {
    for (std::size_t item = 0; item < items; ++item) {
      StopWatch watch;
      work(item);
      least.Add(item, watch.Lap_ms());
    }
  }
  return least.ToSample();
}

struct SearchCase {
  const char* name;
  double sigma_px;  // of the prediction; the ellipse is six times as wide
  SubPixel sub_pixel;
};
constexpr SearchCase kCases[] = {
    {"narrow, parabola", 1.0, SubPixel::kParabola},
    {"narrow, Lucas-Kanade", 1.0, SubPixel::kLucasKanade},
    {"wide, parabola", 9.0, SubPixel::kParabola},
    {"wide, Lucas-Kanade", 9.0, SubPixel::kLucasKanade},
};

absl::Status AddSearches(const SearchBenchArguments& arguments, TimingReport& report) {
  const TexturedScene& scene = TheScene();
  std::vector<WarpedPatch> warped(scene.patches.size());
  for (std::size_t k = 0; k < warped.size(); ++k) {
    if (CopyPatch(scene.patches[k], {}, warped[k]) != WarpStatus::kOk) {
      return absl::InternalError("bench search: a patch cannot be cut");
    }
  }
  for (const SearchCase& each : kCases) {
    SearchOptions options;
    options.sub_pixel = each.sub_pixel;
    PatchSearcher searcher(options);
    const Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * each.sigma_px * each.sigma_px;
    int found = 0;
    const Sample times = Time(warped.size(), arguments.repeats, [&](std::size_t k) {
      const Eigen::Vector2d predicted = scene.corners[k].pixel + Eigen::Vector2d(1.6, -1.2);
      found += searcher.Find(scene.pyramid, warped[k], predicted, covariance).found() ? 1 : 0;
    });
    if (found * 2 < arguments.repeats * static_cast<int>(warped.size())) {
      return absl::InternalError("bench search: most patches were not found");
    }
    report.rows.push_back({absl::StrCat("one patch, ellipse ", 6 * each.sigma_px, " px"), each.name,
                           times, std::nullopt});
  }
  return absl::OkStatus();
}

void AddWarps(const SearchBenchArguments& arguments, TimingReport& report) {
  const TexturedScene& scene = TheScene();
  const Rigid3 current_from_birth{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d(0, 0, 1))), {0.02, 0.0, 0.01}};
  WarpedPatch warped;
  const Sample times = Time(scene.patches.size(), arguments.repeats, [&](std::size_t k) {
    const PatchTemplate& patch = scene.patches[k];
    const auto pixel = scene.camera->Project(current_from_birth * (patch.birth_bearing / 0.7));
    if (!pixel) return;
    const WarpStatus status =
        WarpPatch(patch, current_from_birth, patch.birth_bearing, 0.7, Eigen::Vector3d::Zero(),
                  *scene.camera, *pixel, {.coarse = true}, warped);
    static_cast<void>(status);  // some leave the picture
  });
  report.rows.push_back({"one patch", "warp", times, std::nullopt});
}

void AddCorners(const SearchBenchArguments& arguments, TimingReport& report) {
  const TexturedScene& scene = TheScene();
  ImagePyramid pyramid;
  std::vector<Corner> corners;
  const int repeats = std::max(1, arguments.repeats / 10);
  const auto add = [&](const char* stage, const std::function<void(std::size_t)>& work) {
    report.rows.push_back({"a picture", stage, Time(50, repeats, work), std::nullopt});
  };
  add("pyramid", [&](std::size_t) { static_cast<void>(pyramid.Build(scene.image)); });
  CornerDetector full({.level = 0}), half({.level = 1}), band({.level = 1});
  add("corners, all, level 0",
      [&](std::size_t) { full.DetectAll(scene.pyramid, {}, 100, corners); });
  add("corners, all, level 1",
      [&](std::size_t) { half.DetectAll(scene.pyramid, {}, 100, corners); });
  add("corners, one band, level 1",
      [&](std::size_t) { band.DetectNextBand(scene.pyramid, {}, 10, corners); });
}

}  // namespace

absl::StatusOr<TimingReport> BenchSearch(const SearchBenchArguments& arguments) {
  TimingReport report;
  report.bench = "search";
  report.facts = {{"picture", "640 x 480, noise of two grain sizes; 100 patches of 11 x 11"},
                  {"times", absl::StrCat("of one patch or picture: least of ", arguments.repeats,
                                         " repeats (pictures: a tenth)")}};
  if (const absl::Status status = AddSearches(arguments, report); !status.ok()) return status;
  AddWarps(arguments, report);
  AddCorners(arguments, report);
  return report;
}

}  // namespace saccade
