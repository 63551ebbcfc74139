#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace saccade::tools {

/// Which marks are selected, in the order in which that was done.
class Selection {
 public:
  void Only(const std::string& id) { ids_ = {id}; }
  void Set(std::vector<std::string> ids) { ids_ = std::move(ids); }
  void Toggle(const std::string& id) {
    if (std::erase(ids_, id) == 0) ids_.push_back(id);
  }
  void Drop(const std::string& id) { std::erase(ids_, id); }
  void Clear() { ids_.clear(); }

  bool empty() const { return ids_.empty(); }
  bool Has(const std::string& id) const {
    return std::find(ids_.begin(), ids_.end(), id) != ids_.end();
  }
  /// The newest; empty: none.
  std::string last() const { return ids_.empty() ? std::string() : ids_.back(); }
  const std::vector<std::string>& ids() const { return ids_; }

 private:
  std::vector<std::string> ids_;
};

}  // namespace saccade::tools
