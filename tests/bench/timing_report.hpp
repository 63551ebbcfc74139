#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/eval/statistics.hpp"
#include "server/pipeline/stop_watch.hpp"

namespace saccade {

/// The least time of each item over several runs of the same work: what it costs on this machine
/// when nobody else is at it.
class LeastTimes {
 public:
  void Add(std::size_t item, double ms);
  Sample ToSample() const;

 private:
  std::vector<double> least_ms_;
};

/// Times of one kind of work, and what they are held against.
struct TimingRow {
  std::string group;  // "100 features, SID"
  std::string stage;  // "update"
  Sample times_ms;
  std::optional<double> bar_p99_ms;  // slam-spec section 12, where it names one
};

/// What a benchmark found: a table for people, JSON for programs.
struct TimingReport {
  std::string bench;
  std::vector<std::pair<std::string, std::string>> facts;  // what was run, on what
  std::vector<TimingRow> rows;

  std::string Table() const;
  std::string Json() const;
};

}  // namespace saccade
