#include "imports/zip_archive.hpp"

#include <zlib.h>

#include <algorithm>
#include <fstream>

#include "base/files.hpp"
#include "base/plausible_size.hpp"
#include "imports/binary_cursor.hpp"

namespace pliant {

namespace {

constexpr std::size_t largest_file = std::size_t(1) << 31;

std::string inflated(std::string& packed, std::size_t size, const std::filesystem::path& place) {
  require_plausible_size(packed.size(), size, {place}, "a file");
  std::string result(size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::runtime_error("zlib gives no stream");
  stream.next_in = reinterpret_cast<Bytef*>(packed.data()), stream.avail_in = uInt(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data()), stream.avail_out = uInt(size);
  const int code = inflate(&stream, Z_FINISH);
  const bool is_whole = code == Z_STREAM_END && stream.avail_out == 0;
  inflateEnd(&stream);
  if (!is_whole) refuse(place, "compressed data that are damaged", "a whole archive", "copy or export it again");
  return result;
}

}  // namespace

ZipArchive::ZipArchive(const std::filesystem::path& file) : file_(file) {
  if (!is_file(file)) refuse(file, "the file " + why_no_file(file), "a zip archive");
  size_ = std::size_t(std::filesystem::file_size(file));
  constexpr std::size_t end_size = 22, longest_comment = 65535;
  const std::size_t tail_size = std::min(size_, end_size + longest_comment);
  const std::string tail = bytes(size_ - tail_size, tail_size, "the end");
  const auto found = tail.rfind("PK\5\6");
  if (found == std::string::npos || tail.size() - found < end_size)
    refuse(file, "no directory of a zip archive", "a zip archive", "the file may be cut short; export it again");
  BinaryCursor end(std::string_view(tail).substr(found + 10), file, size_ - tail_size + found + 10);
  const std::size_t count = end.number<std::uint16_t>("entries"), length = end.number<std::uint32_t>("a directory");
  const std::size_t at = end.number<std::uint32_t>("a directory");
  if (at == 0xffffffffU || count == 0xffffU)
    refuse(file, "a zip archive of more than 4 GB or 65534 files", "a smaller one", "export a shorter part");
  const std::string directory = bytes(at, length, "the directory");
  BinaryCursor cursor(directory, file, at);
  for (std::size_t i = 0; i < count; ++i) {
    if (cursor.bytes(4, "an entry") != "PK\1\2") cursor.fail("an entry that is none", "a zip archive's directory");
    cursor.skip(4, "an entry");
    const auto flags = cursor.number<std::uint16_t>("flags"), method = cursor.number<std::uint16_t>("a method");
    cursor.skip(4, "a time");
    Entry entry{};
    entry.method = (flags & 1) != 0 ? -1 : int(method);
    entry.crc = cursor.number<std::uint32_t>("a check sum");
    entry.packed = cursor.number<std::uint32_t>("a size"), entry.size = cursor.number<std::uint32_t>("a size");
    const std::size_t name = cursor.number<std::uint16_t>("a name"), extra = cursor.number<std::uint16_t>("extra data");
    const std::size_t comment = cursor.number<std::uint16_t>("a comment");
    cursor.skip(8, "attributes");
    entry.at = cursor.number<std::uint32_t>("a place");
    entries_[std::string(cursor.bytes(name, "a name"))] = entry;
    cursor.skip(extra + comment, "extra data");
  }
}

std::string ZipArchive::bytes(std::size_t at, std::size_t count, const char* what) const {
  if (count > size_ || at > size_ - count)
    refuse(file_, std::string(what) + " at byte " + std::to_string(at) + " goes beyond the end", "a whole zip archive",
           "the file was cut short; copy or export it again");
  std::ifstream in(file_, std::ios::binary);
  std::string result(count, '\0');
  in.seekg(std::streamoff(at));
  if (!in.read(result.data(), std::streamsize(count))) refuse(file_, "a part that cannot be read", "a whole file");
  return result;
}

std::string ZipArchive::read(const std::string& name) const {
  const std::filesystem::path place = file_.string() + " (" + name + ")";
  const auto found = entries_.find(name);
  if (found == entries_.end()) refuse(file_, "no file " + name + " in it", "a whole recording", "export it again");
  const Entry& entry = found->second;
  if (entry.size > largest_file) refuse(place, "a file of more than 2 GB", "a smaller one");
  constexpr std::size_t local_header = 30;
  const std::string head = bytes(entry.at, local_header, "a file");
  BinaryCursor cursor(head, file_, entry.at);
  if (cursor.bytes(4, "a file") != "PK\3\4") cursor.fail("a file that is none", "a zip archive");
  cursor.skip(22, "a file");
  const std::size_t lengths =
      std::size_t(cursor.number<std::uint16_t>("a name")) + cursor.number<std::uint16_t>("extra");
  std::string packed = bytes(entry.at + local_header + lengths, entry.packed, "a file");
  if (entry.method != 0 && entry.method != 8)
    refuse(place, "a file that is encrypted or packed by another method", "stored or deflated files",
           "make the archive anew");
  std::string content = entry.method == 8 ? inflated(packed, entry.size, place) : std::move(packed);
  const uLong crc = crc32(0, reinterpret_cast<const Bytef*>(content.data()), uInt(content.size()));
  if (content.size() != entry.size || crc != entry.crc)
    refuse(place, "a content that does not fit its check sum", "a whole archive", "copy or export it again");
  return content;
}

}  // namespace pliant
