#pragma once

#include "server/filter/filter_state.hpp"

namespace saccade {

/// A clone of the camera's present pose, for features to be started in; it goes again with this
/// object if none was.
class NewClone {
 public:
  explicit NewClone(FilterState& filter) : filter_(filter), id_(filter.AddClone()) {}
  ~NewClone() { filter_.Remove({}); }
  NewClone(const NewClone&) = delete;
  NewClone& operator=(const NewClone&) = delete;
  CloneId id() const { return id_; }

 private:
  FilterState& filter_;
  const CloneId id_;
};

}  // namespace saccade
