// Pictures that are held and kept, pictures and pages that are placed, and those that are seen.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "client/tools/words.hpp"
#include "client/tools/written.hpp"
#include "client/view/desk.hpp"
#include "client/view/patch.hpp"
#include "client/view/picture_file.hpp"

namespace saccade::view {
namespace {

constexpr int kSeenSide = 2048;            // longer side of what is drawn
constexpr std::size_t kMostPictures = 40;  // decoded at one time

cv::Mat Seen(const Picture& picture) {
  const cv::Mat bytes(1, static_cast<int>(picture.bytes.size()), CV_8UC1,
                      const_cast<char*>(picture.bytes.data()));
  cv::Mat rgba;
  try {
    rgba = cv::imdecode(bytes, cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    return {};
  }
  if (rgba.empty()) return rgba;
  cv::cvtColor(rgba, rgba, cv::COLOR_BGR2RGBA);
  const double scale = static_cast<double>(kSeenSide) / std::max(rgba.cols, rgba.rows);
  if (scale < 1) cv::resize(rgba, rgba, {}, scale, scale, cv::INTER_AREA);
  return rgba;
}

}  // namespace

std::string Desk::WhyNoPicture() const {
  if (session().pause) return absl::StrCat(tools::PauseWords(*session().pause), ".");
  return shown() == nullptr ? "There is no picture yet." : "";
}

void Desk::Freeze(Timestamp now_ns) {
  if (state_.still) return state_.still.reset();
  if (const std::string why = WhyNoPicture(); !why.empty()) {
    return state_.Refuse("Freeze", why, now_ns);
  }
  state_.still = Still{*live_, session().features, session().map_revision, now_ns, false};
  const FrameId id = live_->facts->frame_id;
  // The same picture as the server kept it: without what the coder lost, where it kept it whole.
  edits_.FetchStill(id, net::VideoView::kRaw, [this, id](const absl::StatusOr<net::Still>& still) {
    if (!still.ok() || !state_.still || state_.still->picture.facts->frame_id != id) return;
    const cv::Mat bytes(1, static_cast<int>(still->png.size()), CV_8UC1,
                        const_cast<char*>(still->png.data()));
    cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_COLOR);
    const cv::Mat& old = state_.still->picture.rgba;
    if (picture.empty() || picture.cols < old.cols || picture.rows < old.rows) return;
    cv::cvtColor(picture(cv::Rect(0, 0, old.cols, old.rows)), picture, cv::COLOR_BGR2RGBA);
    state_.still->picture.rgba = picture;
    state_.still->lossless = true;
  });
}

/// The server draws the marks in, as for the wearer.
void Desk::Snapshot(Timestamp now_ns) {
  if (const std::string why = WhyNoPicture(); !why.empty()) {
    return state_.Refuse("Snapshot", why, now_ns);
  }
  const FrameId id = shown()->facts->frame_id;
  edits_.FetchStill(
      id, net::VideoView::kAugmented, [this](const absl::StatusOr<net::Still>& still) {
        const std::string words = still.ok()
                                      ? keep_snapshot(*still, *this)
                                      : absl::StrCat("No snapshot: ", still.status().message());
        state_.Refuse("Snapshot", words, MonotonicNow());
      });
}

const cv::Mat* Desk::PictureOf(const Annotation& mark) {
  const std::string& key = mark.picture->sha256;
  const auto known = pictures_.find(key);
  if (known != pictures_.end()) return known->second.empty() ? nullptr : &known->second;
  if (!session().link.live()) return nullptr;
  if (pictures_.size() >= kMostPictures) pictures_.clear();
  pictures_[key];  // asked for
  edits_.FetchPicture(mark.id, [this, key](const absl::StatusOr<Picture>& picture) {
    if (picture.ok()) {
      pictures_[key] = Seen(*picture);
    } else if (absl::IsUnavailable(picture.status())) {
      pictures_.erase(key);  // asked for again
    }
  });
  return nullptr;
}

void Desk::Load(const std::string& file, int page,
                std::function<void(const absl::StatusOr<PicturePtr>&)> done) {
  loaded_ = std::move(done);
  loading_ = std::async(std::launch::async, [file, page, wake = wake_] {
    auto picture = LoadPicture(file, page);
    wake();
    return picture;
  });
}

bool Desk::CheckLoading() {
  if (!loading_.valid() ||
      loading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return false;
  }
  const absl::StatusOr<PicturePtr> picture = loading_.get();
  std::exchange(loaded_, nullptr)(picture);
  return true;
}

AnnotationDraft Desk::PictureDraft(const PicturePtr& picture, const std::string& text) {
  AnnotationDraft draft;
  draft.shape = AnnotationShape::kPicture;
  draft.text = text;
  draft.picture = picture;
  draft.size_m = kPictureM;
  return draft;
}

void Desk::FinishDialog(bool keep) {
  if (!state_.dialog) return;
  if (!keep) return state_.dialog.reset();
  PlacingDialog& dialog = *state_.dialog;
  if (dialog.shape == AnnotationShape::kPicture) return LoadForDialog();
  AnnotationDraft draft;
  draft.shape = dialog.shape;
  draft.text = tools::CleanText(dialog.title);
  const auto list = tools::ReadList(dialog.title, dialog.lines);
  if (!list.ok()) return void(dialog.problem = std::string(list.status().message()));
  draft.check_items = list->items;
  const PlacingDialog done = *std::exchange(state_.dialog, std::nullopt);
  PlaceDraft(std::move(draft), done.landing, NameOf(done.pane));
}

void Desk::LoadForDialog() {
  PlacingDialog& dialog = *state_.dialog;
  if (loading_.valid()) return;  // Enter again
  dialog.problem.clear();
  dialog.loading = true;
  Load(tools::CleanText(dialog.file), dialog.page, [this](const absl::StatusOr<PicturePtr>& read) {
    if (!state_.dialog || !state_.dialog->loading) return;  // cancelled meanwhile
    state_.dialog->loading = false;
    if (!read.ok()) return void(state_.dialog->problem = std::string(read.status().message()));
    const PlacingDialog done = *std::exchange(state_.dialog, std::nullopt);
    PlaceDraft(PictureDraft(*read, tools::CleanText(done.title)), done.landing, NameOf(done.pane));
  });
}

void Desk::DropFile(const std::string& file, Pane pane, const Eigen::Vector2d& pixel,
                    const tools::View* view, Timestamp now_ns) {
  const Where where = NameOf(pane);
  if (!session().link.live()) {
    return state_.Refuse(where, "Not placed: no connection to the server.", now_ns);
  }
  if (loading_.valid()) {
    return state_.Refuse(where, "Not placed: another file is being read.", now_ns);
  }
  const std::optional<tools::Landing> landing = LandingAt(pane, pixel, view);
  if (!landing) {
    return state_.Refuse(where, absl::StrCat("Not placed: ", WhyNoLanding(pane)), now_ns);
  }
  if (absl::EndsWithIgnoreCase(file, ".pdf")) {  // which page is asked for
    state_.dialog.emplace();
    state_.dialog->shape = AnnotationShape::kPicture;
    state_.dialog->landing = *landing;
    state_.dialog->pane = pane;
    state_.dialog->file = file;
    return;
  }
  Load(file, 1, [this, where, landing](const absl::StatusOr<PicturePtr>& read) {
    if (read.ok()) return PlaceDraft(PictureDraft(*read, ""), *landing, where);
    state_.Refuse(where, absl::StrCat("Not placed: ", read.status().message()), MonotonicNow());
  });
}

}  // namespace saccade::view
