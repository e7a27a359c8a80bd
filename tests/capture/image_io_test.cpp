#include "capture/image_io.hpp"

#include <random>

#include "base/files.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::image_io_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;

Image<std::uint16_t> noise_image(int width, int height) {
  Image<std::uint16_t> image(width, height);
  std::mt19937 random(7);
  for (auto& pixel : image.pixels) pixel = std::uint16_t(random());
  return image;
}

TEST(ImageRoundTrip, KeepsSixteenBits) {
  const TemporaryFolder folder;
  const auto image = noise_image(37, 11);
  write_png(folder / "a.png", image);
  const auto back = read_depth_image(folder / "a.png");
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.height, 11);
  EXPECT_EQ(back.pixels, image.pixels);
}

TEST(ReadDepthImage, ReadsBigEndianPgmWithComments) {
  const TemporaryFolder folder;
  folder.write("a.pgm", std::string("P5\n# depth\n2 1\n65535\n") + std::string("\x01\x02\xff\x00", 4));
  const auto image = read_depth_image(folder / "a.pgm");
  EXPECT_EQ(image(0, 0), 0x0102);
  EXPECT_EQ(image(1, 0), 0xff00);
}

TEST(ReadDepthImage, ReadsGreysOfWhichOneIsNamedAsTransparent) {
  const TemporaryFolder folder;
  const auto image = noise_image(37, 11);
  write_png(folder / "a.png", image);
  std::string png = read_file(folder / "a.png");
  png.insert(33, std::string("\0\0\0\x02tRNS\0\x07\xe8\xf7\x58\x9b", 14));  // behind the header
  folder.write("a.png", png);
  EXPECT_EQ(read_depth_image(folder / "a.png").pixels, image.pixels);
}

TEST(ReadDepthImage, RefusesEightBits) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", Image<std::uint8_t>(4, 4, 9));
  EXPECT_THAT(complaint_of([&] { (void)read_depth_image(folder / "a.png"); }), HasSubstr("expected 16-bit grey"));
}

TEST(ReadDepthImage, RefusesEveryTruncation) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", noise_image(9, 5));
  folder.write("a.pgm", std::string("P5 2 2 65535\n") + std::string(8, 'x'));
  for (const char* name : {"a.png", "a.pgm"}) {
    const std::string whole = read_file(folder / name);
    (void)read_depth_image(folder / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      write_file(folder / name, std::string_view(whole).substr(0, length));
      EXPECT_THROW((void)read_depth_image(folder / name), InputError) << name << " cut to " << length;
    }
  }
}

TEST(ReadDepthImage, RefusesASizeThatTheFileCannotHold) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", noise_image(9, 5));
  std::string content = read_file(folder / "a.png");
  for (const std::size_t side : {16, 20}) content[side + 2] = 0x7f;  // 32512 pixels and more
  folder.write("a.png", content);
  EXPECT_THAT(complaint_of([&] { (void)read_depth_image(folder / "a.png"); }), HasSubstr("an image of 211"));
}

TEST(ReadDepthImage, RefusesWhatIsNoImage) {
  const TemporaryFolder folder;
  folder.write("a.png", "GIF89a");
  EXPECT_THAT(complaint_of([&] { (void)read_depth_image(folder / "a.png"); }), HasSubstr("neither a PNG nor a PGM"));
  EXPECT_THROW((void)read_image_header(folder / "none.png"), InputError);
  EXPECT_THROW((void)read_image_header(folder.path()), InputError);
}

TEST(ReadMask, TakesGreyAndColour) {
  const TemporaryFolder folder;
  Image<std::uint8_t> grey(2, 1);
  grey(1, 0) = 3;
  write_png(folder / "grey.png", grey);
  Image<Rgb> colour(2, 1, Rgb{0, 0, 0});
  colour(1, 0) = {0, 9, 0};
  write_png(folder / "colour.png", colour);
  for (const char* name : {"grey.png", "colour.png"}) {
    const auto mask = read_mask(folder / name);
    EXPECT_EQ(mask(0, 0), 0) << name;
    EXPECT_EQ(mask(1, 0), 255) << name;
  }
}

std::string bytes_of(std::string_view hexadecimal) {
  std::string bytes;
  for (std::size_t i = 0; i < hexadecimal.size(); i += 2)
    bytes += char(std::stoi(std::string(hexadecimal.substr(i, 2)), nullptr, 16));
  return bytes;
}

/// PNG files of two pixels with red, green, blue and alpha, the second one of the object.
TEST(ReadMask, TakesAlphaOnlyWhereItDiffers) {
  const TemporaryFolder folder;
  folder.write(
      "opaque.png",
      bytes_of("89504e470d0a1a0a0000000d4948445200000002000000010806000000f4227f8a0000001149444154789c63606060f8"
               "cfc0c9f01f00061e0208e98d74a90000000049454e44ae426082"));
  folder.write(
      "cut_out.png",
      bytes_of("89504e470d0a1a0a0000000d4948445200000002000000010806000000f4227f8a0000000f49444154789c63e0e4e464"
               "0082ff0001c5011b2c22e2aa0000000049454e44ae426082"));
  for (const char* name : {"opaque.png", "cut_out.png"}) {
    const auto mask = read_mask(folder / name);
    EXPECT_EQ(mask(0, 0), 0) << name;
    EXPECT_EQ(mask(1, 0), 255) << name;
  }
}

TEST(ReadMask, RefusesSixteenBits) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", noise_image(3, 3));
  EXPECT_THAT(complaint_of([&] { (void)read_mask(folder / "a.png"); }), HasSubstr("8 bits a channel"));
}

TEST(ReadImageHeader, TellsSizeAndKind) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", Image<Rgb>(5, 3));
  const ImageHeader header = read_image_header(folder / "a.png");
  EXPECT_EQ(header.width, 5);
  EXPECT_EQ(header.height, 3);
  EXPECT_EQ(header.bits, 8);
  EXPECT_EQ(header.channels, 3);
}

}  // namespace
}  // namespace pliant::image_io_test
