#pragma once

namespace saccade {

/// For people: "0.1.0 (76d4111a2)", the project's version and the commit it was built from;
/// "+dirty" behind the commit where files differed from it, "commit unknown" where neither Git nor
/// an archive made by it says.
const char* Version();

}  // namespace saccade
