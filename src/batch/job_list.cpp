#include "batch/job_list.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/sha256.hpp"
#include "estimation/fit_config.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using JobEnd = BatchStatus::State;

constexpr int key_digits_of_name = 8;
constexpr std::array<JobEnd, 4> states = {JobEnd::Converged, JobEnd::NotConverged, JobEnd::Failed, JobEnd::TimedOut};

bool is_pattern(const std::string& text) { return text.find_first_of("*?[") != std::string::npos; }

/// Paths that a pattern names, part by part.
std::vector<fs::path> matches(const fs::path& pattern) {
  std::vector<fs::path> found = {pattern.is_absolute() ? pattern.root_path() : fs::path()};
  for (const fs::path& part : pattern.relative_path()) {
    std::vector<fs::path> next;
    for (const fs::path& folder : found) {
      if (!is_pattern(part.string())) {
        if (fs::exists(folder / part)) next.push_back(folder / part);
        continue;
      }
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error))
        if (::fnmatch(part.c_str(), entry.path().filename().c_str(), FNM_PERIOD) == 0)
          next.push_back(folder / entry.path().filename());
    }
    found = std::move(next);
  }
  return found;
}

/// What was recorded, as far as it can be told without reading all of it.
std::string fingerprint(const fs::path& capture) {
  std::vector<std::string> lines;
  std::error_code error, of_this;
  auto entry = fs::recursive_directory_iterator(capture, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error))
    if (entry->is_regular_file(of_this))
      lines.push_back(entry->path().lexically_relative(capture).generic_string() + " " +
                      std::to_string(entry->file_size(of_this)) + "\n");
  std::ranges::sort(lines);
  std::string text = is_file(capture / "capture.toml") ? read_file(capture / "capture.toml") : "";
  for (const std::string& line : lines) text += line;
  return text;
}

/// A name that any file system takes.
std::string plain(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
  return name;
}

fs::path status_file(const fs::path& batch, const BatchJob& job) { return batch / job.name / "job.json"; }

}  // namespace

const char* name_of(JobEnd state) {
  switch (state) {
    case JobEnd::Converged:
      return "converged";
    case JobEnd::NotConverged:
      return "not converged";
    case JobEnd::TimedOut:
      return "timed out";
    case JobEnd::Failed:
      break;
  }
  return "failed";
}

std::vector<fs::path> captures_of(const std::vector<std::string>& patterns) {
  std::vector<fs::path> captures;
  for (const std::string& pattern : patterns) {
    std::vector<fs::path> found;
    for (const fs::path& path : matches(fs::path(pattern).lexically_normal())) {
      const fs::path folder = path.filename() == "capture.toml" ? path.parent_path() : path;
      if (is_file(folder / "capture.toml")) found.push_back((folder / "").lexically_normal().parent_path());
    }
    if (found.empty())
      throw InputError({{pattern},
                        "no recording is there",
                        "folders with a capture.toml in them, such as 'recordings/*' in quotes",
                        "`pliant new FOLDER` writes a capture.toml"});
    captures.insert(captures.end(), found.begin(), found.end());
  }
  std::ranges::sort(captures);
  captures.erase(std::unique(captures.begin(), captures.end()), captures.end());
  return captures;
}

std::vector<BatchJob> batch_jobs(const std::vector<fs::path>& captures, const FitOptions& options,
                                 const std::string& program) {
  std::vector<BatchJob> jobs;
  const std::string choices = to_toml(options);
  for (const fs::path& capture : captures) {
    BatchJob job;
    job.capture = capture;
    job.key = sha256({fingerprint(capture), choices, program});
    job.name = plain(capture.filename().string()) + "-" + job.key.substr(0, key_digits_of_name);
    jobs.push_back(std::move(job));
  }
  std::ranges::sort(jobs, {}, [](const BatchJob& job) { return std::tie(job.key, job.capture); });
  const auto is_same = [](const BatchJob& a, const BatchJob& b) { return a.key == b.key; };
  jobs.erase(std::unique(jobs.begin(), jobs.end(), is_same), jobs.end());  // copies of one recording are one job
  return jobs;
}

std::optional<BatchStatus> read_status(const fs::path& batch, const BatchJob& job) {
  const fs::path file = status_file(batch, job);
  if (!is_file(file)) return std::nullopt;
  const Json json = Json::parse(read_file(file), nullptr, false);
  if (!json.is_object() || json.value("format", "") != "batch-job/1" || json.value("key", "") != job.key)
    return std::nullopt;
  for (const JobEnd state : states)
    if (json.value("state", "") == name_of(state)) return BatchStatus{job.key, state, json.value("reason", "")};
  return std::nullopt;
}

void write_status(const fs::path& batch, const BatchJob& job, const BatchStatus& status) {
  make_folder(batch / job.name);
  const Json json = {{"format", "batch-job/1"},
                     {"key", status.key},
                     {"capture", job.capture.generic_string()},
                     {"state", name_of(status.state)},
                     {"reason", status.reason}};
  write_file(status_file(batch, job), json.dump(2) + "\n");
}

}  // namespace pliant
