// ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of a header of named fields and data. Chunks hold
// connections and messages, compressed or not. The index is not needed: records are read one after the other.
#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>

#include "base/files.hpp"
#include "base/plausible_size.hpp"
#include "imports/binary_cursor.hpp"
#include "imports/formats.hpp"
#include "imports/ros_messages.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view bag_magic = "#ROSBAG V2.0\n";
constexpr std::size_t largest_chunk = std::size_t(1) << 31;

enum BagOp : std::uint8_t { MessageData = 2, BagHeader = 3, IndexData = 4, Chunk = 5, ChunkInfo = 6, Connection = 7 };

// Fields of a record's header: "name=value" with a length before each.
class BagFields {
 public:
  BagFields(std::string_view header, const fs::path& file, std::size_t from) : cursor_(header, file, from) {
    while (!cursor_.at_end()) {
      const std::string_view field = cursor_.bytes(cursor_.number<std::uint32_t>("a field"), "a field");
      const auto equals = field.find('=');
      if (equals == std::string_view::npos) cursor_.fail("a field without a name", "name=value", "the bag is damaged");
      fields_[std::string(field.substr(0, equals))] = field.substr(equals + 1);
    }
  }
  std::string_view text(const std::string& name) const {
    const auto it = fields_.find(name);
    if (it == fields_.end()) cursor_.fail("a record without `" + name + "`", "it", "the bag is damaged");
    return it->second;
  }
  template <class Number>
  Number number(const std::string& name) const {
    BinaryCursor value(text(name), cursor_.file());
    return value.number<Number>(name.c_str());
  }

 private:
  BinaryCursor cursor_;
  std::map<std::string, std::string_view> fields_;
};

std::string uncompressed_bz2(std::string_view data, std::size_t size, const fs::path& file) {
  std::string result(size, '\0');
  auto length = static_cast<unsigned int>(size);
  const int error = BZ2_bzBuffToBuffDecompress(result.data(), &length, const_cast<char*>(data.data()),
                                               static_cast<unsigned int>(data.size()), 0, 0);
  if (error != BZ_OK || length != size) refuse(file, "a bz2 chunk that cannot be decompressed", "a whole bag");
  return result;
}

std::string uncompressed_lz4(std::string_view data, std::size_t size, const fs::path& file) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)))
    throw std::runtime_error("lz4 gives no context");
  const std::unique_ptr<LZ4F_dctx, void (*)(LZ4F_dctx*)> owner(context,
                                                               [](LZ4F_dctx* c) { LZ4F_freeDecompressionContext(c); });
  std::string result(size, '\0');
  std::size_t in = 0, out = 0;
  while (in < data.size()) {
    std::size_t taken = data.size() - in, made = size - out;
    const std::size_t hint = LZ4F_decompress(context, result.data() + out, &made, data.data() + in, &taken, nullptr);
    if (LZ4F_isError(hint)) refuse(file, "an lz4 chunk that cannot be decompressed", "a whole bag");
    in += taken, out += made;
    if (hint == 0 || (taken == 0 && made == 0)) break;
  }
  if (out != size) refuse(file, "an lz4 chunk that is shorter than it says", "a whole bag");
  return result;
}

// The file; chunks are decompressed when they are needed, and the last one is kept.
class Ros1File {
 public:
  explicit Ros1File(const fs::path& path) : path_(path), in_(path, std::ios::binary) {
    if (!in_) refuse(path, "the file " + why_no_file(path), "a ROS bag");
    size_ = std::size_t(fs::file_size(path));
  }
  const fs::path& path() const { return path_; }
  std::size_t size() const { return size_; }

  std::string bytes(std::size_t at, std::size_t count, const char* what) {
    if (count > size_ || at > size_ - count)
      refuse(path_, std::string(what) + " at byte " + std::to_string(at) + " goes beyond the end", "a whole file",
             "the file was cut short; copy it again, or mend it with `rosbag reindex`");
    std::string result(count, '\0');
    in_.clear();
    in_.seekg(std::streamoff(at));
    if (!in_.read(result.data(), std::streamsize(count))) refuse(path_, "a part that cannot be read", "a whole file");
    return result;
  }

  struct Record {
    std::string header;
    std::size_t data_at = 0, data_size = 0, end = 0;
  };
  Record record(std::size_t at) {
    Record result;
    const std::string length = bytes(at, 4, "a record");
    const auto header_size = BinaryCursor(length, path_).number<std::uint32_t>("a length");
    result.header = bytes(at + 4, header_size, "a record's header");
    const std::string data_length = bytes(at + 4 + header_size, 4, "a record's data");
    result.data_size = BinaryCursor(data_length, path_).number<std::uint32_t>("a length");
    result.data_at = at + 8 + header_size;
    result.end = result.data_at + result.data_size;
    if (result.end > size_) (void)bytes(result.data_at, result.data_size, "a record's data");
    return result;
  }

