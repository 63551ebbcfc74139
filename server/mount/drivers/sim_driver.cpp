#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include "server/mount/drivers/drivers.hpp"
#include "server/mount/drivers/sim_mount.hpp"

namespace saccade {
namespace {

absl::Status CheckSim(const std::string& /*rest*/, const MountFacts& facts) {
  if (!absl::StartsWith(facts.source, "sim:")) {
    return absl::InvalidArgumentError("--mount: sim turns the camera of a sim: source only");
  }
  return NeedsTheClock(facts);
}

absl::StatusOr<OpenedMount> OpenSim(const std::string& rest, const MountOptions& model,
                                    const MountContext& context) {
  SimMountOptions options;
  options.wall_clock = true;
  options.seed = context.seed;
  options.mount = model;
  if (!rest.empty()) {
    absl::string_view value = rest;
    std::uint64_t seed = 0;
    if (!absl::ConsumePrefix(&value, "crooked=") || !absl::SimpleAtoi(value, &seed)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--mount: sim?", rest, " is not understood; write for example sim?crooked=1"));
    }
    options.truth = CrookedMount(seed);
  }
  const auto made = std::make_shared<SimMount>(options);
  return OpenedMount{made, made, std::nullopt};
}

}  // namespace

MountDriver SimDriver() {
  return {.scheme = "sim",
          .usage = "sim[?crooked=SEED]",
          .example = "sim",
          .table = "",
          .describe = nullptr,
          .check = CheckSim,
          .open = OpenSim};
}

}  // namespace saccade
