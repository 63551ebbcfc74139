#include "server/eval/scene/figures.hpp"

#include <absl/strings/str_cat.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/eval/output_file.hpp"
#include "server/eval/scene/figure_room.hpp"
#include "server/eval/scene/figure_things.hpp"
#include "server/markers/corner_look.hpp"
#include "server/markers/marker_detector.hpp"
#include "server/scene/light_fit.hpp"
#include "server/scene/scene_view.hpp"
#include "server/sim/lens.hpp"
#include "server/sim/scene_renderer.hpp"
#include "server/tracker/square_pose.hpp"

namespace saccade {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 768, kHeight = 576;  // PAL, as theirs
constexpr double kDrawnPerPixel = 2.0;
constexpr double kNoise = 2.0;  // sigma [grey levels]
constexpr int kQuality = 82;    // of the JPEG

CameraModel Camera() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.fx = lens.fy = 620;
  lens.cx = 384;
  lens.cy = 287;
  lens.distortion = {-0.08, 0.02, 0, 0, 0};
  return CameraModel(lens);
}

/// Looks from one point to another, upright.
Rigid3 LookingAt(const Vector3d& from, const Vector3d& to) {
  Eigen::Matrix3d axes;
  axes.col(2) = (to - from).normalized();
  axes.col(0) = Vector3d::UnitY().cross(axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {Eigen::Quaterniond(axes), from};
}

/// The room, its renderer, and what draws virtual things into it.
class Studio {
 public:
  static absl::StatusOr<std::unique_ptr<Studio>> Create(bool cartons) {
    absl::StatusOr<FigureRoom> room = BuildFigureRoom(cartons);
    if (!room.ok()) return room.status();
    std::unique_ptr<Studio> studio(new Studio(*std::move(room)));
    auto renderer =
        SceneRenderer::Create(studio->room_.scene, studio->lens_.view(), GlBackend::kOsmesa);
    if (!renderer.ok()) return renderer.status();
    studio->renderer_ = *std::move(renderer);
    auto view = SceneView::Create(studio->camera_, GlBackend::kOsmesa,
                                  EnoughSupersampling(studio->camera_));
    if (!view.ok()) return view.status();
    studio->view_ = *std::move(view);
    MarkerOptions options;
    options.families = {kKollerFamily};
    for (const KnownSquare& square : studio->room_.squares.squares) {
      options.ids.push_back(square.id);
    }
    auto detector = MakeMarkerDetector(kKollerFamily, options);
    if (!detector.ok()) return detector.status();
    studio->detector_ = *std::move(detector);
    return studio;
  }

  const FigureRoom& room() const { return room_; }

  absl::StatusOr<FigureResult> Make(const std::string& file, const Rigid3& truth,
                                    std::vector<PlacedMesh> things,
                                    const std::filesystem::path& out) {
    cv::Mat drawn, picture;
    if (absl::Status done = renderer_->Draw(truth, drawn); !done.ok()) return done;
    lens_.Apply(drawn, picture);
    cv::Mat noise(picture.size(), CV_16SC3), noisy;
    cv::RNG(7).fill(noise, cv::RNG::NORMAL, 0.0, kNoise);
    cv::add(picture, noise, noisy, cv::noArray(), CV_8U);
    const std::vector<MarkerSighting> seen = detector_->Detect(noisy);
    const auto pose = PoseOfSquares(camera_, seen, room_.squares);
    if (!pose) {
      return absl::NotFoundError(
          absl::StrCat(file, ": ", seen.size(), " squares were read, no pose came of them"));
    }
    const Rigid3& found = pose->fit.world_from_camera;
    const SceneLight light = LightOf(noisy, seen);
    PlacedMesh real;
    real.mesh = std::make_shared<const TriangleMesh>(room_.real);
    things.push_back(real);
    if (absl::Status set = view_->SetMeshes(std::move(things)); !set.ok()) return set;
    view_->SetLight(light);
    const absl::StatusOr<cv::Mat> overlay = view_->Draw(found);
    if (!overlay.ok()) return overlay.status();
    Blend(*overlay, noisy);
    const std::filesystem::path path = out / file;
    if (!cv::imwrite(path.string(), noisy, {cv::IMWRITE_JPEG_QUALITY, kQuality})) {
      return absl::UnavailableError(absl::StrCat(path.string(), ": cannot be written"));
    }
    return FigureResult{file, static_cast<int>(seen.size()),
                        1e3 * (found.translation - truth.translation).norm(),
                        RotationAngle(found, truth) * 180.0 / M_PI, light.confidence};
  }

 private:
  explicit Studio(FigureRoom room)
      : room_(std::move(room)), camera_(Camera()), lens_(camera_, kDrawnPerPixel) {}

  SceneLight LightOf(const cv::Mat& picture, const std::vector<MarkerSighting>& seen) const {
    cv::Mat grey;
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    std::vector<PaperSeen> papers;
    for (const MarkerSighting& sighting : seen) {
      SquareGuess guess;
      guess.corners = sighting.corners;
      guess.covariances.fill(Eigen::Matrix2d::Identity());
      const CornerLook look =
          LookAtCorners(grey, guess, SquareSearch(), BorderShare(kKollerFamily));
      const KnownSquare* square = room_.squares.Find(sighting.family, sighting.id);
      if (look.paper > 0 && square != nullptr) {
        papers.push_back({square->world_from_square.rotation * Vector3d::UnitZ(), look.paper});
      }
    }
    LightFit fit;
    fit.Add(papers);
    return fit.light();
  }

  FigureRoom room_;
  CameraModel camera_;
  Lens lens_;
  std::unique_ptr<SceneRenderer> renderer_;
  std::unique_ptr<SceneView> view_;
  std::unique_ptr<MarkerDetector> detector_;
};

const Vector3d kEye(2.2, -1.6, -3.7), kAim(1.2, -0.95, -0.2);
const Vector3d kRight(2.2, -1.0, -0.2);  // to the door, squares at the left

}  // namespace

