#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "client/net/types.hpp"

namespace saccade::session {

/// The server's annotations, with what was asked for here and not heard back of. One thread.
class AnnotationBook {
 public:
  void Apply(const net::AnnotationChange& change);
  /// The answer to a request of ours, usually ahead of the stream's; late, it may be gone by then.
  void Put(const Annotation& annotation);
  /// Hides it while its deletion is under way; Show() takes that back.
  void Hide(const std::string& id);
  void Show(const std::string& id);

  /// Shows it turned so, whatever the server tells, until EndPreview().
  void PreviewTurn(const std::string& id, const Eigen::Quaterniond& world_from_mark);
  void EndPreview(const std::string& id);

  /// A mark made here that the server has not answered yet; `id` is its request's.
  void AddPending(Annotation guess);
  void RemovePending(const std::string& request_id);

  /// Oldest first, without those being deleted.
  std::vector<Annotation> List() const;
  std::vector<Annotation> Pending() const;
  const Annotation* Find(const std::string& id) const;
  std::size_t size() const { return known_.size(); }

 private:
  std::map<std::string, Annotation> known_;
  std::map<std::string, Annotation> pending_;
  std::set<std::string> leaving_, gone_;
  std::map<std::string, Eigen::Quaterniond> turned_;
};

}  // namespace saccade::session
