#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/eval/markers/square_render.hpp"
#include "server/markers/marker.hpp"

namespace saccade {

/// What a detector made of renders whose truth is known (slam-spec T20, T21).
class RenderScore {
 public:
  /// One render in which there is the marker `family`, `id`, and what was seen there.
  void Add(const SquareRender& truth, const std::string& family, int id,
           const std::vector<MarkerSighting>& sightings, double detector_ms);

  /// Detection by kind, side and tilt; wrong ids; corners [px], their error's square over their
  /// variance; pose from the four corners alone [mm, deg]; the detector's own time [ms].
  nlohmann::ordered_json Report() const;

  int wrong() const { return wrong_; }
  /// Share of the squares found of which nothing is covered, and over whose border something lies.
  double VisibleFound() const { return visible_.Share(); }
  double BorderCoveredFound() const;
  /// Mean error's square over the variance, of corners of squares of which nothing is covered.
  double Nees() const;

 private:
  struct Tally {
    int there = 0, found = 0;
    double Share() const { return there > 0 ? static_cast<double>(found) / there : 0; }
    void Count(bool one) {
      ++there;
      found += one;
    }
  };
  static nlohmann::ordered_json Json(const Tally& tally);
  void MeasureCorners(const SquareRender& truth, const MarkerSighting& sighting);

  std::map<RenderKind, Tally> by_kind_;
  std::map<int, Tally> by_shortest_, by_tilt_;  // of wholly visible ones, by lower bound
  std::map<int, std::vector<double>> nees_by_shortest_;
  std::map<RenderKind, std::vector<double>> nees_by_kind_;
  Tally visible_;
  int wrong_ = 0, renders_ = 0;
  std::vector<double> nees_, error_px_, at_1_m_mm_, at_1_m_deg_, ms_;
};

}  // namespace saccade
