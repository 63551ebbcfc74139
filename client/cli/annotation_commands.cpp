#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <iostream>

#include "client/cli/commands.hpp"
#include "client/cli/text.hpp"

namespace saccade::cli {
namespace {

// A map without a target has no metres; only the pose says so.
absl::StatusOr<bool> IsMetric(net::Connection& connection) {
  const absl::StatusOr<net::ServerStatus> status = connection.GetStatus();
  if (!status.ok()) return status.status();
  return status->pose.metric;
}

std::string Line(const Annotation& annotation, bool metric) {
  const Anchor& anchor = annotation.anchor;
  return absl::StrCat(Word(annotation.shape), " ", annotation.id, ": ", StateText(anchor), ", ",
                      ErrorText(anchor, metric),
                      anchor.place_known ? ", " + PlaceText(anchor) : "");
}

std::string FullText(const Annotation& annotation, bool metric) {
  const Anchor& anchor = annotation.anchor;
  return Table(
      {{"id", annotation.id},
       {"shape", absl::StrFormat("%s, %.3f%s", Word(annotation.shape), annotation.size_m,
                                 metric ? " m" : ", scale unknown")},
       {"text", annotation.text.empty() ? "(none)" : annotation.text},
       {"author", annotation.author},
       {"revision", absl::StrCat(annotation.revision)},
       {"state", absl::StrCat(StateText(anchor), anchor.reason.empty() ? "" : ": ", anchor.reason)},
       {"error", ErrorText(anchor, metric)},
       {"point", absl::StrCat(PlaceText(anchor), ", by ", Word(anchor.method))},
       {"pixel", anchor.pixel ? absl::StrFormat("%.1f,%.1f", anchor.pixel->x(), anchor.pixel->y())
                              : "out of view"}});
}

// A table has a line for each, however many its text has.
std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string ListText(const std::vector<Annotation>& annotations, bool metric) {
  if (annotations.empty()) return "no annotations\n";
  std::vector<std::vector<std::string>> rows = {{"id", "shape", "state", "error", "text"}};
  for (const Annotation& annotation : annotations) {
    rows.push_back({annotation.id, std::string(Word(annotation.shape)),
                    StateText(annotation.anchor), ErrorText(annotation.anchor, metric),
                    OneLine(annotation.text)});
  }
  return Table(rows);
}

// The one annotation whose id begins with `prefix`.
absl::StatusOr<Annotation> Find(net::Connection& connection, const std::string& prefix) {
  const absl::StatusOr<std::vector<Annotation>> all = connection.ListAnnotations();
  if (!all.ok()) return all.status();
  const Annotation* found = nullptr;
  for (const Annotation& annotation : *all) {
    if (!absl::StartsWith(annotation.id, prefix)) continue;
    if (found != nullptr) {
      return absl::InvalidArgumentError(
          absl::StrCat("more than one annotation begins with ", prefix, "; give more of the id"));
    }
    found = &annotation;
  }
  if (found == nullptr || prefix.empty()) {
    return absl::NotFoundError(absl::StrCat("there is no annotation '", prefix,
                                            "'; 'saccade annotations' lists those there are"));
  }
  return *found;
}

}  // namespace

absl::Status RunAnnotate(const Options& options, net::Connection& connection) {
  AnnotationDraft draft = options.draft;
  if (auto* target = std::get_if<PixelTarget>(&draft.target)) {
    if (options.frame) {
      target->frame_id = *options.frame;
    } else {
      const absl::StatusOr<net::ServerStatus> status = connection.GetStatus();
      if (!status.ok()) return status.status();
      target->frame_id = status->pose.frame_id;
    }
  }
  const absl::StatusOr<Annotation> annotation = connection.CreateAnnotation(std::move(draft));
  if (!annotation.ok()) return annotation.status();
  const absl::StatusOr<bool> metric = IsMetric(connection);
  if (!metric.ok()) return metric.status();
  std::cout << (options.json ? Dump(ToJson(*annotation, *metric), 2) : Line(*annotation, *metric))
            << "\n";
  return absl::OkStatus();
}

absl::Status RunAnnotations(const Options& options, net::Connection& connection) {
  if (options.command == Command::kUndo || options.command == Command::kRedo) {
    const bool undo = options.command == Command::kUndo;
    const absl::StatusOr<std::string> done = undo ? connection.Undo() : connection.Redo();
    if (!done.ok()) return done.status();
    if (options.json) {
      std::cout << Dump({{undo ? "undone" : "redone", *done}}) << "\n";
    } else {
      std::cout << *done << "\n";
    }
    return absl::OkStatus();
  }
  const absl::StatusOr<bool> metric = IsMetric(connection);
  if (!metric.ok()) return metric.status();
  if (options.command == Command::kListAnnotations) {
    const absl::StatusOr<std::vector<Annotation>> all = connection.ListAnnotations();
    if (!all.ok()) return all.status();
    std::cout << (options.json ? Dump(ToJson(*all, *metric), 2) + "\n" : ListText(*all, *metric));
    return absl::OkStatus();
  }
  const absl::StatusOr<Annotation> annotation = Find(connection, options.id);
  if (!annotation.ok()) return annotation.status();
  if (options.command == Command::kShowAnnotation) {
    std::cout << (options.json ? Dump(ToJson(*annotation, *metric), 2) + "\n"
                               : FullText(*annotation, *metric));
    return absl::OkStatus();
  }
  if (absl::Status deleted = connection.DeleteAnnotation(annotation->id); !deleted.ok()) {
    return deleted;
  }
  if (options.json) {
    std::cout << Dump({{"deleted", annotation->id}}) << "\n";
  } else {
    std::cout << "deleted " << annotation->id << "\n";
  }
  return absl::OkStatus();
}

}  // namespace saccade::cli
