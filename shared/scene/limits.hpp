#pragma once

#include <cstddef>

namespace saccade {

// What callers may give of an annotation. The wire checks it where it arrives, with the field's
// name; who places and keeps it does so again, whoever asked.

/// Of each coordinate of a point in world, either way [m].
inline constexpr double kMaxCoordinateM = 1e4;
/// Edge of a cube, length of an arrow [m].
inline constexpr double kMaxSizeM = 10.0;
/// Of a note's text, UTF-8.
inline constexpr std::size_t kMaxTextBytes = 500;
/// Of a picture's file [bytes], and of each side [px].
inline constexpr std::size_t kMaxPictureBytes = 1 << 20;
inline constexpr int kMaxPictureSide = 4096;
/// Of a check list, and of one of its lines, UTF-8.
inline constexpr std::size_t kMaxCheckItems = 30;
inline constexpr std::size_t kMaxCheckItemBytes = 100;
/// Of the word that joins edits for undo.
inline constexpr std::size_t kMaxEditGroupBytes = 64;
/// Of what one pointing call brings.
inline constexpr std::size_t kMaxPointerPoints = 64;
/// Of one stroke.
inline constexpr std::size_t kMaxInkPoints = 2000;

}  // namespace saccade
