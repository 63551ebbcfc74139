# Every external library, found once. Package names are in deploy/install.
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(absl REQUIRED)
find_package(Protobuf REQUIRED)
find_package(gRPC CONFIG REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(EXPAT REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Boost REQUIRED)
find_package(Ceres REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(OpenSSL 3 REQUIRED)
find_package(PkgConfig REQUIRED)
# What firms' providers sign (OIDC), and asking them over HTTP.
pkg_check_modules(Cjose REQUIRED IMPORTED_TARGET cjose)
pkg_check_modules(Alsa REQUIRED IMPORTED_TARGET alsa)
pkg_check_modules(Curl REQUIRED IMPORTED_TARGET libcurl)
pkg_check_modules(OpenH264 REQUIRED IMPORTED_TARGET openh264)
# saccade-client alone. libimgui.a holds its backends for GLFW and OpenGL 3, which loads OpenGL itself.
find_package(glfw3 3.3 REQUIRED)
pkg_check_modules(Imgui REQUIRED IMPORTED_TARGET imgui)
pkg_check_modules(Opus REQUIRED IMPORTED_TARGET opus)
pkg_check_modules(OSMesa REQUIRED IMPORTED_TARGET osmesa)
pkg_check_modules(Seccomp REQUIRED IMPORTED_TARGET libseccomp)
pkg_check_modules(SpeexDsp REQUIRED IMPORTED_TARGET speexdsp)
# Of saccade-decode alone (architecture, section 7).
pkg_check_modules(VideoDecoder REQUIRED IMPORTED_TARGET libavformat libavcodec libswscale libavutil)
pkg_check_modules(Zstd REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(QrEncode REQUIRED IMPORTED_TARGET libqrencode)
pkg_check_modules(TextDrawing REQUIRED IMPORTED_TARGET freetype2 harfbuzz fribidi fontconfig)

# OpenCV by module: libopencv-dev, which holds OpenCVConfig.cmake, would pull VTK and videoio in.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(module core imgproc imgcodecs calib3d features2d flann video aruco)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  add_library(OpenCV::${module} UNKNOWN IMPORTED)
  set_target_properties(OpenCV::${module} PROPERTIES
    IMPORTED_LOCATION ${OPENCV_${module}_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE_DIR})
endforeach()
# Models (GLB), and what they touch.
pkg_check_modules(TinyGltf REQUIRED IMPORTED_TARGET tinygltf)
find_package(fcl REQUIRED)
find_package(meshoptimizer CONFIG REQUIRED)  # surfaces on their way to people
# Square markers.
find_package(apriltag CONFIG REQUIRED)
pkg_check_modules(Cairo REQUIRED IMPORTED_TARGET cairo cairo-pdf cairo-svg)  # sheets of them
