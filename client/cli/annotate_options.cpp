#include "client/cli/annotate_options.hpp"

#include <absl/strings/str_cat.h>

#include <map>
#include <vector>

#include "client/cli/option_values.hpp"

namespace saccade::cli {
namespace {

const std::map<std::string, AnnotationShape>& Shapes() {
  static const std::map<std::string, AnnotationShape> shapes = {
      {"cube", AnnotationShape::kCube},
      {"note", AnnotationShape::kNote},
      {"arrow", AnnotationShape::kArrow},
      {"ink", AnnotationShape::kInk},
      {"box", AnnotationShape::kBox},
      {"measure", AnnotationShape::kMeasure},
      {"pin", AnnotationShape::kPin},
      {"picture", AnnotationShape::kPicture},
      {"check-list", AnnotationShape::kCheckList}};
  return shapes;
}

// What only some shapes have.
void AddShapes(CLI::App& annotate, Options& options, RawOptions& raw) {
  const auto numbers = [](std::size_t count, const char* form) {
    return Checked([count](const std::string& t) { return ParseNumbers(t, count); }, form);
  };
  CLI::Option* pixel =
      annotate.add_option("--to-pixel", raw.to_pixel, "U,V of a measure's other end, same picture")
          ->check(numbers(2, "U,V"));
  CLI::Option* feature =
      annotate.add_option("--to-feature", raw.to_feature, "Id of the feature at its other end")
          ->check(Id());
  CLI::Option* point =
      annotate.add_option("--to-point", raw.to_point, "X,Y,Z of its other end, in world [m]")
          ->check(numbers(3, "X,Y,Z"));
  pixel->excludes(feature)->excludes(point);
  feature->excludes(point);
  annotate.add_option("--extent", raw.extent, "X,Y,Z: edges of a box [m] (else --size each)")
      ->check(numbers(3, "X,Y,Z"));
  annotate
      .add_option("--rotation", raw.rotation,
                  "X,Y,Z,W: unit quaternion that turns an arrow or a box (world from mark)")
      ->check(numbers(4, "X,Y,Z,W"));
  annotate.add_option("--picture", options.picture, "PNG or JPEG file of a picture, at most 1 MiB")
      ->check(CLI::ExistingFile);
  annotate
      .add_option("--item", options.draft.check_items,
                  "A line of a check list, at most 100 bytes; once for each, at most 30")
      ->check(Utf8());
}

// What belongs to some shapes alone.
absl::Status FinishShape(const RawOptions& raw, const std::string& picture,
                         AnnotationDraft& draft) {
  const AnnotationShape shape = draft.shape;
  const bool measure = shape == AnnotationShape::kMeasure, box = shape == AnnotationShape::kBox;
  const bool to = !raw.to_pixel.empty() || raw.to_feature || !raw.to_point.empty();
  const struct {
    bool given, fits, needed;
    const char *flag, *whose;
  } kRules[] = {{to, measure, measure, "--to-pixel, --to-feature or --to-point", "--shape measure"},
                {!raw.extent.empty(), box, false, "--extent", "--shape box"},
                {!raw.rotation.empty(), box || shape == AnnotationShape::kArrow, false,
                 "--rotation", "--shape arrow or box"},
                {!picture.empty(), shape == AnnotationShape::kPicture,
                 shape == AnnotationShape::kPicture, "--picture", "--shape picture"},
                {!draft.check_items.empty(), shape == AnnotationShape::kCheckList,
                 shape == AnnotationShape::kCheckList, "--item", "--shape check-list"}};
  for (const auto& rule : kRules) {
    if (rule.given && !rule.fits) {
      return absl::InvalidArgumentError(absl::StrCat(rule.flag, " is for ", rule.whose, " only"));
    }
    if (rule.needed && !rule.given) {
      return absl::InvalidArgumentError(absl::StrCat(rule.whose, " needs ", rule.flag));
    }
  }
  if (!raw.to_pixel.empty()) {
    const std::vector<double> uv = *ParseNumbers(raw.to_pixel, 2);
    draft.end_target = PixelTarget{0, {uv[0], uv[1]}};
  } else if (raw.to_feature) {
    draft.end_target = FeatureTarget{*raw.to_feature};
  } else if (!raw.to_point.empty()) {
    const std::vector<double> xyz = *ParseNumbers(raw.to_point, 3);
    draft.end_target = PointTarget{{xyz[0], xyz[1], xyz[2]}};
  }
  if (!raw.extent.empty()) {
    const std::vector<double> xyz = *ParseNumbers(raw.extent, 3);
    draft.extent_m = Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
  }
  if (!raw.rotation.empty()) {
    const std::vector<double> q = *ParseNumbers(raw.rotation, 4);
    draft.world_from_mark = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
  }
  return absl::OkStatus();
}

}  // namespace

void AddAnnotate(CLI::App& app, Options& options, RawOptions& raw) {
  CLI::App* annotate = app.add_subcommand("annotate", "Place an annotation");
  CLI::Option* pixel =
      annotate->add_option("--pixel", raw.pixel, "U,V in the raw picture; (0,0) is its first pixel")
          ->check(Checked([](const std::string& t) { return ParseNumbers(t, 2); }, "U,V"));
  annotate->add_option("--frame", options.frame, "Frame id of that picture; else the newest")
      ->check(Id())
      ->needs(pixel);
  CLI::Option* feature =
      annotate->add_option("--feature", raw.feature, "Id of a feature")->check(Id());
  CLI::Option* point =
      annotate->add_option("--point", raw.point, "X,Y,Z in world [m]")
          ->check(Checked([](const std::string& t) { return ParseNumbers(t, 3); }, "X,Y,Z"));
  pixel->excludes(feature)->excludes(point);
  feature->excludes(point);
  annotate
      ->add_option("--shape", raw.shape,
                   "cube, note, arrow, ink, box, measure, pin, picture or check-list")
      ->check(CLI::IsMember(
          {"cube", "note", "arrow", "ink", "box", "measure", "pin", "picture", "check-list"}))
      ->capture_default_str();
  annotate->add_option("--text", options.draft.text, "Text, at most 500 bytes")->check(Utf8());
  annotate->add_option("--size", options.draft.size_m, "Size [m]")
      ->check(Number(0.001, 10.0))
      ->capture_default_str();
  annotate->add_option("--color", raw.color, "RRGGBB, for example ff9a3d (else white)")
      ->check(Checked(ParseColor, "RRGGBB"));
  annotate->add_option("--stroke", raw.stroke, "U1,V1,U2,V2,... of an ink shape, with --pixel")
      ->needs(pixel)
      ->check(Checked(ParseStroke, "U1,V1,U2,V2,..."));
  AddShapes(*annotate, options, raw);
}

void AddAnnotations(CLI::App& app, Options& options) {
  CLI::App* annotations = app.add_subcommand("annotations", "List, show, delete or undo");
  annotations->require_subcommand(0, 1);
  annotations->add_subcommand("list", "All of them (this is what no word means)");
  CLI::App* show = annotations->add_subcommand("show", "One of them in full");
  show->add_option("id", options.id, "Its id, or the beginning of it")->required();
  CLI::App* remove = annotations->add_subcommand("delete", "Delete one");
  remove->add_option("id", options.id, "Its id, or the beginning of it")->required();
  CLI::App* lock =
      annotations->add_subcommand("lock", "Only you and the wearer may change or delete it then");
  lock->add_option("id", options.id, "Its id, or the beginning of it")->required();
  CLI::App* unlock = annotations->add_subcommand("unlock", "Everybody may again");
  unlock->add_option("id", options.id, "Its id, or the beginning of it")->required();
  CLI::App* tick = annotations->add_subcommand("tick", "Tick a line of a check list off");
  tick->add_option("id", options.id, "Its id, or the beginning of it")->required();
  tick->add_option("line", options.line, "Which, from 1")->required()->check(CLI::Range(1U, 30U));
  tick->add_flag("--undone", options.untick, "It is not done after all");
  CLI::App* picture = annotations->add_subcommand("picture", "Write the file of a picture");
  picture->add_option("id", options.id, "Its id, or the beginning of it")->required();
  picture->add_option("--out", options.out, "The file to write")->required();
  annotations->add_subcommand("undo", "Take back your own last change");
  annotations->add_subcommand("redo", "Make it again");
}

absl::Status FinishDraft(const RawOptions& raw, const std::string& picture,
                         AnnotationDraft& draft) {
  draft.shape = Shapes().at(raw.shape);
  if (!raw.pixel.empty()) {
    const std::vector<double> uv = *ParseNumbers(raw.pixel, 2);
    draft.target = PixelTarget{0, {uv[0], uv[1]}};
  } else if (raw.feature) {
    draft.target = FeatureTarget{*raw.feature};
  } else if (!raw.point.empty()) {
    const std::vector<double> xyz = *ParseNumbers(raw.point, 3);
    draft.target = PointTarget{{xyz[0], xyz[1], xyz[2]}};
  } else {
    return absl::InvalidArgumentError("annotate needs --pixel U,V, --feature ID or --point X,Y,Z");
  }
  const bool ink = draft.shape == AnnotationShape::kInk;
  if (ink != !raw.stroke.empty()) {
    return absl::InvalidArgumentError(ink ? "--shape ink needs --stroke U1,V1,U2,V2,..."
                                          : "--stroke is for --shape ink only");
  }
  if (absl::Status shaped = FinishShape(raw, picture, draft); !shaped.ok()) return shaped;
  if (!raw.color.empty()) draft.color_rgba = *ParseColor(raw.color);
  if (ink) draft.ink_px = *ParseStroke(raw.stroke);
  return absl::OkStatus();
}

}  // namespace saccade::cli
