#include "capture/folder_survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/error.hpp"
#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

/// A file's path around the last number of its name.
struct NumberedName {
  std::string before, after;
  int digits = 0;  // with zeros in front; 0: no file has any
  bool operator<(const NumberedName& other) const {
    return std::tie(before, after) < std::tie(other.before, other.after);
  }
};

struct NumberedFile {
  NumberedName name;
  int number = 0;
};

std::optional<NumberedFile> numbered(const fs::path& relative) {
  const std::string stem = relative.stem().string();
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  auto end = std::find_if(stem.rbegin(), stem.rend(), is_digit).base();
  auto begin = std::find_if_not(std::make_reverse_iterator(end), stem.rend(), is_digit).base();
  if (begin == end || end - begin > 9) return std::nullopt;
  const std::string folder = relative.parent_path().empty() ? "" : relative.parent_path().generic_string() + "/";
  NumberedFile file;
  file.name = {folder + std::string(stem.begin(), begin), std::string(end, stem.end()) + relative.extension().string(),
               int(end - begin)};
  file.number = std::stoi(std::string(begin, end));
  return file;
}

/// Widths of their numbers and the numbers of one kind of name.
struct Group {
  std::set<int> digits, numbers;
};

NumberedFiles files_of(const NumberedName& name, const Group& group) {
  NumberedFiles files;
  // Of one width, numbers have zeros in front; of several, none.
  const int width = *group.digits.begin();
  const bool is_padded = group.digits.size() == 1 && width > 1;
  files.pattern = name.before + (is_padded ? fmt::format("%0{}d", width) : "%d") + name.after;
  files.numbers.assign(group.numbers.begin(), group.numbers.end());
  return files;
}

fs::path first_of(const NumberedFiles& files) {
  std::string text = files.pattern;
  const auto at = text.find('%'), end = text.find('d', at);
  const std::string width = text.substr(at + 1, end - at - 1);
  const std::string number =
      width.empty() ? std::to_string(files.first()) : fmt::format("{:0{}}", files.first(), std::stoi(width));
  return text.replace(at, end - at + 1, number);
}

bool has_triangles(const fs::path& path) {
  try {
    return !read_mesh(path).triangles.empty();
  } catch (const std::exception&) {
    return false;
  }
}

void take_surface(const fs::path& folder, const fs::path& relative, FolderSurvey& survey) {
  try {
    const TriangleMesh mesh = read_surface(folder / relative);
    if (mesh.triangles.empty()) return;
    (examine(mesh).is_closed_solid ? survey.surfaces : survey.open_surfaces).push_back(relative);
  } catch (const std::exception&) {
    // it is no mesh: what it is does not matter here
  }
}

}  // namespace

FolderSurvey survey_folder(const fs::path& folder, bool with_surfaces) {
  if (!is_folder(folder))
    throw InputError({{folder}, "it " + why_no_file(folder), "a folder with what was recorded", ""});
  std::map<NumberedName, Group> images, meshes;
  std::vector<fs::path> single;
  std::error_code error;  // links that lead nowhere, and folders that may not be read, are passed over
  auto entry = fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (entry.depth() >= 2) entry.disable_recursion_pending();
    std::error_code of_this;
    if (!entry->is_regular_file(of_this)) continue;
    const fs::path relative = entry->path().lexically_relative(folder);
    const std::string kind = ending_of(relative);
    const bool is_image = kind == ".png" || kind == ".pgm", is_cloud = kind == ".ply" || kind == ".pcd";
    const auto file = numbered(relative);
    if (file && (is_image || is_cloud)) {
      Group& group = (is_image ? images : meshes)[file->name];
      group.digits.insert(file->name.digits);
      group.numbers.insert(file->number);
    }
    if (is_cloud || kind == ".obj" || kind == ".stl") single.push_back(relative);
  }
  FolderSurvey survey;
  for (const auto& [name, group] : images) {
    NumberedFiles files = files_of(name, group);
    try {
      files.header = read_image_header(folder / first_of(files));
    } catch (const InputError&) {
      continue;
    }
    (files.header.bits == 16 && files.header.channels == 1 ? survey.depth : survey.pictures).push_back(files);
  }
  std::set<fs::path> in_clouds;
  for (const auto& [name, group] : meshes) {
    const NumberedFiles files = files_of(name, group);
    if (files.count() < 2 || has_triangles(folder / first_of(files))) continue;
    survey.clouds.push_back(files);
    for (const fs::path& path : single)
      if (const auto file = numbered(path); file && !(file->name < name) && !(name < file->name))
        in_clouds.insert(path);
  }
  std::ranges::sort(single);
  for (const fs::path& path : single)
    if (with_surfaces && !in_clouds.contains(path)) take_surface(folder, path, survey);
  const auto most_first = [](const NumberedFiles& a, const NumberedFiles& b) { return a.count() > b.count(); };
  std::ranges::stable_sort(survey.depth, most_first);
  std::ranges::stable_sort(survey.clouds, most_first);
  return survey;
}

}  // namespace pliant
