#pragma once

#include <string>
#include <string_view>

namespace pliant {

/// Text with &, <, > and quotes replaced for HTML and SVG.
std::string escape_html(std::string_view text);

}  // namespace pliant