  /// What a chunk holds; `at` is where its record begins.
  const std::string& chunk(std::size_t at) {
    if (at == chunk_at_ && has_chunk_) return chunk_;
    const Record found = record(at);
    const BagFields fields(found.header, path_, at + 4);
    const std::size_t size = fields.number<std::uint32_t>("size");
    const std::string kind(fields.text("compression"));
    if (size > largest_chunk) refuse(path_, "a chunk of " + std::to_string(size) + " bytes", "less than 2 GB");
    require_plausible_size(found.data_size, size, {path_}, "a chunk");
    std::string data = bytes(found.data_at, found.data_size, "a chunk");
    has_chunk_ = false;
    if (kind == "none")
      chunk_ = std::move(data);
    else if (kind == "bz2")
      chunk_ = uncompressed_bz2(data, size, path_);
    else if (kind == "lz4")
      chunk_ = uncompressed_lz4(data, size, path_);
    else
      refuse(path_, "chunks compressed by \"" + kind + "\"", "none, bz2 or lz4",
             "decompress it with `rosbag decompress`");
    chunk_at_ = at, has_chunk_ = true;
    return chunk_;
  }

  std::mutex mutex;

 private:
  fs::path path_;
  std::ifstream in_;
  std::size_t size_ = 0, chunk_at_ = 0;
  bool has_chunk_ = false;
  std::string chunk_;
};

struct BagMessage {
  double time;
  std::size_t chunk, at, size;  // the data lie in the chunk from `at`
};

struct BagConnection {
  std::string topic, type;
  std::vector<BagMessage> messages;
};

BagConnection bag_connection(const BagFields& fields, std::string_view data, const fs::path& file) {
  const BagFields inner(data, file, 0);
  return {std::string(fields.text("topic")), std::string(inner.text("type")), {}};
}

// Connections and messages of a chunk.
void read_bag_chunk(const std::string& content, std::size_t at, const fs::path& file,
                    std::map<std::uint32_t, BagConnection>& connections) {
  BinaryCursor cursor(content, file);
  while (!cursor.at_end()) {
    const BagFields fields(cursor.bytes(cursor.number<std::uint32_t>("a header"), "a header"), file, 0);
    const auto size = cursor.number<std::uint32_t>("data");
    const std::size_t begin = cursor.position();
    const std::string_view data = cursor.bytes(size, "data of a record in a chunk");
    const auto op = fields.number<std::uint8_t>("op");
    if (op == Connection)
      connections.try_emplace(fields.number<std::uint32_t>("conn"), bag_connection(fields, data, file));
    if (op != MessageData) continue;
    const std::string_view time = fields.text("time");
    BinaryCursor stamp(time, file);
    const auto seconds = stamp.number<std::uint32_t>("a time"), nanoseconds = stamp.number<std::uint32_t>("a time");
    const auto found = connections.find(fields.number<std::uint32_t>("conn"));
    if (found == connections.end()) refuse(file, "a message of no connection", "a whole bag");
    found->second.messages.push_back({double(seconds) + 1e-9 * double(nanoseconds), at, begin, size});
  }
}

}  // namespace

RosBag open_ros1_bag(const fs::path& file) {
  const auto source = std::make_shared<Ros1File>(file);
  if (source->size() < bag_magic.size() || source->bytes(0, bag_magic.size(), "the first line") != bag_magic)
    refuse(file, "no ROS bag of format 2.0", "\"#ROSBAG V2.0\" in the first line",
           "older bags: `rosbag fix`; bags of ROS 2 are .db3 files or their folders");
  std::map<std::uint32_t, BagConnection> connections;
  for (std::size_t at = bag_magic.size(); at < source->size();) {
    const Ros1File::Record record = source->record(at);
    const BagFields fields(record.header, file, at + 4);
    const auto op = fields.number<std::uint8_t>("op");
    if (op == Chunk) read_bag_chunk(source->chunk(at), at, file, connections);
    if (op == Connection) {
      const std::string data = source->bytes(record.data_at, record.data_size, "a connection");
      connections.try_emplace(fields.number<std::uint32_t>("conn"), bag_connection(fields, data, file));
    }
    at = record.end;
  }
  RosBag bag{file, RosLayout::Ros1, {}};
  std::map<std::string, BagConnection> by_topic;  // a topic may have several connections
  for (auto& [id, connection] : connections) {
    BagConnection& whole = by_topic[connection.topic];
    whole.type = connection.type;
    whole.messages.insert(whole.messages.end(), connection.messages.begin(), connection.messages.end());
  }
  for (auto& [name, connection] : by_topic) {
    RosTopic topic{name, connection.type, {}, {}};
    std::ranges::stable_sort(connection.messages, {}, &BagMessage::time);
    for (const BagMessage& message : connection.messages) topic.times.push_back(message.time);
    topic.read = [source, messages = connection.messages](int i) {
      const BagMessage& message = messages[std::size_t(i)];
      const std::lock_guard lock(source->mutex);
      return source->chunk(message.chunk).substr(message.at, message.size);
    };
    bag.topics.push_back(std::move(topic));
  }
  return bag;
}

bool is_ros1_bag(const fs::path& source) {
  if (!is_file(source)) return false;
  std::ifstream in(source, std::ios::binary);
  std::string begin(8, '\0');
  in.read(begin.data(), 8);
  return begin == bag_magic.substr(0, 8) || source.extension() == ".bag";
}

ImportedRecording read_ros1_bag(const fs::path& source, const ImportOptions& options) {
  return recording_of_bag(open_ros1_bag(source), options);
}

}  // namespace pliant
