#pragma once

#include <memory>
#include <string>

namespace saccade::testing {

/// OpenH264's decoder, used for its time and its verdict.
class H264Sink {
 public:
  H264Sink();
  ~H264Sink();
  /// False if the access unit cannot be decoded after those before it.
  bool Decode(const std::string& access_unit);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade::testing
