#pragma once

#include <string>
#include <string_view>

namespace pliant {

/// Present name of what files and commands called otherwise before: "poisson_ratio@foam" gives "poissons_ratio@foam".
/// A name that has not changed comes back as it is.
[[nodiscard]] std::string present_name(std::string_view name);

/// Former name of what is called otherwise now; empty where it was always called so.
[[nodiscard]] std::string former_name(std::string_view name);

/// Tells the user, once for each word and run, that a former word was read and what it is now: a line on stderr.
/// @param place  where it stands, like "model.toml"; may be empty
void note_former_word(const std::string& former, const std::string& present, const std::string& place);

}  // namespace pliant
