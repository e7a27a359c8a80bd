#include <stdexcept>

#include "capture/rest_scan.hpp"

namespace pliant {

RestScan scan_sheet(const std::vector<Vector3>&, double, const std::filesystem::path&) {
  throw std::invalid_argument("not yet");
}

}  // namespace pliant
