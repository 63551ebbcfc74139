#pragma once

#include <absl/status/status.h>

#include <string>

#include "shared/scene/annotation.hpp"

namespace saccade {

/// InvalidArgument, naming the field, if a draft or patch is out of range. Targets are checked when
/// they are resolved.
absl::Status CheckDraft(const AnnotationDraft& draft);
absl::Status CheckPatch(const AnnotationPatch& patch);
/// The same, if the patch changes what that shape does not have.
absl::Status CheckPatchSuits(const AnnotationPatch& patch, AnnotationShape shape);

bool IsAuthorOrWearer(const Annotation& annotation, const Editor& editor);
/// PermissionDenied, saying who locked it, unless the editor may change, delete and unlock it.
absl::Status CheckMayChange(const Annotation& annotation, const Editor& editor);
/// PermissionDenied unless the editor may lock and unlock it.
absl::Status CheckMayLock(const Annotation& annotation, const Editor& editor);

/// A random UUID (version 4).
std::string MakeUuid();

/// "cube 6f1c2a9e": how messages name an annotation.
std::string ShortName(const Annotation& annotation);

}  // namespace saccade
