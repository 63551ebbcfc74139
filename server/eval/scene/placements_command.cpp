#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/commands.hpp"
#include "server/eval/scene/placements.hpp"

namespace saccade {

absl::Status PlacementsCommand(const PlacementsArguments& arguments) {
  const absl::StatusOr<PlacementsSummary> summary = RunPlacements(
      arguments.seed, arguments.count, arguments.out,
      [&](int placed) { std::cerr << "placed " << placed << " of " << arguments.count << "\n"; });
  if (!summary.ok()) return summary.status();
  std::cout << absl::StrFormat(
      "placed %d (%d pushed first, %d of concave things); refused %d, wrongly %d\n"
      "worst penetration %.4f mm, worst gap %.4f mm; failed %d\n",
      summary->placed, summary->pushed, summary->concave, summary->refused,
      summary->wrongly_refused, 1e3 * summary->worst_penetration_m, 1e3 * summary->worst_gap_m,
      summary->failed);
  return absl::OkStatus();
}

}  // namespace saccade
