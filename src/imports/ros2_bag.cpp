// ROS 2 bags (rosbag2) in SQLite: a table `topics` with names and types, and a table `messages` with times [ns] and
// CDR bytes.
#include <sqlite3.h>

#include <algorithm>
#include <memory>
#include <mutex>

#include "base/files.hpp"
#include "imports/formats.hpp"
#include "imports/ros_messages.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

class Database {
 public:
  explicit Database(const fs::path& file) : file_(file) {
    if (sqlite3_open_v2(file.c_str(), &database_, SQLITE_OPEN_READONLY, nullptr) != SQLITE_OK) {
      const std::string why = database_ ? sqlite3_errmsg(database_) : "no memory";
      sqlite3_close(database_);
      refuse(file, "no SQLite file: " + why, "a .db3 file of rosbag2");
    }
  }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;
  Statement prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_, sql, -1, &statement, nullptr) != SQLITE_OK) fail();
    return {statement, sqlite3_finalize};
  }
  bool step(const Statement& statement) {
    const int code = sqlite3_step(statement.get());
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail();
    return code == SQLITE_ROW;
  }
  [[noreturn]] void fail() {
    refuse(file_, std::string("no bag of ROS 2: SQLite says \"") + sqlite3_errmsg(database_) + "\"",
           "tables `topics` and `messages`", "the file may be cut short; copy it again");
  }
  std::mutex mutex;

 private:
  fs::path file_;
  sqlite3* database_ = nullptr;
};

std::string column_text(const Database::Statement& statement, int column) {
  const unsigned char* text = sqlite3_column_text(statement.get(), column);
  return text ? reinterpret_cast<const char*>(text) : "";
}

std::string without_msg(std::string type) {
  if (const auto at = type.find("/msg/"); at != std::string::npos) type.replace(at, 5, "/");
  return type;
}

std::vector<fs::path> files_ending(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().string().ends_with(ending)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

// The one database of a folder.
fs::path database_file(const fs::path& source) {
  if (!is_folder(source)) return source;
  const std::vector<fs::path> files = files_ending(source, ".db3");
  if (files.size() == 1) return files.front();
  if (files.size() > 1)
    refuse(source, "a bag of " + std::to_string(files.size()) + " files", "one .db3 file",
           "name one of them, or join them with `ros2 bag convert`");
  if (!files_ending(source, ".db3.zstd").empty())
    refuse(source, "a compressed bag", "a .db3 file", "decompress it with `zstd -d FILE.db3.zstd`");
  if (!files_ending(source, ".mcap").empty())
    refuse(source, "a bag in MCAP", "a .db3 file", "convert it with `ros2 bag convert` to the storage sqlite3");
  refuse(source, "a folder without a .db3 file", "a bag of ROS 2");
}

}  // namespace

RosBag open_ros2_bag(const fs::path& source) {
  const fs::path file = database_file(source);
  const auto database = std::make_shared<Database>(file);
  RosBag bag{file, RosLayout::Cdr, {}};
  const auto topics = database->prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  while (database->step(topics)) {
    RosTopic topic{column_text(topics, 1), without_msg(column_text(topics, 2)), {}, {}};
    const sqlite3_int64 id = sqlite3_column_int64(topics.get(), 0);
    const bool is_cdr = column_text(topics, 3) == "cdr";
    std::vector<sqlite3_int64> rows;
    const auto messages =
        database->prepare("SELECT id, timestamp FROM messages WHERE topic_id = ? ORDER BY timestamp, id");
    sqlite3_bind_int64(messages.get(), 1, id);
    while (is_cdr && database->step(messages)) {
      rows.push_back(sqlite3_column_int64(messages.get(), 0));
      topic.times.push_back(1e-9 * double(sqlite3_column_int64(messages.get(), 1)));
    }
    topic.read = [database, rows, file](int i) {
      const std::lock_guard lock(database->mutex);
      const auto message = database->prepare("SELECT data FROM messages WHERE id = ?");
      sqlite3_bind_int64(message.get(), 1, rows[std::size_t(i)]);
      if (!database->step(message)) database->fail();
      const auto* data = static_cast<const char*>(sqlite3_column_blob(message.get(), 0));
      const auto size = std::size_t(sqlite3_column_bytes(message.get(), 0));
      return data ? std::string(data, size) : std::string();
    };
    bag.topics.push_back(std::move(topic));
  }
  return bag;
}

bool is_ros2_bag(const fs::path& source) {
  if (is_folder(source)) return is_file(source / "metadata.yaml") || files_ending(source, ".db3").size() == 1;
  return source.extension() == ".db3";
}

ImportedRecording read_ros2_bag(const fs::path& source, const ImportOptions& options) {
  return recording_of_bag(open_ros2_bag(source), options);
}

}  // namespace pliant
