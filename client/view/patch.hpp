#pragma once

#include <string>
#include <utility>

#include "client/view/desk_state.hpp"

namespace saccade::view {

/// A change of one field.
template <typename T, typename Value>
AnnotationPatch PatchOf(const std::string& id, T AnnotationPatch::*field, Value&& value) {
  AnnotationPatch patch;
  patch.id = id;
  patch.*field = std::forward<Value>(value);
  return patch;
}

inline const char* NameOf(Pane pane) { return pane == Pane::kMap ? "map" : "video"; }

}  // namespace saccade::view
