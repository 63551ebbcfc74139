#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace saccade::testing {

/// An issuer that says whatever a test wants: HTTP on loopback, one request a connection.
class Issuer {
 public:
  struct Reply {
    int status = 200;
    std::string body;
    std::string headers{};  // more lines, each with its end
    int delay_ms = 0;
  };
  Issuer();
  ~Issuer();

  std::string url() const;
  /// Answers of that path from now on; what has none is not found.
  void Set(const std::string& path, Reply reply);
  /// The discovery document, with these fields instead of the usual ones.
  void SetDiscovery(const std::map<std::string, std::string>& changes = {});
  /// How often a path was asked for, and the last body that was sent.
  int asked(const std::string& path) const;
  std::string last_body() const;

 private:
  void Serve(int socket);

  int socket_ = -1, port_ = 0;
  mutable std::mutex mutex_;
  std::map<std::string, Reply> replies_;  // guarded by mutex_, as what follows
  std::map<std::string, int> asked_;
  std::string last_body_;
  std::thread thread_;
};

}  // namespace saccade::testing
