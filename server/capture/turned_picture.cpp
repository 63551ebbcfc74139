#include "server/capture/turned_picture.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>

namespace saccade {
namespace {

cv::Mat TurnedPlane(const cv::Mat& plane, const Turn& turn) {
  if (plane.empty()) return plane;
  cv::Mat turned;
  if (turn.clockwise_deg == 0) {
    turned = plane;
  } else {
    const int code = turn.clockwise_deg == 90    ? cv::ROTATE_90_CLOCKWISE
                     : turn.clockwise_deg == 180 ? cv::ROTATE_180
                                                 : cv::ROTATE_90_COUNTERCLOCKWISE;
    cv::rotate(plane, turned, code);
  }
  if (!turn.mirror) return turned;
  cv::Mat mirrored;
  cv::flip(turned, mirrored, 1);
  return mirrored;
}

}  // namespace

Turn ReadTurn(UriQuery& query) {
  Turn turn;
  turn.mirror = query.Flag("mirror").value_or(false);
  const std::optional<std::string> text = query.Text("rotate");
  if (!text) return turn;
  if (*text != "0" && *text != "90" && *text != "180" && *text != "270") {
    query.Fail("rotate", absl::StrCat("'", *text, "': give 0, 90, 180 or 270 (clockwise)"));
  } else {
    (void)absl::SimpleAtoi(*text, &turn.clockwise_deg);
  }
  return turn;
}

DecodedPicture Turned(DecodedPicture picture, const Turn& turn) {
  if (turn.clockwise_deg == 0 && !turn.mirror) return picture;
  return {TurnedPlane(picture.grey, turn), TurnedPlane(picture.color, turn)};
}

}  // namespace saccade
