#include "server/eval/markers/marker_flags.hpp"

#include <CLI/CLI.hpp>

namespace saccade {

void AddMarkers(CLI::App& app, MarkersArguments& arguments) {
  CLI::App* markers = app.add_subcommand("markers", "Find square markers in pictures");
  CLI::Option* images = markers->add_option("--images", arguments.images, "Folder of pictures");
  CLI::Option* renders =
      markers
          ->add_option("--renders", arguments.renders,
                       "Instead of pictures: make so many of single squares, whose truth is known")
          ->check(CLI::Range(1, 1'000'000))
          ->excludes(images);
  markers->add_option("--seed", arguments.seed, "Of the renders; 1 by default")->needs(renders);
  markers->add_option("--keep", arguments.keep, "Write the first K renders as pictures, too")
      ->check(CLI::Range(0, 1'000'000))
      ->needs(renders);
  markers->add_option("--detector", arguments.detector, "apriltag, aruco or koller")
      ->check(CLI::IsMember({"apriltag", "aruco", "koller"}))
      ->required();
  markers
      ->add_option("--family", arguments.families,
                   "apriltag36h11, aruco_4x4_50, ...; may be repeated; else those that can hardly "
                   "be taken for something else")
      ->take_all();
  markers
      ->add_option("--border-bits", arguments.border_bits,
                   "Width of the black border in cells; else 1, and for a sheet what reads more")
      ->check(CLI::Range(1, 4));
  markers->add_option("--grid", arguments.grid,
                      "Kalibr's aprilgrid.yaml, or 6x6:0.088:0.3, whose tags are searched for "
                      "where they must be; else the folder's aprilgrid.yaml; none for neither");
  markers->add_option("--ids", arguments.ids,
                      "Of koller: those on the walls, as 0:8 or 1,4,9; others are left out, and "
                      "pictures that are mirrored are found out");
  markers->add_option("--out", arguments.out, "Folder for detections.csv")->required();
  markers->callback([images, renders] {
    if (images->count() + renders->count() == 0) {
      throw CLI::RequiredError("--images DIR or --renders N");
    }
  });
}

void AddPrintMarkers(CLI::App& app, PrintMarkersArguments& arguments) {
  CLI::App* print =
      app.add_subcommand("print-markers", "Draw sheets of square markers (saccade markers print)");
  print->add_option("--family", arguments.family, "koller, apriltag36h11, aruco_4x4_50, ...")
      ->required();
  print->add_option("--ids", arguments.ids, "0:8 (0 to 7), 3 or 1,4,9")->required();
  print->add_option("--size-m", arguments.side_m, "Side of the black border [m]: 0.16")->required();
  print->add_option("--out", arguments.out, "A new .pdf; or, of one page, .svg or .png")
      ->required();
  print->add_option("--paper", arguments.paper, "a4 (the default) or letter");
}

}  // namespace saccade
