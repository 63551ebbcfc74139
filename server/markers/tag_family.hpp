#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <memory>
#include <string>
#include <vector>

struct apriltag_family;

namespace saccade {

/// A family of libapriltag's, whose border may be wider than its makers meant.
class TagFamily {
 public:
  /// "apriltag36h11", "apriltag25h9", "apriltag16h5", and the later ones that libapriltag has.
  ///   InvalidArgument  no such family, or a border below one or above four cells; says which
  static absl::StatusOr<TagFamily> Make(const std::string& name, int border_bits);

  const std::string& name() const { return name_; }
  apriltag_family* get() const { return family_.get(); }

  /// The number of cells along the black border's outside.
  int cells() const;
  int codes() const;
  /// Wrong bits, at most two, that may be corrected so that of ten thousand squares with noise in
  /// them hardly one is taken for a tag.
  int MostCorrected() const;
  /// Where the bits of its code are: cells from the border's outer top left corner, and what they
  /// are for `id`.
  struct Bit {
    int column, row;
    bool bright;
  };
  std::vector<Bit> Bits(int id) const;

 private:
  using Owner = std::shared_ptr<apriltag_family>;
  TagFamily(std::string name, Owner family) : name_(std::move(name)), family_(std::move(family)) {}

  std::string name_;
  Owner family_;
};

/// Names that TagFamily::Make knows.
std::vector<std::string> TagFamilyNames();

}  // namespace saccade
