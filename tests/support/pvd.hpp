#pragma once

#include <filesystem>
#include <pugixml.hpp>
#include <vector>

#include "model/vtu.hpp"

namespace pliant::test {

/// The times and files of a `.pvd`, by an XML reader alone; none of a file that is no collection.
inline std::vector<PvdEntry> read_pvd(const std::filesystem::path& path) {
  pugi::xml_document document;
  document.load_file(path.c_str());
  std::vector<PvdEntry> entries;
  for (const pugi::xml_node node : document.select_node("/VTKFile[@type='Collection']/Collection").node().children())
    entries.push_back({node.attribute("timestep").as_double(), node.attribute("file").value()});
  return entries;
}

}  // namespace pliant::test
