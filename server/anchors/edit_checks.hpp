#pragma once

#include <absl/status/status.h>

#include <string>

#include "shared/scene/annotation.hpp"

namespace saccade {

/// InvalidArgument, naming the field, if a draft or patch is out of range. Targets are checked when
/// they are resolved.
absl::Status CheckDraft(const AnnotationDraft& draft);
absl::Status CheckPatch(const AnnotationPatch& patch);

/// A random UUID (version 4).
std::string MakeUuid();

/// "cube 6f1c2a9e": how messages name an annotation.
std::string ShortName(const Annotation& annotation);

}  // namespace saccade
