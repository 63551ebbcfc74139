#include "client/cli/option_values.hpp"

#include <absl/algorithm/container.h>
#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/options.hpp"
#include "client/cli/text.hpp"

namespace saccade::cli {
namespace {

absl::StatusOr<std::vector<double>> ParseList(absl::string_view text) {
  std::vector<double> numbers;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    double number = 0;
    if (!absl::SimpleAtod(part, &number) || !std::isfinite(number)) {
      return absl::InvalidArgumentError(absl::StrCat("'", part, "' is not a finite number"));
    }
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

absl::StatusOr<std::uint32_t> ParseColor(absl::string_view text) {
  std::uint32_t rgb = 0;
  if (text.size() != 6 || !absl::c_all_of(text, absl::ascii_isxdigit) ||
      !absl::SimpleHexAtoi(text, &rgb)) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text, "' is not a colour: RRGGBB, for example ff9a3d"));
  }
  return (rgb << 8) | 0xffu;
}

CLI::Validator Number(double least, double most) {
  return CLI::Validator(
      [least, most](std::string& text) {
        double number = 0;
        return absl::SimpleAtod(text, &number) && number >= least && number <= most
                   ? std::string()
                   : absl::StrCat("'", text, "' is not a number from ", least, " to ", most);
      },
      "");
}

CLI::Validator Id() {
  return CLI::Validator(
      [](std::string& text) {
        std::uint64_t id = 0;
        return absl::SimpleAtoi(text, &id) && text.find('-') == std::string::npos
                   ? std::string()
                   : absl::StrCat("'", text, "' is not an id (a whole number)");
      },
      "");
}

CLI::Validator Utf8() {
  return CLI::Validator(
      [](std::string& text) {
        const std::string whole = Dump(text);  // replaces what is not
        return nlohmann::json::parse(whole, nullptr, false) == text ? std::string()
                                                                    : "this is not UTF-8";
      },
      "");
}

absl::StatusOr<std::vector<double>> ParseNumbers(absl::string_view text, std::size_t count) {
  absl::StatusOr<std::vector<double>> numbers = ParseList(text);
  if (numbers.ok() && numbers->size() != count) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text, "' has ", numbers->size(), " numbers, not ", count));
  }
  return numbers;
}

absl::StatusOr<std::vector<Eigen::Vector2d>> ParseStroke(absl::string_view text) {
  const absl::StatusOr<std::vector<double>> numbers = ParseList(text);
  if (!numbers.ok()) return numbers.status();
  if (numbers->size() < 4 || numbers->size() % 2 != 0) {
    return absl::InvalidArgumentError("a stroke is at least two pixels: U1,V1,U2,V2");
  }
  std::vector<Eigen::Vector2d> stroke;
  for (std::size_t i = 0; i < numbers->size(); i += 2) {
    stroke.emplace_back((*numbers)[i], (*numbers)[i + 1]);
  }
  return stroke;
}

}  // namespace saccade::cli
