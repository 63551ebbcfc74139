#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <vector>

#include "server/features/image_pyramid.hpp"
#include "server/features/patch.hpp"

namespace saccade {

enum class SubPixel {
  kNone,         // integer pixel
  kParabola,     // peak of a parabola through 3 scores per axis: about 0.1 px
  kLucasKanade,  // parabola, then template alignment with gain and offset: about 0.02 px
};

struct SearchOptions {
  /// NSSD = 2 (1 - NCC) up to which a match is accepted (slam-spec 5.1: 0.40, NCC 0.80).
  double max_nssd = 0.40;
  /// n^T S^-1 n below which a pixel belongs to the ellipse (9: 3 sigma, p = 0.989).
  double gate_squared = 9.0;
  /// Ellipses with an axis above this standard deviation are refused [px] (slam-spec 5.1: 10).
  double max_sigma_px = 10.0;
  /// Half axes of the ellipse are at least this long [px], so that a very certain prediction still
  /// looks at the neighbouring pixels.
  double min_half_axis_px = 1.5;
  /// Ellipses with more pixels than this are searched at half resolution first, then around its
  /// best peaks at full resolution.
  int coarse_above_pixels = 250;
  /// Peaks followed from half to full resolution, 1 to 8, and the ZNCC they need there.
  int coarse_peaks = 4;
  double coarse_min_zncc = 0.6;
  /// A rival peak counts as another place if at least this far from the best [px].
  int rival_distance_px = 4;
  SubPixel sub_pixel = SubPixel::kLucasKanade;
  int max_iterations = 12;  // of Lucas-Kanade; a blurred picture needs more than 3
  /// Places with less contrast than this never match [grey levels, standard deviation].
  double min_deviation = 4.0;
  /// Noise floor added to the estimated match covariance [px].
  double noise_floor_px = 0.05;

  absl::Status Validate() const;
};

enum class SearchStatus {
  kFound,
  kNoMatch,       // best score below the bar
  kTooUncertain,  // ellipse larger than max_sigma_px
  kOutside,       // no pixel of the ellipse has the whole template inside the picture
  kBadInput,      // non-finite prediction or covariance not positive definite
};
const char* ToString(SearchStatus status);

struct SearchResult {
  SearchStatus status = SearchStatus::kBadInput;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // full resolution, sub-pixel; if kFound
  double zncc = -1.0;                               // of the best integer pixel, [-1, 1]
  double nssd = 4.0;                                // 2 (1 - zncc)
  /// Best ZNCC of any other peak in the ellipse, -1 if there is none. Small (zncc - rival_zncc), or
  /// (1 - zncc) / (1 - rival_zncc) near 1, means the match is ambiguous.
  double rival_zncc = -1.0;
  /// Estimated covariance of `pixel` [px^2] from the residual and the template's gradients, with
  /// the floor: what image noise and texture explain, not wrong matches.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  bool refined = false;  // Lucas-Kanade converged (else the parabola stands)
  int evaluated = 0;     // pixels at which the template was compared

  bool found() const { return status == SearchStatus::kFound; }
  /// (1 - zncc) / (1 - rival_zncc) in [0, 1]: 0 unique, 1 as good elsewhere.
  double Ambiguity() const;
};

/// Looks for predicted patches inside their uncertainty ellipses (slam-spec 5.1).
///
/// One instance per thread: it owns scratch memory, which grows to the largest window seen and is
/// then reused.
/// Deterministic: ties go to the pixel first in row-major order.
class PatchSearcher {
 public:
  explicit PatchSearcher(const SearchOptions& options);

  const SearchOptions& options() const { return options_; }

  /// `predicted`: centre of the ellipse [px]; `innovation_covariance`: S [px^2], measurement noise
  /// included. Near the picture's border only pixels where the whole template is inside count.
  SearchResult Find(const ImagePyramid& pyramid, const WarpedPatch& patch,
                    const Eigen::Vector2d& predicted, const Eigen::Matrix2d& innovation_covariance);

 private:
  struct Ellipse;
  struct Window;
  struct Peak {
    int x = 0;
    int y = 0;
    float zncc = -2.0F;
  };

  SearchResult FindFine(const cv::Mat& image, const CorrelationTemplate& templ,
                        const Ellipse& ellipse);
  SearchResult FindCoarse(const ImagePyramid& pyramid, const WarpedPatch& patch,
                          const Ellipse& ellipse);
  /// Scores `window` of `image` where `ellipse` (null: everywhere) allows; the rest becomes -2.
  /// Returns the number of pixels compared.
  int Scan(const cv::Mat& image, const CorrelationTemplate& templ, const Window& window,
           const Ellipse* ellipse);
  Peak Best(const Window& window) const;
  /// Best local maximum at least rival_distance_px from `best`.
  float Rival(const Window& window, const Peak& best) const;
  void TopPeaks(const Window& window);
  void Finish(const cv::Mat& image, const CorrelationTemplate& templ, const Peak& peak,
              SearchResult& result);
  float ScoreAt(const cv::Mat& image, const CorrelationTemplate& templ, int x, int y) const;

  SearchOptions options_;
  std::vector<float> scores_;         // of the last scanned window
  std::vector<std::uint8_t> pixels_;  // of the last scanned window, padded to the right
  std::vector<Peak> peaks_;
};

}  // namespace saccade
