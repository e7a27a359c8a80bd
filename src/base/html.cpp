#include "base/html.hpp"

#include <map>

namespace pliant {

std::string escape_html(std::string_view text) {
  static const std::map<char, const char*> names = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
  std::string out;
  for (const char c : text)
    if (const auto name = names.find(c); name != names.end())
      out += name->second;
    else
      out += c;
  return out;
}

}  // namespace pliant
