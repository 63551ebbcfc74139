// What marks claim, in small: `saccade-eval sim --scenario desk|walk|tour` is the whole of it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace {

/// `claims` of report.json.
nlohmann::json Claims(const std::string& arguments) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("saccade-claims-" + std::to_string(::getpid()));
  const std::string command = std::string(SACCADE_EVAL) + " sim " + arguments + " --runs 1 --out " +
                              folder.string() + " >/dev/null 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream file(folder / "report.json");
  const nlohmann::json report = nlohmann::json::parse(file);
  std::filesystem::remove_all(folder);
  return report["claims"];
}

void ExpectTrue(const nlohmann::json& claims, const char* what) {
  const nlohmann::json& length = claims["tracking"]["length"];
  const double beyond = length["beyond_3_sigma"].get<double>();
  const double median = length["median_error_over_claim"].get<double>();
  std::printf("%s: %d sightings, %.1f %% beyond 3 sigma, median of error over claim %.2f\n", what,
              length["sightings"].get<int>(), 1e2 * beyond, median);
  EXPECT_GT(length["sightings"].get<int>(), 50) << "who trusts nothing claims nothing wrong";
  EXPECT_LE(beyond, 0.02);
  EXPECT_LT(median, 1.2);
}

TEST(SaccadeEvalClaims, AMarkOnAnOutlineOfTheDeskSaysSo) {
  ExpectTrue(Claims("--scenario desk --seed 1 --duration 45"), "desk, seed 1");
}

}  // namespace
