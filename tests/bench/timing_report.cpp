#include "tests/bench/timing_report.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

namespace saccade {
namespace {

std::string ProcessorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("model name")) continue;
    const std::size_t colon = line.find(':');
    if (colon != std::string::npos && colon + 2 < line.size()) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string LoadAverage() {
  std::ifstream file("/proc/loadavg");
  std::string one_minute;
  file >> one_minute;
  return one_minute.empty() ? "unknown" : one_minute;
}

/// What figures depend on beside the code.
std::vector<std::pair<std::string, std::string>> Machine() {
  return {{"processor", ProcessorName()},
          {"cores", absl::StrCat(std::thread::hardware_concurrency())},
          {"load_1min", LoadAverage()}};
}

}  // namespace

void LeastTimes::Add(std::size_t item, double ms) {
  if (item >= least_ms_.size()) least_ms_.resize(item + 1, 1e300);
  least_ms_[item] = std::min(least_ms_[item], ms);
}

Sample LeastTimes::ToSample() const {
  Sample sample;
  for (const double ms : least_ms_) sample.Add(ms);
  return sample;
}

std::string TimingReport::Table() const {
  std::string text = absl::StrCat("saccade-bench ", bench, "\n");
  for (const auto& list : {facts, Machine()}) {
    for (const auto& [name, value] : list)
      absl::StrAppendFormat(&text, "  %-12s %s\n", name, value);
  }
  absl::StrAppendFormat(&text, "\n%-30s %-27s %7s %9s %9s %9s  %s\n", "", "[ms]", "count", "p50",
                        "p99", "worst", "p99 asked");
  const std::string* group = nullptr;
  for (const TimingRow& row : rows) {
    const bool again = group != nullptr && *group == row.group;
    group = &row.group;
    absl::StrAppendFormat(&text, "%-30s %-27s %7d %9.4f %9.4f %9.4f", again ? "" : row.group,
                          row.stage, row.times_ms.size(), row.times_ms.Percentile(50),
                          row.times_ms.Percentile(99), row.times_ms.Max());
    if (row.bar_p99_ms) {
      const bool met = row.times_ms.Percentile(99) <= *row.bar_p99_ms;
      absl::StrAppendFormat(&text, "  %g %s", *row.bar_p99_ms, met ? "met" : "MISSED");
    }
    text += "\n";
  }
  return text;
}

std::string TimingReport::Json() const {
  nlohmann::ordered_json json;
  json["bench"] = bench;
  for (const auto& list : {facts, Machine()}) {
    for (const auto& [name, value] : list) json[name] = value;
  }
  json["rows"] = nlohmann::ordered_json::array();
  for (const TimingRow& row : rows) {
    nlohmann::ordered_json one = {{"group", row.group},
                                  {"stage", row.stage},
                                  {"count", row.times_ms.size()},
                                  {"p50_ms", row.times_ms.Percentile(50)},
                                  {"p99_ms", row.times_ms.Percentile(99)},
                                  {"max_ms", row.times_ms.Max()}};
    if (row.bar_p99_ms) one["p99_asked_ms"] = *row.bar_p99_ms;
    json["rows"].push_back(std::move(one));
  }
  return json.dump(2) + "\n";
}

}  // namespace saccade
