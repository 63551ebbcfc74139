#pragma once

#include <string>

namespace saccade::testing {

/// A certificate with its key, as PEM.
struct TestPair {
  std::string certificate_pem{}, key_pem{};
};

/// A firm's authority for machines, as others than this server make one.
class TestAuthority {
 public:
  explicit TestAuthority(const std::string& common_name);
  const std::string& pem() const { return own_.certificate_pem; }
  /// `uri` empty: no alternative name. `life_s` from now; negative: it has ended.
  TestPair Issue(const std::string& common_name, const std::string& uri, int life_s) const;

 private:
  const TestPair own_;
};

}  // namespace saccade::testing
