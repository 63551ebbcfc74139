#include <absl/strings/str_cat.h>
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string_view>

#include "shared/version/version.hpp"
#include "tests/bench/bench.hpp"

namespace saccade {
namespace {

/// One line on stderr; 1, the exit code of a failure.
int Fail(const absl::Status& status) {
  std::cerr << "saccade-bench: " << status.message() << "\n";
  return 1;
}

/// Google Benchmark has its own command line: everything that begins with --benchmark_.
bool AsksForParts(int argc, char** argv) {
  for (int k = 1; k < argc; ++k) {
    if (std::string_view(argv[k]).starts_with("--benchmark_")) return true;
  }
  return false;
}

int RunParts(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

void AddFilter(CLI::App& app, FilterBenchArguments& arguments, bool& json) {
  CLI::App* filter = app.add_subcommand("filter", "The filter alone, every feature measured");
  filter->add_option("--features", arguments.features, "Numbers of features")
      ->delimiter(',')
      ->check(CLI::Range(3, 400))
      ->capture_default_str();
  filter->add_option("--form", arguments.form, "How features are written in the state")
      ->check(CLI::IsMember({"sid", "esid", "both"}))
      ->capture_default_str();
  filter->add_option("--updates", arguments.updates, "Timed updates")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  filter->add_option("--repeats", arguments.repeats, "Identical runs; the least time counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  filter->add_flag("--json", json, "Print JSON, not a table");
}

void AddSearch(CLI::App& app, SearchBenchArguments& arguments, bool& json) {
  CLI::App* search = app.add_subcommand("search", "One patch search, one warp, corners");
  search->add_option("--repeats", arguments.repeats, "Repeats; the least time counts")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  search->add_flag("--json", json, "Print JSON, not a table");
}

void AddFrame(CLI::App& app, FrameBenchArguments& arguments, std::string& source, bool& json) {
  CLI::App* frame = app.add_subcommand("frame", "The whole tracker, picture by picture");
  CLI::Option* simulated =
      frame->add_option("--source", source, "sim:desk?duration=S[&key=value...]");
  frame->add_option("--dataset", arguments.dataset, "A recording instead: folder in TUM layout")
      ->excludes(simulated);
  frame->add_option("--runs", arguments.runs, "Runs; of each frame the least time counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  frame->add_option("--config", arguments.config, "TOML file with tracker options");
  frame->add_option("--set", arguments.set, "One tracker option as key=value; may be repeated")
      ->take_all();
  frame->add_option("--frames-csv", arguments.frames_csv, "File for every frame's times");
  frame->add_flag("--json", json, "Print JSON, not a table");
}

void AddMap(CLI::App& app, MapBenchArguments& arguments, bool& json) {
  CLI::App* map = app.add_subcommand(
      "map", "The whole tracker on the same pictures, with a young map and with an old one");
  map->add_option("--way", arguments.way_m, "Metres of corridor that the old map is made of")
      ->check(CLI::Range(12.0, 200.0))
      ->capture_default_str();
  map->add_option("--runs", arguments.runs, "Runs; of each frame the least time counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  map->add_option("--seed", arguments.seed, "Of the corridor")->capture_default_str();
  map->add_option("--config", arguments.config, "TOML file with tracker options");
  map->add_option("--set", arguments.set, "One tracker option as key=value; may be repeated")
      ->take_all();
  map->add_flag("--json", json, "Print JSON, not a table");
}

int Main(int argc, char** argv) {
  if (AsksForParts(argc, argv)) return RunParts(argc, argv);
  CLI::App app("Saccade's benchmarks; small parts by --benchmark_filter=REGEX", "saccade-bench");
  app.set_version_flag("--version", std::string("saccade-bench ") + Version());
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return absl::StrCat(failed->get_name(), ": ", error.what(), "; see --help\n");
  });
  FilterBenchArguments filter;
  SearchBenchArguments search;
  FrameBenchArguments frame;
  MapBenchArguments map;
  std::string source = "sim:" + frame.source;
  bool json = false;
  AddFilter(app, filter, json);
  AddSearch(app, search, json);
  AddFrame(app, frame, source, json);
  AddMap(app, map, json);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (!source.starts_with("sim:")) {
    return Fail(absl::InvalidArgumentError(
        absl::StrCat("--source ", source, ": give sim:desk?..., or a recording by --dataset")));
  }
  frame.source = source.substr(4);
  absl::StatusOr<TimingReport> report = absl::UnknownError("no benchmark");
  if (app.got_subcommand("filter")) report = BenchFilter(filter);
  if (app.got_subcommand("search")) report = BenchSearch(search);
  if (app.got_subcommand("frame")) report = BenchFrame(frame);
  if (app.got_subcommand("map")) report = BenchMap(map);
  if (!report.ok()) return Fail(report.status());
  std::cout << (json ? report->Json() : report->Table());
  return 0;
}

}  // namespace
}  // namespace saccade

int main(int argc, char** argv) { return saccade::Main(argc, argv); }
