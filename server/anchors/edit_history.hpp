#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/anchors/anchor_record.hpp"

namespace saccade {

/// One edit by one session: null before: created, null after: deleted.
struct EditStep {
  std::string id;
  RecordPtr before;
  RecordPtr after;
  std::string description;  // in words, of doing it
};

/// What one session did and took back, oldest first.
struct EditHistory {
  std::vector<EditStep> done;
  std::vector<EditStep> undone;
};

/// A change that is not on disk yet, with what it takes to revoke it.
struct PendingEdit {
  std::uint64_t sequence = 0;
  std::string id;
  RecordPtr before;  // null: did not exist
  std::string session_id;
  EditHistory history_before;
};

}  // namespace saccade
