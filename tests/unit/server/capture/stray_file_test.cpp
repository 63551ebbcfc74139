// What stands where a picture, a list or a camera file should: named, with line and remedy.
#include "server/capture/stray_file.hpp"

#include <gmock/gmock.h>

#include "server/capture/camera_file.hpp"
#include "server/capture/dataset.hpp"
#include "server/capture/image_file.hpp"
#include "server/capture/image_list.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::stray_file_test {
namespace {

using std::string_literals::operator""s;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kLfs =
    "version https://git-lfs.github.com/spec/v1\n"
    "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n";

class StrayFile : public DatasetFixture {
 protected:
  std::string PictureError(const std::string& bytes) const {
    Write("rgb/0.png", bytes + std::string(64, 'x'));
    return std::string(LoadPicture(folder_ / "rgb/0.png").status().message());
  }
  std::string ListError(const std::string& text) const {
    Write("rgb.txt", text);
    return std::string(LoadImageList(folder_ / "rgb.txt").status().message());
  }
};

TEST_F(StrayFile, PicturesThatAreNotReadAreCalledByTheirName) {
  const auto box = [](const std::string& brand) { return "\0\0\0\x18"s + "ftyp" + brand; };
  const struct {
    std::string bytes;
    const char *name, *remedy;
  } kCases[] = {
      {kLfs, "is a Git LFS pointer", "git lfs pull"},
      {"/annex/objects/MD5E-s1234--abc.png\n", "git-annex pointer", "git annex get"},
      {box("heic"), "HEIF", "convert it to PNG or JPEG"},
      {box("mif1"), "HEIF", "convert it to PNG or JPEG"},
      {box("avif"), "AVIF", "convert it to PNG or JPEG"},
      {"GIF89a", "is a GIF", "convert it to PNG or JPEG"},
      {"\0\0\0\x0CJXL \r\n"s, "JPEG XL", "convert it to PNG or JPEG"},
      {"\0\0\0\x0CjP  \r\n"s, "JPEG 2000", "convert it to PNG or JPEG"},
      {box("isom"), "is a video (MP4)", "take its pictures out"},
      {"<!doctype HTML><head>", "is a web page", "download"},
      {"PK\x03\x04", "ZIP", "unpack"},
  };
  for (const auto& each : kCases) {
    EXPECT_THAT(PictureError(each.bytes),
                AllOf(HasSubstr("rgb/0.png: it "), HasSubstr(each.name), HasSubstr(each.remedy)));
  }
  EXPECT_THAT(PictureError("nothing"), HasSubstr("not a picture that is read here"));
}

TEST_F(StrayFile, ADataSetOfPointersSaysSoAtTheStart) {
  for (int i = 0; i < kFrames; ++i) Write("rgb/" + PicturePath(i).filename().string(), kLfs);
  EXPECT_THAT(OpenDataset(folder_, {}).status().message(), HasSubstr("git lfs pull"));
}

TEST_F(StrayFile, ListsAndCameraFilesToo) {
  EXPECT_THAT(ListError(kLfs), AllOf(HasSubstr("rgb.txt:1: "), HasSubstr("git lfs pull")));
  Write("camera.yaml", kLfs);
  EXPECT_THAT(LoadCamera(folder_ / "camera.yaml").status().message(),
              AllOf(HasSubstr("camera.yaml: is a Git LFS pointer"), HasSubstr("git lfs pull")));
}

TEST_F(StrayFile, ListsOfAnotherFormAreToldLineCauseAndRemedy) {
  const struct {
    std::string text;
    const char *line, *cause, *remedy;
  } kCases[] = {
      {"# c\n1.0,rgb/a.png\n", "rgb.txt:2: '1.0,rgb/a.png'", "separated by ','", "with a space"},
      {"1.0, rgb/a.png\n", "rgb.txt:1:", "separated by ','", "with a space"},
      {"1.0;rgb/a.png\n", "rgb.txt:1:", "separated by ';'", "with a space"},
      {"1403636579763555584,1403636579763555584.png\n", "rgb.txt:1:", "separated by ','",
       "in seconds"},
      {"1,5 rgb/a.png\n", "rgb.txt:1:", "decimal comma", "write 1.5"},
      {"1.0 \"rgb/a.png\"\n", "rgb.txt:1:", "has quotes", "without them"},
      {"\"1.0\" \"rgb/a.png\"\n", "rgb.txt:1:", "has quotes", "without them"},
      {"1.0 'rgb/a.png'\n", "rgb.txt:1:", "has quotes", "without them"},
      {"1.0 rgb/a.png\nrgb/b.png\n", "rgb.txt:2: 'rgb/b.png'", "has no time", "`SECONDS FILE`"},
      {"rgb/a.png 1.0\n", "rgb.txt:1:", "file before the time", "`SECONDS FILE`"},
      {"timestamp filename\n1.0 rgb/a.png\n", "rgb.txt:1:", "is a heading", "#"},
      {"1305031102.1753 rgb/1305031102.1753.png 1305031102.1604 depth/1305031102.1604.png\n",
       "rgb.txt:1:", "associates two lists", "cut -d' ' -f1,2"},
      {"1.0 0.1 0.2 0.3 0 0 0 1\n", "rgb.txt:1:", "a trajectory", "`SECONDS FILE`"},
      {"\xFF\xFE" + "1\0.\0000\0 \0a\0\n\0"s, "rgb.txt:1:", "is UTF-16", "iconv"},
      {"1\0.\0000\0 \0a\0.\0p\0\n\0"s, "rgb.txt:1:", "is UTF-16", "iconv"},
  };
  for (const auto& each : kCases) {
    EXPECT_THAT(ListError(each.text),
                AllOf(HasSubstr(each.line), HasSubstr(each.cause), HasSubstr(each.remedy)));
  }
}

TEST_F(StrayFile, OddNamesThatAreRightAreRead) {
  EXPECT_EQ(ListError("1.0 rgb/a,b.png\n2.0 two words.png\n3.0 it's.png\n4 5\n5.0 7 8.png\n"), "");
}

}  // namespace
}  // namespace saccade::stray_file_test
