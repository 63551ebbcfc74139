// What the server refuses to start on, and what it goes on without.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>

#include "tests/integration/bad_inputs/bad_data_set.hpp"
#include "tests/integration/bad_inputs/table.hpp"

namespace saccade::testing::start_test {
namespace {

namespace fs = std::filesystem;

std::string Camera(const std::string& model, const std::string& rest = "") {
  return "model: " + model +
         "\nwidth: 320\nheight: 240\nfx: 288\nfy: 288\ncx: 159.5\ncy: 119.5\nfps: 30\n" + rest;
}

TEST_F(BadDataSet, ListIsRefusedWithFileLineAndRemedy) {
  const auto refuse = [&](const std::string& input, const std::string& part,
                          const std::function<void(const fs::path&)>& spoil) {
    ExpectRefusedStart(input, Spoiled(spoil), 1, part);
  };
  refuse("data set: folder does not exist", "set", [](const fs::path& p) { fs::remove_all(p); });
  refuse("data set: no rgb.txt", "rgb.txt", [](const fs::path& p) { fs::remove(p / "rgb.txt"); });
  refuse("rgb.txt: empty", "rgb.txt", [](const fs::path& p) { WriteText(p / "rgb.txt", ""); });
  refuse("rgb.txt: time is a word", "rgb.txt:1",
         [](const fs::path& p) { WriteText(p / "rgb.txt", "soon rgb/0.000000.png\n"); });
  refuse("rgb.txt: time is NaN", "rgb.txt:1",
         [](const fs::path& p) { WriteText(p / "rgb.txt", "nan rgb/0.000000.png\n"); });
  refuse("rgb.txt: times fall", "rgb.txt:2", [](const fs::path& p) {
    WriteText(p / "rgb.txt", "1.0 rgb/0.000000.png\n0.5 rgb/0.033333.png\n");
  });
  refuse("rgb.txt: line without a file", "rgb.txt:1",
         [](const fs::path& p) { WriteText(p / "rgb.txt", "1.0\n"); });
  refuse("rgb.txt: 4 KiB of zeros", "rgb.txt",
         [](const fs::path& p) { WriteText(p / "rgb.txt", std::string(4096, '\0')); });
  for (const char* name : {"rgb.txt", "camera.yaml", "target.yaml", "start.yaml"}) {
    const std::string what = name;
    refuse(what + ": a named pipe", what + ": is a named pipe", [&](const fs::path& p) {
      fs::remove(p / name);
      ASSERT_EQ(mkfifo((p / name).c_str(), 0600), 0);
    });
    refuse(what + ": /dev/zero", what + ": is a device", [&](const fs::path& p) {
      fs::remove(p / name);
      fs::create_symlink("/dev/zero", p / name);
    });
    refuse(what + ": 64 GiB of nothing", what, [&](const fs::path& p) {
      WriteText(p / name, "");
      fs::resize_file(p / name, std::uintmax_t{1} << 36);
    });
  }
}

TEST_F(BadDataSet, CamerasVideosAndFoldersAreRefusedWithWhatToDo) {
  const auto refuse = [&](const std::string& input, const std::string& source,
                          const std::string& part) {
    ExpectRefusedStart(input, {"--source", source, "--data-dir", folder_ / "data"}, 1, part);
  };
  WriteText(fs::path(folder_.path()) / "words.mp4", "no video");
  fs::create_directory(fs::path(folder_.path()) / "shots");
  WriteSmallDataset(folder_ / "set", {.frames = 1});
  fs::copy_file(folder_ / "set/rgb/0.000000.png", folder_ / "shots/1.png");
  refuse("camera: not there", "v4l2:/dev/no-such-camera", "plug the camera in");
  refuse("camera: /dev/null", "v4l2:/dev/null", "is no V4L2 device");
  refuse("camera: unknown option", "v4l2:/dev/null?zoom=3", "zoom is not known");
  refuse("video: not there", "file:" + (folder_ / "none.mp4"), "No such file");
  refuse("video: a text", "file:" + (folder_ / "words.mp4"), "it is no video that is read here");
  refuse("video: /dev/zero", "file:/dev/zero", "is no regular file");
  refuse("stream: nobody there", "rtsp://127.0.0.1:1/cam", "is the address right?");
  refuse("pictures without times", "dataset:" + (folder_ / "shots"), "?fps=30");
}

TEST_F(BadDataSet, CameraIsRefusedWithFieldAndRemedy) {
  const auto refuse = [&](const std::string& input, const std::string& part,
                          const std::string& text) {
    ExpectRefusedStart("camera.yaml: " + input,
                       Spoiled([&](const fs::path& p) { WriteText(p / "camera.yaml", text); }), 1,
                       part);
  };
  ExpectRefusedStart("camera.yaml: missing",
                     Spoiled([](const fs::path& p) { fs::remove(p / "camera.yaml"); }), 1,
                     "camera.yaml");
  refuse("not YAML", "camera.yaml", "{{{{");
  refuse("unknown model", "model", Camera("fisheye9000"));
  refuse("focal length NaN", "fx",
         "model: pinhole\nwidth: 320\nheight: 240\nfx: .nan\nfy: 288\ncx: 160\ncy: 120\n");
  refuse("width missing", "width",
         "model: pinhole\nheight: 240\nfx: 288\nfy: 288\ncx: 160\ncy: 120\n");
  refuse("width 0", "width",
         "model: pinhole\nwidth: 0\nheight: 240\nfx: 288\nfy: 288\ncx: 160\ncy: 120\n");
  refuse("three coefficients for five", "distortion",
         Camera("brown_conrady", "distortion: [0.1, 0.2, 0.3]\n"));
  refuse("infinite coefficient", "distortion",
         Camera("brown_conrady", "distortion: [.inf, 0, 0, 0, 0]\n"));
  refuse("focal length 1e300", "fx",
         "model: pinhole\nwidth: 320\nheight: 240\nfx: 1e300\nfy: 288\ncx: 160\ncy: 120\n");
  refuse("focal length of a telescope", "field of view",
         "model: pinhole\nwidth: 320\nheight: 240\nfx: 90000\nfy: 288\ncx: 160\ncy: 120\n");
  refuse("100 000 open brackets", "camera.yaml", "fx: " + std::string(100'000, '['));
}

TEST_F(BadDataSet, TargetIsRefused) {
  ExpectRefusedStart("target.yaml: not YAML",
                     Spoiled([](const fs::path& p) { WriteText(p / "target.yaml", "}{"); }), 1,
                     "target.yaml");
  ExpectRefusedStart("target.yaml: unknown type", Spoiled([](const fs::path& p) {
                       WriteText(p / "target.yaml", "type: moon\n");
                     }),
                     1, "target.yaml");
}

TEST(BadStart, ArgumentsAreRefusedByName) {
  TemporaryFolder folder;
  WriteSmallDataset(folder / "set", {.frames = 5});
  const std::string source = "dataset:" + (folder / "set"), data = folder / "data";
  const auto refuse = [&](const std::string& input, std::vector<std::string> arguments, int code,
                          const std::string& part) {
    arguments.insert(arguments.end(), {"--data-dir", data});
    ExpectRefusedStart(input, arguments, code, part);
  };
  refuse("no --source", {}, 2, "source");
  refuse("--source of an unknown kind", {"--source", "telepathy:1"}, 1, "telepathy");
  refuse("unknown option", {"--source", source, "--frobnicate"}, 2, "frobnicate");
  refuse("--grpc without a port", {"--source", source, "--grpc", "localhost"}, 2, "grpc");
  refuse("--tls-certificate without its key", {"--source", source, "--tls-certificate", "a.pem"}, 2,
         "--tls-key");
  refuse("--tls-certificate that is not there",
         {"--source", source, "--tls-certificate", folder / "a.pem", "--tls-key", folder / "a.key"},
         1, "a.pem");
  WriteText(folder / "no.pem", "no certificate");
  refuse(
      "--tls-certificate that is none",
      {"--source", source, "--tls-certificate", folder / "no.pem", "--tls-key", folder / "no.pem"},
      1, "no.pem");
  WriteText(folder / "broken.toml", "this is = = not TOML");
  refuse("--config that is not TOML", {"--source", source, "--config", folder / "broken.toml"}, 2,
         "broken.toml");
  WriteText(folder / "unknown.toml", "colour_of_the_sky = 3\n");
  refuse("--config with an unknown key", {"--source", source, "--config", folder / "unknown.toml"},
         2, "colour_of_the_sky");
  refuse("--config is a folder", {"--source", source, "--config", folder.path()}, 2, "is a folder");
  refuse("--config is /dev/zero", {"--source", source, "--config", "/dev/zero"}, 2, "is a device");
  ASSERT_EQ(mkfifo((folder / "pipe.toml").c_str(), 0600), 0);
  refuse("--config is a named pipe", {"--source", source, "--config", folder / "pipe.toml"}, 2,
         "is a named pipe");
  refuse("--config with a name of 5000 letters",
         {"--source", source, "--config", std::string(5000, 'x')}, 2, "--config");
  const std::string deep(100'000, '[');
  for (const std::string& text :
       {"source = " + deep, "source = " + deep + std::string(100'000, ']'), deep}) {
    WriteText(folder / "deep.toml", text);
    refuse("--config with 100 000 brackets", {"--source", source, "--config", folder / "deep.toml"},
           2, "deep.toml");
  }
  WriteText(folder / "slow.toml", "[video]\nbit_rate_bit_s = 1\n");
  refuse("video of 1 bit/s", {"--source", source, "--config", folder / "slow.toml"}, 2,
         "50000 to 100000000");
  WriteText(folder / "nan.toml", "[gaze]\nrate_deg_s = nan\n");
  refuse("a setting that is NaN", {"--source", source, "--config", folder / "nan.toml"}, 1,
         "rate_deg_s");
  for (const char* time : {"1e30", "inf", "nan", "-1", "1e10"}) {
    refuse(std::string("--run-for ") + time, {"--source", source, "--run-for", time}, 2,
           "--run-for");
  }
  refuse("--camera is a folder", {"--source", source, "--camera", folder.path()}, 1, "is a folder");
}

TEST(BadStart, DataFolderAndPortsAreRefusedByName) {
  TemporaryFolder folder;
  WriteSmallDataset(folder / "set", {.frames = 5});
  const std::string source = "dataset:" + (folder / "set");
  WriteText(folder / "file", "a file where a folder should be");
  ExpectRefusedStart("--data-dir is a file", {"--source", source, "--data-dir", folder / "file"}, 1,
                     "file");
  {
    Server first({"--source", source, "--data-dir", folder / "data"});
    ExpectRefusedStart("--grpc port in use",
                       {"--source", source, "--data-dir", folder / "other", "--grpc", first.grpc()},
                       1, first.grpc().substr(first.grpc().rfind(':') + 1));
    first.process().Signal(SIGTERM);
    ASSERT_EQ(first.process().Wait(std::chrono::seconds(5)), 0);
  }
  fs::create_directories(folder / "emptied");
  WriteText(folder / "emptied/annotations.sqlite", "");
  ExpectRefusedStart("data base of 0 bytes", {"--source", source, "--data-dir", folder / "emptied"},
                     1, "0 bytes");
  for (const auto& entry : fs::directory_iterator(folder / "data")) {
    if (entry.is_regular_file()) WriteText(entry.path(), std::string(8192, '\x5a'));
  }
  ExpectRefusedStart("data base overwritten with rubbish",
                     {"--source", source, "--data-dir", folder / "data"}, 1, "data");
}

}  // namespace
}  // namespace saccade::testing::start_test
