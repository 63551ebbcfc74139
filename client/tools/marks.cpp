#include "client/tools/marks.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <utility>

namespace saccade::tools {
namespace {

// As the server has them by default.
constexpr double kLimitM = 0.05, kLimitOfDistance = 0.02, kLimitPx = 10;
constexpr double kInkStepPx = 2;
constexpr std::size_t kMaxInk = 2000;

}  // namespace

Scale ScaleOf(const session::State& state) {
  if (!state.pose) return {};
  return {state.pose->metric, state.pose->world_from_camera.translation};
}

Excess ExcessOf(const Anchor& anchor, const Scale& scale) {
  const double away_m = scale.eye_in_world && anchor.place_known
                            ? (*scale.eye_in_world - anchor.point_in_world).norm()
                            : 0.0;
  const double limit_m = std::max(kLimitM, kLimitOfDistance * away_m);
  return {scale.metric && anchor.error_m > limit_m, anchor.error_px.value_or(0) > kLimitPx};
}

bool DoNotTrust(const Anchor& anchor, const Scale& scale) {
  switch (anchor.state) {
    case AnchorState::kPaused:
    case AnchorState::kStopped:
      return true;
    case AnchorState::kProvisional: {
      const Excess excess = ExcessOf(anchor, scale);
      return excess.mm || excess.px;
    }
    case AnchorState::kTracking:
      break;
  }
  return false;
}

bool Passes(const Annotation& annotation, const MarkFilter& filter, const std::string& me) {
  if (filter.mine && annotation.author != me) return false;
  const std::string said = absl::AsciiStrToLower(
      absl::StrCat(annotation.text, " ", annotation.author, " ", ShapeWord(annotation.shape)));
  for (const absl::string_view word :
       absl::StrSplit(absl::AsciiStrToLower(filter.text), ' ', absl::SkipEmpty())) {
    if (said.find(std::string(word)) == std::string::npos) return false;
  }
  return true;
}

const char* ShapeWord(AnnotationShape shape) {
  return shape == AnnotationShape::kInk ? "stroke" : ToString(shape);
}

std::string TitleOf(const Annotation& annotation) {
  const char* shape = ShapeWord(annotation.shape);
  if (annotation.text.empty()) return absl::StrCat("the ", shape);
  return absl::StrCat(shape, " “", annotation.text.substr(0, annotation.text.find('\n')), "”");
}

void InkLine::Begin(FrameId frame_id, const Eigen::Vector2d& pixel) {
  frame_id_ = frame_id;
  points_ = {pixel};
}

void InkLine::Add(const Eigen::Vector2d& pixel) {
  if (points_.empty() || points_.size() >= kMaxInk) return;
  if ((pixel - points_.back()).norm() >= kInkStepPx) points_.push_back(pixel);
}

std::vector<Eigen::Vector2d> InkLine::Finish() {
  const std::vector<Eigen::Vector2d> raw = std::exchange(points_, {});
  if (raw.size() < 2) return {};
  std::vector<Eigen::Vector2d> smooth = raw;
  for (std::size_t i = 1; i + 1 < raw.size(); ++i) {
    smooth[i] = 0.25 * raw[i - 1] + 0.5 * raw[i] + 0.25 * raw[i + 1];
  }
  return smooth;
}

}  // namespace saccade::tools
