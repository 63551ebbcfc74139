#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "server/team/wand_adjustment.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// A body that carries square tags, and cameras that stand still and see it.
struct WandBody {
  std::map<int, Rigid3> wand_from_tag;
  double side_m = 0.0;
};
struct TagSight {
  int camera = 0, instant = 0, tag = 0;
  std::array<Eigen::Vector2d, 4> corners;  // [px], in the order of their detector
};

/// Which of a tag's corners (-,-) (+,-) (+,+) (-,+) comes at each place of a detector's list.
using CornerOrder = std::array<int, 4>;

/// The one of eight orders in which views of several tags at once fit. FailedPrecondition: no view
/// has two tags, none fits to 3 px, or two fit alike.
absl::StatusOr<CornerOrder> FindCornerOrder(const std::vector<CameraModel>& lenses,
                                            const WandBody& body,
                                            const std::vector<TagSight>& sights);

/// The sights of each camera and instant together.
std::vector<WandView> ViewsOf(const WandBody& body, const std::vector<TagSight>& sights,
                              const CornerOrder& order);

/// Both poses camera_from_wand of each tag in a view, refined by all that the view has, with their
/// errors [px]; best first, without doubles. `sights` are the view's.
std::vector<std::pair<double, Rigid3>> AnswersOf(const CameraModel& lens, const WandBody& body,
                                                 const WandView& view,
                                                 const std::vector<const TagSight*>& sights,
                                                 const CornerOrder& order);

}  // namespace saccade
