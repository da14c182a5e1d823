#include "unit_test.hpp"

#include "core/pages/shared_page.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::SharedPage;
using core::TimedPage;

BOOST_AUTO_TEST_SUITE(shared_page)

namespace {

std::string header(HttpResponse const& response, std::string_view name)
{
    for (auto const& [field, value] : response.headers)
        if (field == name)
            return value;
    return {};
}

} // namespace

BOOST_AUTO_TEST_CASE(all_who_ask_share_one_body)
{
    SharedPage page;
    BOOST_TEST(page.empty());
    page.set("text");
    auto const first = page.answer("text/html", "");
    auto const second = page.answer("text/html", "W/\"0\"");
    BOOST_TEST(first.status == 200);
    BOOST_TEST(first.content_type == "text/html");
    BOOST_TEST(first.text() == "text");
    BOOST_TEST((first.shared == second.shared));
    page.set("text");
    BOOST_TEST((page.answer("text/html", "").shared == first.shared)); // nothing has changed
}

BOOST_AUTO_TEST_CASE(a_page_can_bring_its_compressed_form)
{
    SharedPage page;
    page.set("text", "compressed");
    BOOST_TEST(page.answer("text/html", "").shared->gzip == "compressed");
    page.set("other");
    BOOST_TEST(page.answer("text/html", "").shared->gzip.empty());
}

BOOST_AUTO_TEST_CASE(who_has_the_page_is_told_so_until_it_changes)
{
    SharedPage page;
    page.set("text");
    auto const tag = header(page.answer("text/html", ""), "ETag");
    BOOST_TEST(tag.starts_with("W/\""));
    for (auto const& known : {tag, "W/\"1\", " + tag, tag.substr(2), std::string("*")}) {
        auto const answer = page.answer("text/html", known);
        BOOST_TEST(answer.status == 304, known);
        BOOST_TEST(answer.text().empty());
        BOOST_TEST(header(answer, "ETag") == tag);
    }
    page.set("other");
    BOOST_TEST(page.answer("text/html", tag).status == 200);
}

BOOST_AUTO_TEST_CASE(a_page_is_made_once_a_second_at_most_unless_somebody_wants_to_see_a_change)
{
    TimedPage page;
    int made = 0;
    auto const make = [&] { return std::to_string(++made); };
    TimePoint const start;
    for (int i = 0; i < 10; ++i)
        BOOST_TEST(page.get(start + i * 99ms, make).answer("", "").text() == "1");
    BOOST_TEST(page.get(start + 1s, make).answer("", "").text() == "2");
    page.expire();
    BOOST_TEST(page.get(start + 1s, make).answer("", "").text() == "3");
}

BOOST_AUTO_TEST_SUITE_END()