absl::StatusOr<std::vector<FigureResult>> RunFigures(const std::filesystem::path& out) {
  if (absl::Status made = CreateFolder(out); !made.ok()) return made;
  absl::StatusOr<std::unique_ptr<Studio>> plain = Studio::Create(/*cartons=*/false);
  if (!plain.ok()) return plain.status();
  absl::StatusOr<std::unique_ptr<Studio>> covered = Studio::Create(/*cartons=*/true);
  if (!covered.ok()) return covered.status();
  const auto pushed = PushedFurniture((*plain)->room().real);
  if (!pushed.ok()) return pushed.status();
  const auto behind = FurnitureBehindCartons((*covered)->room().real);
  if (!behind.ok()) return behind.status();
  struct Figure {
    const char* file;
    Studio* studio;
    Vector3d eye, aim;
    std::vector<PlacedMesh> things;
  };
  const std::vector<Figure> figures = {
      {"1-pushed-furniture.jpg", plain->get(), kEye, kAim, *pushed},
      {"2-partial-cover.jpg", covered->get(), kEye + Vector3d(-0.2, 0.05, 0), kAim, *behind},
      {"3-divider-grid.jpg", plain->get(), kEye + Vector3d(0.1, -0.1, 0), kAim, DividerAndGrid()},
      {"4-hidden-wires.jpg", plain->get(), kEye, kAim + Vector3d(0.2, -0.1, 0), HiddenWires()},
      {"5-escape-route.jpg", plain->get(), kEye, kRight + Vector3d(-0.1, 0.0, 0), EscapeRoute()},
      {"6-red-arrow.jpg", plain->get(), kEye + Vector3d(-0.1, 0.1, 0.8),
       kAim + Vector3d(0.3, -0.2, 0), RedArrow()},
      {"7-hose-in-cabinet.jpg", plain->get(), kEye + Vector3d(-0.1, 0, 1.0),
       kRight + Vector3d(-0.35, -0.1, 0), HoseInCabinet()},
      {"8-floor-grid.jpg", plain->get(), kEye + Vector3d(0.1, -0.2, 0),
       kAim + Vector3d(0.1, 0.05, 0), GridAndPerson()}};
  std::vector<FigureResult> results;
  for (const Figure& figure : figures) {
    const auto one =
        figure.studio->Make(figure.file, LookingAt(figure.eye, figure.aim), figure.things, out);
    if (!one.ok()) return one.status();
    results.push_back(*one);
  }
  return results;
}

}  // namespace saccade
