#include <random>

#include "server/capture/camera_file.hpp"
#include "server/capture/dataset.hpp"
#include "server/capture/image_file.hpp"
#include "server/capture/image_list.hpp"
#include "server/capture/target_file.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::parser_fuzz_test {
namespace {

/// Damages whole files at random (fixed seeds): a parser may refuse or accept, but must answer with
/// a status that names the file, and never throw or crash.
class ParserFuzz : public DatasetFixture {
 protected:
  std::string Damaged(std::string text) {
    const int edits = 1 + static_cast<int>(rng_() % 4);
    for (int i = 0; i < edits && !text.empty(); ++i) {
      const std::size_t at = rng_() % text.size();
      static const std::string kTokens[] = {
          "nan", "-1e999", "[",  "]",         "{",
          "}",   ":",      "- ", "\n",        "\t",
          "#",   "&a",     "*a", "!!binary ", "99999999999999999999",
          "0x",  "'",      "\"", "?"};
      switch (rng_() % 5) {
        case 0:
          text[at] = static_cast<char>(rng_());
          break;
        case 1:
          text.insert(at, kTokens[rng_() % std::size(kTokens)]);
          break;
        case 2:
          text.erase(at, 1 + rng_() % 8);
          break;
        case 3:
          text = text.substr(0, at);
          break;
        default:
          text.insert(at, text.substr(rng_() % text.size(), rng_() % 30));
      }
    }
    return text;
  }
  template <typename Load>
  void Fuzz(const std::string& name, const std::string& good, const Load& load, int rounds) {
    int refused = 0;
    for (int i = 0; i < rounds; ++i) {
      const std::string bad = Damaged(good);
      Write(name, bad);
      absl::Status status;
      ASSERT_NO_THROW(status = load(folder_ / name)) << bad;
      if (status.ok()) continue;
      ++refused;
      ASSERT_NE(status.message().find(folder_.string()), absl::string_view::npos) << status << "\n"
                                                                                  << bad;
    }
    EXPECT_GT(refused, rounds / 10);  // the damage is real
  }
  std::mt19937 rng_{20261122};
};

TEST_F(ParserFuzz, Camera) {
  Fuzz(
      "camera.yaml", kCamera, [](const auto& f) { return LoadCamera(f).status(); }, 2000);
}

TEST_F(ParserFuzz, CamerasOfOtherPrograms) {
  const auto load = [](const auto& f) { return LoadCamera(f).status(); };
  Fuzz("file",
       "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0.2, 0, 0]\n"
       "  distortion_model: radtan\n  intrinsics: [60, 60, 32, 24]\n  resolution: [64, 48]\n",
       load, 1000);
  Fuzz("file", "# head\n1 OPENCV 64 48 60 60 32 24 0.1 0 0 0\n2 PINHOLE 64 48 60 60 32 24\n", load,
       1000);
  Fuzz("file",
       "<?xml version=\"1.0\"?>\n<opencv_storage><image_width>64</image_width><image_height>48"
       "</image_height><camera_matrix><rows>3</rows><cols>3</cols><data>60 0 32 0 60 24 0 0 1"
       "</data></camera_matrix><distortion_coefficients><rows>1</rows><cols>4</cols><data>0 0 0 0"
       "</data></distortion_coefficients></opencv_storage>\n",
       load, 1000);
}

TEST_F(ParserFuzz, ImageList) {
  Fuzz(
      "rgb.txt", "# head\n1.000000 rgb/a.png\n1.033333 rgb/b.png\n1.066667 rgb/c.png\n",
      [](const auto& f) { return LoadImageList(f).status(); }, 2000);
}

TEST_F(ParserFuzz, Target) {
  cv::imwrite((folder_ / "p.pgm").string(), cv::Mat(11, 11, CV_8UC1, cv::Scalar(7)));
  Fuzz(
      "target.yaml",
      "type: patches\npoints:\n  - {id: 0, point_in_world_m: [0, 0, 0], template: p.pgm}\n"
      "  - {id: 1, point_in_world_m: [0, 1, 0], template: p.pgm}\n",
      [](const auto& f) { return LoadTarget(f).status(); }, 2000);
}

TEST_F(ParserFuzz, Start) {
  Fuzz(
      "start.yaml",
      "position_m: [0.0, 0.0, -0.6]\nposition_sigma_m: 0.02\norientation_xyzw: [0, 0, 0, 1]\n"
      "orientation_sigma_rad: 0.0\n",
      [](const auto& f) { return LoadStart(f).status(); }, 2000);
}

TEST_F(ParserFuzz, Picture) {
  for (int i : {0, 1}) {
    std::ifstream file(PicturePath(i), std::ios::binary);
    const std::string good(std::istreambuf_iterator<char>(file), {});
    Fuzz(
        "rgb/fuzzed", good, [](const auto& f) { return LoadPicture(f).status(); }, 300);
  }
}

}  // namespace
}  // namespace saccade::parser_fuzz_test
