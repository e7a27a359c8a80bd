#include "imports/ffmpeg.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "imports/recording.hpp"

namespace pliant {

namespace fs = std::filesystem;

ProgramPipe open_pipe(const std::string& command) {
  ProgramPipe pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) throw std::runtime_error("no process can be started");
  return pipe;
}

std::string output_of(const std::string& command) {
  const ProgramPipe pipe = open_pipe(command);
  std::string text;
  char buffer[4096];
  for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof buffer, pipe.get())) > 0;) text.append(buffer, n);
  return text;
}

std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

std::string ffmpeg_argument(const fs::path& file) { return shell_word(fs::absolute(file).string()); }

bool has_ffmpeg() { return !output_of("command -v ffmpeg >/dev/null && command -v ffprobe").empty(); }

void require_ffmpeg(const fs::path& file, const std::string& otherwise) {
  if (!has_ffmpeg())
    refuse(file, "the programs ffmpeg and ffprobe are not installed", "both, to take the file apart",
           "install the package ffmpeg" + otherwise);
}

nlohmann::json probed(const fs::path& file, const std::string& entries) {
  const std::string text = output_of("ffprobe -v quiet -print_format json " + entries + " " + ffmpeg_argument(file) +
                                     " 2>/dev/null </dev/null");
  nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return {};
  const auto streams = json.find("streams");
  return streams != json.end() && streams->is_array() && !streams->empty() ? json : nlohmann::json();
}

}  // namespace pliant
