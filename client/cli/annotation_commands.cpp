#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <vector>

#include "client/cli/commands.hpp"
#include "client/cli/text.hpp"
#include "shared/marks/shape_lines.hpp"
#include "shared/scene/limits.hpp"

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
  std::vector<std::vector<std::string>> rows = {
      {"id", annotation.id},
      {"shape", absl::StrFormat("%s, %.3f%s", Word(annotation.shape), annotation.size_m,
                                metric ? " m" : ", scale unknown")},
      {"text", annotation.text.empty() ? "(none)" : annotation.text},
      {"author", annotation.author},
      {"revision", absl::StrCat(annotation.revision)},
      {"state", absl::StrCat(StateText(anchor), anchor.reason.empty() ? "" : ": ", anchor.reason)},
      {"error", ErrorText(anchor, metric)},
      {"point", absl::StrCat(PlaceText(anchor), ", by ", Word(anchor.method))},
      {"pixel", anchor.pixel ? absl::StrFormat("%.1f,%.1f", anchor.pixel->x(), anchor.pixel->y())
                             : "out of view"}};
  if (annotation.locked) rows.push_back({"locked", "yes"});
  if (annotation.number > 0) rows.push_back({"number", absl::StrCat(annotation.number)});
  if (annotation.shape == AnnotationShape::kMeasure) {
    rows.push_back({"length", MeasureText(annotation.length_m, annotation.length_sigma_m, metric)});
  }
  if (annotation.shape == AnnotationShape::kBox) {
    rows.push_back({"edges", PointText(annotation.extent_m, metric)});
  }
  if (annotation.picture) {
    rows.push_back(
        {"picture", absl::StrFormat("%s, %d x %d px", annotation.picture->media_type,
                                    annotation.picture->width, annotation.picture->height)});
  }
  if (annotation.check_items) {
    int line = 0;
    for (const CheckItem& item : *annotation.check_items) {
      rows.push_back({absl::StrCat("line ", ++line),
                      absl::StrCat(item.done ? "[x] " : "[ ] ", item.text,
                                   item.done ? absl::StrCat(", by ", item.done_by) : "")});
    }
  }
  return Table(rows);
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

/// No more than the server takes: what is larger is said here, and not sent.
absl::StatusOr<std::string> ReadPicture(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(kMaxPictureBytes + 1, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  if (bytes.empty()) {
    return absl::NotFoundError(absl::StrCat("cannot read ", path, ", or it is empty"));
  }
  if (bytes.size() > kMaxPictureBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("--picture: ", path, " is larger than 1 MiB: make it smaller"));
  }
  return bytes;
}

absl::Status ChangeOne(const Options& options, const Annotation& annotation, bool metric,
                       net::Connection& connection) {
  if (options.command == Command::kPicture) {
    const absl::StatusOr<Picture> picture = connection.GetPicture(annotation.id);
    if (!picture.ok()) return picture.status();
    return WriteFile(options.out, picture->bytes);
  }
  absl::StatusOr<Annotation> changed;
  if (options.command == Command::kTick) {
    changed = connection.TickCheckItem(annotation.id, options.line - 1, !options.untick);
  } else {
    AnnotationPatch patch;
    patch.id = annotation.id;
    patch.locked = options.command == Command::kLock;
    changed = connection.UpdateAnnotation(patch);
  }
  if (!changed.ok()) return changed.status();
  std::cout << (options.json ? Dump(ToJson(*changed, metric), 2) + "\n"
                             : FullText(*changed, metric));
  return absl::OkStatus();
}

}  // namespace

absl::Status RunAnnotate(const Options& options, net::Connection& connection) {
  AnnotationDraft draft = options.draft;
  std::vector<PixelTarget*> pixels = {std::get_if<PixelTarget>(&draft.target)};
  if (draft.end_target) pixels.push_back(std::get_if<PixelTarget>(&*draft.end_target));
  std::erase(pixels, nullptr);
  if (!pixels.empty()) {
    FrameId frame = options.frame.value_or(0);
    if (!options.frame) {
      const absl::StatusOr<net::ServerStatus> status = connection.GetStatus();
      if (!status.ok()) return status.status();
      frame = status->pose.frame_id;
    }
    for (PixelTarget* pixel : pixels) pixel->frame_id = frame;
  }
  if (!options.picture.empty()) {
    absl::StatusOr<std::string> bytes = ReadPicture(options.picture);
    if (!bytes.ok()) return bytes.status();
    draft.picture = std::make_shared<const Picture>(Picture{"", "", 0, 0, *std::move(bytes)});
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
  if (options.command != Command::kDeleteAnnotation) {
    return ChangeOne(options, *annotation, *metric, connection);
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
