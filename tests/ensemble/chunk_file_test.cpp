#include "ensemble/chunk_file.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "temporary_folder.hpp"

namespace pliant::chunk_file_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::Each;
using testing::ElementsAre;
using testing::IsNan;

const RecordShape shape{2, 3, 2, 3};
const EnsembleChunk chunk{5, 3, std::string(64, 'a'), "000006-aaaaaaaa.bin"};

/// A record with numbers of its own.
MemberRecord record(float number) {
  MemberRecord r;
  r.state = MemberRecord::State::Simulated;
  r.outputs = {double(number), 0.1};
  for (std::size_t i = 0; i < shape.frame_series(); ++i) r.series.push_back(number + float(i));
  for (std::size_t i = 0; i < shape.frame_points(); ++i) r.positions.push_back(100.0F * number + float(i));
  return r;
}

class Chunks : public testing::Test {
 protected:
  fs::path part() const { return folder / (chunk.name + ".part"); }
  void write(int members) const {
    ChunkWriter writer(folder.path(), chunk, shape);
    while (writer.done() < members) writer.add(record(float(writer.done())));
    if (members == chunk.members) writer.finish();
  }
  TemporaryFolder folder;
};

TEST_F(Chunks, AreReadBack) {
  EXPECT_FALSE(is_whole(folder.path(), chunk, shape));
  write(3);
  EXPECT_TRUE(is_whole(folder.path(), chunk, shape));
  EXPECT_FALSE(fs::exists(part()));
  const ChunkReader reader(folder.path(), chunk, shape);
  const MemberRecord second = reader.record(1);
  EXPECT_EQ(second.state, MemberRecord::State::Simulated);
  EXPECT_THAT(second.outputs, ElementsAre(1.0, 0.1));
  EXPECT_THAT(second.series, ElementsAre(1, 2, 3, 4, 5, 6));
  std::vector<float> positions(6);
  reader.positions(2, 1, 1, 2, positions.data());  // frame 1, points 1 and 2
  EXPECT_THAT(positions, ElementsAre(212, 213, 214, 215, 216, 217));
}

TEST_F(Chunks, GoOnWhereTheyStood) {
  write(1);
  EXPECT_FALSE(is_whole(folder.path(), chunk, shape));
  EXPECT_EQ(ChunkWriter(folder.path(), chunk, shape).done(), 1);
  write(3);
  EXPECT_EQ(ChunkReader(folder.path(), chunk, shape).record(0).outputs[0], 0.0);
}

/// As where a machine was switched off while it wrote.
TEST_F(Chunks, ARecordThatIsNotWholeIsMadeAgain) {
  write(2);
  fs::resize_file(part(), fs::file_size(part()) - 1);
  EXPECT_EQ(ChunkWriter(folder.path(), chunk, shape).done(), 1);
  fs::resize_file(part(), fs::file_size(part()) + 1);  // zeros in the place of what was to be written
  std::string bytes = read_file(part());
  bytes[bytes.size() - 1] = '\1';
  write_file(part(), bytes);
  EXPECT_EQ(ChunkWriter(folder.path(), chunk, shape).done(), 1);
  bytes.replace(1024 + 10, 1, "x");  // the first record's reason
  write_file(part(), bytes);
  EXPECT_EQ(ChunkWriter(folder.path(), chunk, shape).done(), 0);
  write(3);
  EXPECT_TRUE(is_whole(folder.path(), chunk, shape));
}

TEST_F(Chunks, AMemberThatFailedSaysWhy) {
  {
    ChunkWriter writer(folder.path(), chunk, shape);
    writer.add(failed_record(shape, "stopped in frame 3: \"no step\""));
    std::string endless(239, 'x');
    endless.replace(237, 2, "\u00b5");  // two bytes, of which the last one is the 239th
    writer.add(failed_record(shape, endless + "and more"));
    endless.insert(0, "x");  // now it would be cut within
    writer.add(failed_record(shape, endless));
    writer.finish();
  }
  const ChunkReader reader(folder.path(), chunk, shape);
  EXPECT_EQ(reader.record(0).state, MemberRecord::State::Failed);
  EXPECT_EQ(reader.record(0).reason, "stopped in frame 3: \"no step\"");
  EXPECT_THAT(reader.record(0).outputs, Each(IsNan()));
  EXPECT_EQ(reader.record(1).reason, std::string(237, 'x') + "\u00b5");
  EXPECT_EQ(reader.record(2).reason, std::string(238, 'x'));
}

TEST_F(Chunks, AnotherChunkIsNotTaken) {
  write(3);
  EnsembleChunk other = chunk;
  other.key[0] = 'b';
  EXPECT_THROW(ChunkReader(folder.path(), other, shape), InputError);
  fs::rename(folder / chunk.name, part());
  EXPECT_EQ(ChunkWriter(folder.path(), other, shape).done(), 0);
  EXPECT_THROW(ChunkReader(folder.path(), chunk, shape), InputError) << "there is none";
}

TEST_F(Chunks, ARecordOfAnotherShapeIsRefused) {
  ChunkWriter writer(folder.path(), chunk, shape);
  MemberRecord r = record(1.0F);
  r.series.pop_back();
  EXPECT_THROW(writer.add(r), std::invalid_argument);
  EXPECT_THROW(ChunkWriter(folder / "nowhere", chunk, shape), InputError);
}

}  // namespace
}  // namespace pliant::chunk_file_test
