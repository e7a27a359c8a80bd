#include "base/old_names.hpp"

#include <cstdio>
#include <mutex>
#include <set>

namespace pliant {

namespace {

constexpr std::string_view former_ratio = "poisson_ratio", present_ratio = "poissons_ratio";

/// Whether a name is a stem, or begins with it and goes on with another word, a region or a recording.
bool is_of_stem(std::string_view name, std::string_view stem) {
  if (!name.starts_with(stem)) return false;
  return name.size() == stem.size() || std::string_view("_@[.").find(name[stem.size()]) != std::string_view::npos;
}

std::string with_stem(std::string_view name, std::string_view from, std::string_view to) {
  return std::string(to) + std::string(name.substr(from.size()));
}

}  // namespace

std::string present_name(std::string_view name) {
  return is_of_stem(name, former_ratio) ? with_stem(name, former_ratio, present_ratio) : std::string(name);
}

std::string former_name(std::string_view name) {
  return is_of_stem(name, present_ratio) ? with_stem(name, present_ratio, former_ratio) : std::string();
}

void note_former_word(const std::string& former, const std::string& present, const std::string& place) {
  static std::mutex mutex;
  static std::set<std::string> noted;
  const std::lock_guard lock(mutex);
  if (!noted.insert(former).second) return;
  const std::string where = place.empty() ? "" : place + ": ";
  std::fprintf(stderr, "note: %s\"%s\" is called \"%s\" now; the old word is still read\n", where.c_str(),
               former.c_str(), present.c_str());
}

}  // namespace pliant
