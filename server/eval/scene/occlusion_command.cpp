#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/commands.hpp"
#include "server/eval/scene/occlusion.hpp"

namespace saccade {

absl::Status OcclusionCommand(const PlacementsArguments& arguments) {
  const absl::StatusOr<OcclusionSummary> summary =
      RunOcclusion(arguments.seed, arguments.count, arguments.out);
  if (!summary.ok()) return summary.status();
  std::cout << absl::StrFormat(
      "%d pictures, %d of them partly hidden\n"
      "IoU over all: seen %.5f (%d px), hidden %.5f (%d px); worst picture: seen %.5f, hidden "
      "%.5f\n",
      summary->pictures, summary->partly_hidden, summary->seen.Iou(), summary->seen.either,
      summary->hidden.Iou(), summary->hidden.either, summary->worst_seen_iou,
      summary->worst_hidden_iou);
  return absl::OkStatus();
}

}  // namespace saccade
