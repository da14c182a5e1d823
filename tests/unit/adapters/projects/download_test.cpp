// What is downloaded has no name, and is paid for.
#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/projects/download.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "small_web_server.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <string>

using namespace webots_cloud;
using namespace webots_cloud::adapters;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(download_to_nameless_files)

namespace {

struct Downloads : ScratchFolder
{
    result<Download> get(FetchShare& share, std::uint64_t limit = 1'000'000)
    {
        FileDescriptor const opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        CurlRequest request;
        request.peer = "the test";
        request.base = server.url();
        request.url = server.url() + "/file";
        request.explain = [](Failure const& failure) {
            return Failure(failure.code(), "explained: " + failure.message());
        };
        CurlLimits limits;
        limits.bytes = limit;
        return download(http, std::move(request), limits, opened.get(), share, progress);
    }

    int status = 200;
    std::string body = std::string(600, 'a') + std::string(9'400, 'b');
    SmallWebServer server{[this](auto const&, auto& response) {
        response.result(static_cast<unsigned>(status));
        response.body() = body;
    }};
    CurlHttp http;
    FetchProgress progress;
    std::shared_ptr<FetchBudget> budget = make_fetch_budget(std::uint64_t{3} << 20, 15'000);
};

std::string content_of(FileDescriptor const& file)
{
    std::string text(100'000, '\0');
    auto const count = ::pread(file.get(), text.data(), text.size(), 0);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return text;
}

} // namespace

BOOST_FIXTURE_TEST_CASE(a_download_is_in_no_folder_and_its_bytes_are_counted, Downloads)
{
    progress.bytes_received = 77; // of what was copied before
    {
        FetchShare share(budget, {});
        auto const got = get(share);
        BOOST_TEST_REQUIRE(got.has_value());
        BOOST_TEST(got->status == 200);
        BOOST_TEST(content_of(got->file) == body);
        BOOST_TEST(got->beginning == std::string(512, 'a'));
        BOOST_TEST(fs::is_empty(folder));
        BOOST_TEST(progress.bytes_received == body.size());
        BOOST_TEST(share.held().disk == body.size());
        BOOST_TEST(share.held().memory > 0u);
    }
    BOOST_TEST(budget->taken().disk == 0u);
}

BOOST_FIXTURE_TEST_CASE(of_another_answer_the_status_is_told, Downloads)
{
    status = 404;
    FetchShare share(budget, {});
    auto const got = get(share);
    BOOST_TEST_REQUIRE(got.has_value());
    BOOST_TEST(got->status == 404);
    BOOST_TEST(content_of(got->file) == "");
}

BOOST_FIXTURE_TEST_CASE(what_the_budget_says_is_not_explained, Downloads)
{
    body.append(10'000, 'c');
    FetchShare share(budget, {});
    auto const got = get(share);
    BOOST_TEST_REQUIRE(got.has_error());
    BOOST_TEST((got.error() == errc::too_large));
    BOOST_TEST(!got.error().message().starts_with("explained: "));
    BOOST_TEST(fs::is_empty(folder));
}

BOOST_FIXTURE_TEST_CASE(what_the_transport_says_is_explained, Downloads)
{
    FetchShare share(budget, {});
    auto const got = get(share, 1000);
    BOOST_TEST_REQUIRE(got.has_error());
    BOOST_TEST((got.error() == errc::too_large));
    BOOST_TEST(got.error().message().starts_with("explained: "));
    BOOST_TEST(share.held().disk <= 1000u);
    BOOST_TEST(fs::is_empty(folder));
}

BOOST_AUTO_TEST_SUITE_END()
