#include "client/cli/problem.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>

namespace saccade::cli {
namespace {

struct FieldFlag {
  absl::string_view field;  // of the API
  absl::string_view flag;
};
constexpr std::array<FieldFlag, 20> kFlags = {{{"end_target.frame_pixel.pixel", "--to-pixel"},
                                               {"end_target.feature_id", "--to-feature"},
                                               {"end_target.point_in_world_m", "--to-point"},
                                               {"extent_m", "--extent"},
                                               {"world_from_mark", "--rotation"},
                                               {"picture", "--picture"},
                                               {"target.frame_pixel.pixel", "--pixel"},
                                               {"target.frame_pixel.frame_id", "--frame"},
                                               {"target.feature_id", "--feature"},
                                               {"target.annotation_id", "--annotation"},
                                               {"target.point_in_world_m", "--point"},
                                               {"text", "--text"},
                                               {"size_m", "--size"},
                                               {"color_rgba", "--color"},
                                               {"ink_px", "--stroke"},
                                               {"shape", "--shape"},
                                               {"display_name", "--name"},
                                               {"frame_id", "--frame"},
                                               {"view", "--view"},
                                               {"id", "id"}}};

/// What of the command line named the target that the API calls so.
absl::string_view TargetFlag(const Options& options) {
  if (options.command == Command::kFixate) {
    return std::holds_alternative<GazeAnnotation>(options.gaze) ? "--annotation"
           : std::holds_alternative<GazeFeature>(options.gaze)  ? "--feature"
                                                                : "--point";
  }
  return std::holds_alternative<PixelTarget>(options.draft.target)     ? "--pixel"
         : std::holds_alternative<FeatureTarget>(options.draft.target) ? "--feature"
                                                                       : "--point";
}

/// ".pixel.u" as "pixel u", "[3].u" as "point 4, u": people count from one.
std::string PartWords(absl::string_view rest) {
  std::string words;
  while (!rest.empty()) {
    int index = 0;
    if (absl::ConsumePrefix(&rest, "[")) {
      while (!rest.empty() && rest[0] != ']') {
        if (index < 100'000'000) index = 10 * index + (rest[0] - '0');
        rest.remove_prefix(1);
      }
      absl::ConsumePrefix(&rest, "]");
      absl::StrAppend(&words, words.empty() ? "" : " ", "point ", index + 1,
                      rest.empty() ? "" : ",");
    } else {
      absl::ConsumePrefix(&rest, ".");
      const std::size_t end = std::min(rest.find_first_of(".["), rest.size());
      absl::StrAppend(&words, words.empty() ? "" : " ", rest.substr(0, end));
      rest.remove_prefix(end);
    }
  }
  return absl::StrReplaceAll(words, {{"_", " "}});
}

/// "--pixel: u", or the field in words where no flag gave it.
std::string FieldWords(const Options& options, absl::string_view field) {
  absl::ConsumePrefix(&field, "draft.");
  for (const FieldFlag& entry : kFlags) {
    absl::string_view rest = field;
    if (!absl::ConsumePrefix(&rest, entry.field)) continue;
    if (!rest.empty() && rest[0] != '.' && rest[0] != '[') continue;
    return absl::StrCat(entry.flag, ": ", PartWords(rest));
  }
  if (field == "target") return absl::StrCat(TargetFlag(options), ": ");
  return PartWords(field) + ":";
}

bool IsOfPath(char c) {
  return absl::ascii_islower(static_cast<unsigned char>(c)) ||
         absl::ascii_isdigit(static_cast<unsigned char>(c)) || absl::StrContains("_.[]", c);
}

}  // namespace

std::string ProblemText(const Options& options, const absl::Status& problem) {
  std::string message(problem.message().substr(0, 2000));
  for (char& c : message) {
    if (absl::ascii_iscntrl(static_cast<unsigned char>(c))) c = ' ';
  }
  const auto past = std::find_if_not(message.begin(), message.end(), IsOfPath);
  const absl::string_view field(message.data(), static_cast<std::size_t>(past - message.begin()));
  absl::string_view rest(message.data() + field.size(), message.size() - field.size());
  // A field is followed by a colon, or is a path that nobody would write in a sentence.
  const bool is_path = absl::StartsWith(field, "target.");
  if (field.empty() || !absl::ascii_islower(static_cast<unsigned char>(field[0])) ||
      !(absl::ConsumePrefix(&rest, ": ") || (is_path && absl::ConsumePrefix(&rest, " ")))) {
    return message;
  }
  const std::string words = FieldWords(options, field);
  return absl::StrCat(words, absl::EndsWith(words, " ") ? "" : " ", rest);
}

nlohmann::json ProblemJson(absl::StatusCode code, const std::string& message) {
  return {{"error", {{"code", absl::StatusCodeToString(code)}, {"message", message}}}};
}

}  // namespace saccade::cli
