#include "server/rpc/annotation_pages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace saccade::annotation_pages_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

Annotation Make(std::int64_t created, const std::string& id, std::size_t points = 0) {
  Annotation one;
  one.id = id;
  one.created_unix_ns = created;
  one.ink_offset_m = InkStroke::Points(points, Eigen::Vector3d(0.1, 0.2, 0.3));
  return one;
}

std::vector<std::string> Ids(const v1::ListAnnotationsResponse& response) {
  std::vector<std::string> ids;
  for (const v1::Annotation& one : response.annotations()) ids.push_back(one.id());
  return ids;
}

v1::ListAnnotationsResponse Page(const AnnotationList& list, std::uint32_t size,
                                 const std::string& token) {
  v1::ListAnnotationsRequest request;
  request.set_page_size(size);
  request.set_page_token(token);
  v1::ListAnnotationsResponse response;
  EXPECT_TRUE(ListPage(list, request, response).ok());
  return response;
}

TEST(AnnotationPages, SmallListsAreOnePage) {
  EXPECT_THAT(Page({}, 0, "").next_page_token(), IsEmpty());
  const v1::ListAnnotationsResponse all = Page({Make(1, "a"), Make(2, "b")}, 0, "");
  EXPECT_THAT(Ids(all), ElementsAre("a", "b"));
  EXPECT_THAT(all.next_page_token(), IsEmpty());
  EXPECT_THAT(Page({Make(1, "a"), Make(2, "b")}, 2, "").next_page_token(), IsEmpty());
}

TEST(AnnotationPages, EveryAnnotationOnceAndNoAnswerAboveAMebibyte) {
  AnnotationList list;
  for (int i = 0; i < 90; ++i) list.push_back(Make(i / 2, "id " + std::to_string(100 + i), 2000));
  std::vector<std::string> seen;
  std::string token;
  int pages = 0;
  do {
    const v1::ListAnnotationsResponse page = Page(list, 0, token);
    EXPECT_LE(page.ByteSizeLong(), kPageBytes);
    for (const std::string& id : Ids(page)) seen.push_back(id);
    token = page.next_page_token();
    ++pages;
  } while (!token.empty() && pages < 100);
  EXPECT_EQ(seen.size(), 90u);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(pages, 6);
}

TEST(AnnotationPages, EditsBetweenTwoPagesShiftNothing) {
  AnnotationList list = {Make(1, "a"), Make(2, "b"), Make(2, "c"), Make(4, "d")};
  const v1::ListAnnotationsResponse first = Page(list, 2, "");
  EXPECT_THAT(Ids(first), ElementsAre("a", "b"));
  // The last one of the page is deleted, others before and after come and go.
  list = {Make(2, "c"), Make(3, "new"), Make(4, "d"), Make(5, "newest")};
  const v1::ListAnnotationsResponse second = Page(list, 2, first.next_page_token());
  EXPECT_THAT(Ids(second), ElementsAre("c", "new"));
  EXPECT_THAT(Ids(Page(list, 9, second.next_page_token())), ElementsAre("d", "newest"));
  EXPECT_THAT(Ids(Page({}, 2, first.next_page_token())), IsEmpty());
}

TEST(AnnotationPages, AForeignTokenIsRefusedByName) {
  const std::string good = Page({Make(1, "a"), Make(2, "b")}, 1, "").next_page_token();
  for (const std::string& bad : {std::string("x"), std::string("2"), good + "!", good.substr(3),
                                 std::string(100'000, 'A'), std::string("\xff\xfe")}) {
    v1::ListAnnotationsRequest request;
    request.set_page_token(bad);
    v1::ListAnnotationsResponse response;
    const absl::Status status = ListPage({}, request, response);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), StartsWith("page_token: "));
  }
}

}  // namespace
}  // namespace saccade::annotation_pages_test
