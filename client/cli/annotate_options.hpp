#pragma once

#include <absl/status/status.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/options.hpp"

namespace saccade::cli {

/// As typed, before it is checked.
struct RawOptions {
  double timeout_s = 5;
  std::string view = "raw";
  std::string shape = "cube";
  std::string pixel, point, stroke, color;
  std::string to_pixel, to_point, extent, rotation;
  std::optional<std::uint64_t> to_feature;
  std::optional<std::uint64_t> feature;
  std::string annotation;  // fixate
};

/// A validator that leaves the text as it is.
template <typename Parse>
CLI::Validator Checked(Parse parse, const std::string& form) {
  return CLI::Validator(
      [parse](std::string& text) {
        const auto parsed = parse(text);
        return parsed.ok() ? std::string() : std::string(parsed.status().message());
      },
      form);
}

/// `annotate` and `annotations`.
void AddAnnotate(CLI::App& app, Options& options, RawOptions& raw);
void AddAnnotations(CLI::App& app, Options& options);

/// What CLI11 cannot say of `annotate`: exactly one target, what belongs to some shapes alone.
absl::Status FinishDraft(const RawOptions& raw, const std::string& picture, AnnotationDraft& draft);

}  // namespace saccade::cli
