#include "server/pipeline/commands.hpp"

namespace saccade {

void Fail(const Command& command, const absl::Status& status) {
  std::visit([&status](const auto& one) { one.done(status); }, command);
}

}  // namespace saccade
