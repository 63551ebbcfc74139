#pragma once

#include <absl/status/status.h>

#include <cstddef>

#include "saccade/v1/annotation.pb.h"
#include "server/pipeline/events.hpp"

namespace saccade {

/// An answer of List is at most about this large encoded.
inline constexpr std::size_t kPageBytes = 1 << 20;

/// One page of `annotations` (oldest first). Its token names a place in their order of creation,
/// not an index: what is made or deleted between two pages shifts nothing, and a token outlives a
/// restart. InvalidArgument: page_token is not one of ours.
absl::Status ListPage(const AnnotationList& annotations, const v1::ListAnnotationsRequest& request,
                      v1::ListAnnotationsResponse& response);

}  // namespace saccade
