#include "server/tracker/picture_front_end.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/tracker/same_picture.hpp"

namespace saccade {
namespace {

constexpr double kWidest_px = 30.0;         // sigma of the widest ellipse that is searched
constexpr double kWidestClicked_px = 40.0;  // the same for what was clicked

SearchOptions MakeSearchOptions(const TrackerOptions& options) {
  SearchOptions search;
  search.max_nssd = options.max_nssd;
  search.gate_squared = options.gate_sigma * options.gate_sigma;
  search.max_sigma_px = kWidest_px;
  // Lucas-Kanade runs astray on blurred patches: fr1/xyz 0.8 cm with parabolas, up to 17 with it.
  search.sub_pixel = options.sub_pixel == 0   ? SubPixel::kNone
                     : options.sub_pixel == 1 ? SubPixel::kParabola
                                              : SubPixel::kLucasKanade;
  return search;
}

CornerOptions MakeCornerOptions(const TrackerOptions& options) {
  CornerOptions corner;
  corner.min_score = options.corner_min_score;
  corner.border_px = 16;
  return corner;
}

/// Of the ellipse that PatchSearcher looks at [px^2].
double SearchedArea(const SearchOptions& options, const Eigen::Matrix2d& covariance) {
  const Eigen::Array2d half_axes =
      (options.gate_squared *
       Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvalues().array().max(0.0))
          .sqrt()
          .max(options.min_half_axis_px);
  return std::numbers::pi * half_axes.prod();
}

/// Whether the picture has no texture around a pixel: a covered lens, a hand before it, a blank
/// wall.
bool IsBlank(const cv::Mat& grey, const Eigen::Vector2d& pixel) {
  constexpr int kRadius_px = 12;
  constexpr double kTexture = 6.0;  // grey levels; a patch has at least 10
  const cv::Rect window(static_cast<int>(pixel.x()) - kRadius_px,
                        static_cast<int>(pixel.y()) - kRadius_px, 2 * kRadius_px + 1,
                        2 * kRadius_px + 1);
  const cv::Rect inside = window & cv::Rect({0, 0}, grey.size());
  if (inside.empty()) return true;
  cv::Scalar mean, deviation;
  cv::meanStdDev(grey(inside), mean, deviation);
  return deviation[0] < kTexture;
}

}  // namespace

PictureFrontEnd::PictureFrontEnd(std::shared_ptr<const CameraModel> camera,
                                 const TrackerOptions& options)
    : camera_(std::move(camera)),
      draw_as_seen_(options.warp),
      searcher_(MakeSearchOptions(options)),
      detector_(MakeCornerOptions(options)) {
  warp_.size = options.patch_px;
}

absl::Status PictureFrontEnd::Check(const SourceInfo& source) const {
  if (!source.target) return absl::OkStatus();
  const auto* patches = std::get_if<PatchTarget>(&*source.target);
  if (patches == nullptr || !source.start) return absl::OkStatus();
  return PatchTemplates(*patches, source.start->world_from_camera, source.camera).status();
}

bool PictureFrontEnd::Repeats(const Frame& frame) const {
  return SamePicture(frame.grey, frame_.grey);
}

bool PictureFrontEnd::Take(const Frame& frame) {
  if (frame.camera == nullptr || frame.grey.cols != camera_->width() ||
      frame.grey.rows != camera_->height() || !pyramid_.Build(frame.grey).ok()) {
    return false;
  }
  frame_ = frame;
  return true;
}

LandmarkSighting PictureFrontEnd::Find(const LandmarkQuery& query) {
  LandmarkSighting sighting;
  const PointFromClone& birth = query.birth;
  const PatchTemplate& look = query.landmark->patch;
  const WarpStatus warped =
      draw_as_seen_
          ? WarpPatch(look, query.world_from_camera.Inverse() * birth.world_from_clone,
                      birth.bearing, std::max(0.0, birth.inverse_range), Eigen::Vector3d::Zero(),
                      *frame_.camera, query.centre, warp_, warped_)
          : CopyPatch(look, warp_, warped_);
  if (warped != WarpStatus::kOk) return sighting;
  // After blind frames the ellipse outgrows what can be searched: look in its middle then.
  const double shrink =
      std::min(1.0, kWidest_px * kWidest_px / std::max(1e-9, query.spread.trace()));
  const Eigen::Matrix2d spread = shrink * query.spread;
  const SearchResult result = searcher_.Find(pyramid_, warped_, query.centre, spread);
  if (result.status == SearchStatus::kTooUncertain || result.status == SearchStatus::kOutside ||
      result.status == SearchStatus::kBadInput) {
    return sighting;
  }
  sighting.searched_px2 = SearchedArea(searcher_.options(), spread);
  if (result.found()) {
    sighting.kind = LandmarkSighting::Kind::kFound;
    sighting.pixel = result.pixel;
    sighting.covariance = result.covariance;
  } else {
    // Where there is nothing at all, something hides the feature (slam-spec 5.6).
    sighting.kind = IsBlank(pyramid_.level(0), query.centre) ? LandmarkSighting::Kind::kHidden
                                                             : LandmarkSighting::Kind::kMissed;
  }
  return sighting;
}

std::vector<Eigen::Vector2d> PictureFrontEnd::Corners(std::span<const Eigen::Vector2d> occupied,
                                                      int most) {
  detector_.DetectAll(pyramid_, occupied, most, corners_);
  std::vector<Eigen::Vector2d> pixels;
  pixels.reserve(corners_.size());
  for (const Corner& corner : corners_) pixels.push_back(corner.pixel);
  return pixels;
}

std::optional<PatchTemplate> PictureFrontEnd::Cut(const Eigen::Vector2d& pixel) {
  auto patch = CutPatch(frame_.grey, pixel, frame_.camera);
  if (!patch.ok() || CopyPatch(*patch, WarpOptions(), warped_) != WarpStatus::kOk) {
    return std::nullopt;
  }
  return *std::move(patch);
}

absl::StatusOr<TargetObservation> PictureFrontEnd::FindChessboard(
    const ChessboardTarget& target, const std::optional<Rigid3>& predicted) {
  return DetectChessboard(pyramid_, *frame_.camera, target, predicted);
}

absl::StatusOr<PatchesSeen> PictureFrontEnd::FindPatches(const PatchTarget& target,
                                                         const StartPose& start) {
  auto observation = DetectPatches(pyramid_, frame_.camera, target, start);
  if (!observation.ok()) return observation.status();
  auto looks = PatchTemplates(target, start.world_from_camera, frame_.camera);
  if (!looks.ok()) return looks.status();
  return PatchesSeen{*std::move(observation), *std::move(looks)};
}

absl::StatusOr<PatchTemplate> PictureFrontEnd::CutClicked(const Frame& clicked,
                                                          const Eigen::Vector2d& pixel) {
  constexpr int kRadius_px = 4;  // inside the patch that is tracked
  ImagePyramid pyramid;
  if (const absl::Status built = pyramid.Build(clicked.grey); !built.ok()) return built;
  const cv::Rect around(static_cast<int>(std::lround(pixel.x())) - kRadius_px,
                        static_cast<int>(std::lround(pixel.y())) - kRadius_px, 2 * kRadius_px + 1,
                        2 * kRadius_px + 1);
  detector_.Detect(pyramid, around, {}, 1, corners_);
  // An edge or a plain surface would slide and end at a depth of its own making.
  if (corners_.empty()) return absl::NotFoundError("feature: no corner to track at this pixel");
  return CutPatch(clicked.grey, pixel, clicked.camera);
}

absl::StatusOr<Eigen::Vector2d> PictureFrontEnd::FindClicked(const PatchTemplate& look,
                                                             const LandmarkQuery& query) {
  if (WarpPatch(look, query.world_from_camera.Inverse() * query.birth.world_from_clone,
                query.birth.bearing, query.birth.inverse_range, Eigen::Vector3d::Zero(),
                *frame_.camera, query.centre, WarpOptions(), warped_) != WarpStatus::kOk) {
    return absl::NotFoundError("feature: nothing to recognise at this pixel");
  }
  SearchOptions search;
  search.max_sigma_px = kWidestClicked_px;
  const SearchResult seen =
      PatchSearcher(search).Find(pyramid_, warped_, query.centre, query.spread);
  if (!seen.found()) return absl::NotFoundError("feature: not seen in the newest frame");
  return seen.pixel;
}

}  // namespace saccade
