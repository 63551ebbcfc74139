// T18 in small: `saccade-eval sim --scenario reloc --runs 200` is the whole of it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace {

TEST(SaccadeEvalReloc, FindsBackAndTakesNoOtherPlaceForItT18) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("saccade-reloc-" + std::to_string(::getpid()));
  const std::string command = std::string(SACCADE_EVAL) +
                              " sim --scenario reloc --runs 8 --duration 10 --out " +
                              folder.string() + " >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream file(folder / "report.json");
  const nlohmann::json report = nlohmann::json::parse(file);
  std::printf("T18: %d of %d poses found, median %.0f ms; %d of %d foreign pictures accepted\n",
              report["found"].get<int>(), report["poses"].get<int>(),
              report["wait_ms"]["median"].get<double>(), report["foreign_accepted"].get<int>(),
              report["foreign_pictures"].get<int>());
  EXPECT_EQ(report["poses"], 8);
  EXPECT_EQ(report["foreign_pictures"], 40);
  EXPECT_GE(report["found"].get<int>(), 4);
  EXPECT_EQ(report["within_3_cm_and_1_deg"], report["found"]);
  EXPECT_EQ(report["wrong_place"], 0);
  EXPECT_EQ(report["foreign_accepted"], 0);
  EXPECT_LT(report["wait_ms"]["median"].get<double>(), 200.0);
  std::filesystem::remove_all(folder);
}

}  // namespace
