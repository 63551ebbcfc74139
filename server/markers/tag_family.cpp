#include "server/markers/tag_family.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>

#include <array>
#include <cmath>

namespace saccade {
namespace {

struct Maker {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};
constexpr std::array kMakers = {
    Maker{"apriltag36h11", tag36h11_create, tag36h11_destroy},
    Maker{"apriltag25h9", tag25h9_create, tag25h9_destroy},
    Maker{"apriltag16h5", tag16h5_create, tag16h5_destroy},
    Maker{"apriltag_standard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
};
constexpr int kMostBorder = 4;
constexpr double kMostByChance = 1.2e-4;

}  // namespace

std::vector<std::string> TagFamilyNames() {
  std::vector<std::string> names;
  for (const Maker& maker : kMakers) names.emplace_back(maker.name);
  return names;
}

absl::StatusOr<TagFamily> TagFamily::Make(const std::string& name, int border_bits) {
  if (border_bits < 1 || border_bits > kMostBorder) {
    return absl::InvalidArgumentError(
        absl::StrCat("border-bits: ", border_bits, " is not between 1 and ", kMostBorder));
  }
  for (const Maker& maker : kMakers) {
    if (name != maker.name) continue;
    Owner family(maker.create(), maker.destroy);
    const int wider = border_bits - 1;
    if (wider > 0 && family->reversed_border) {
      return absl::InvalidArgumentError(
          absl::StrCat("border-bits: ", name, " has code outside of its border; give 1"));
    }
    family->width_at_border += 2 * wider;
    family->total_width += 2 * wider;
    for (std::uint32_t k = 0; k < family->nbits; ++k) {
      family->bit_x[k] += wider;
      family->bit_y[k] += wider;
    }
    return TagFamily(name, std::move(family));
  }
  return absl::InvalidArgumentError(absl::StrCat("family: there is no '", name, "'; there are ",
                                                 absl::StrJoin(TagFamilyNames(), ", ")));
}

int TagFamily::cells() const { return family_->width_at_border; }
int TagFamily::codes() const { return static_cast<int>(family_->ncodes); }

int TagFamily::MostCorrected() const {
  const double bits = family_->nbits;
  const std::array<double, 3> patterns = {1, bits, bits * (bits - 1) / 2};
  double readable = 0;
  int corrected = 0;
  for (int wrong = 0; wrong < static_cast<int>(patterns.size()); ++wrong) {
    readable += patterns[wrong];
    const double by_chance = 4 * codes() * readable / std::pow(2.0, bits);
    if (by_chance < kMostByChance) corrected = wrong;
  }
  return corrected;
}

std::vector<TagFamily::Bit> TagFamily::Bits(int id) const {
  std::vector<Bit> bits;
  for (std::uint32_t k = 0; k < family_->nbits; ++k) {
    const bool bright = (family_->codes[id] >> (family_->nbits - 1 - k)) & 1;
    bits.push_back(
        {static_cast<int>(family_->bit_x[k]), static_cast<int>(family_->bit_y[k]), bright});
  }
  return bits;
}

}  // namespace saccade
