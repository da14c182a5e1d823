#include "unit_test.hpp"

#include "core/docker/build_images.hpp"

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(images_of_builds)

namespace {

using Words = std::vector<std::string>;

std::string id_of(char digit)
{
    return "sha256:" + std::string(64, digit);
}

BuiltImage image(char digit, char parent, std::uint64_t size, std::string created)
{
    BuiltImage made;
    made.id = id_of(digit);
    made.parent = id_of(parent);
    made.size = size;
    made.created = std::move(created);
    return made;
}

/// Two builds that begin alike, from an image of somebody else: a - b - c, and a - d.
std::vector<BuiltImage> two_builds()
{
    return {image('a', '0', 1000, "1"), image('b', 'a', 1010, "2"), image('c', 'b', 1040, "3"),
            image('d', 'a', 1100, "4")};
}

} // namespace

BOOST_AUTO_TEST_CASE(a_build_names_what_it_makes)
{
    BuildRecord record;
    for (auto const line :
         {"Step 1/3 : FROM base", " ---> fb545d667979", " ---> Running in f97c9b7e7428",
          "abcRemoving intermediate container 111111111111", " ---> 82fe80d1fae5\r", " ---> ",
          " ---> Using cache", " ---> [Warning] Some labels", " ---> fb545d66797", " ---> fb545d66797g",
          "webots-1  |  ---> 222222222222", "x ---> 333333333333", " ---> --all4444444"})
        record.read(line);
    BOOST_TEST((record.names() == std::set<std::string>{"fb545d667979", "f97c9b7e7428", "82fe80d1fae5"}));
    BOOST_TEST(!record.is_full());
}

BOOST_AUTO_TEST_CASE(a_flood_of_names_is_noticed_and_not_kept)
{
    BuildRecord record;
    for (int number = 0; number < 2000; ++number)
        record.read(" ---> " + std::to_string(100'000'000'000 + number));
    record.read(" ---> 100000000000");
    BOOST_TEST(!record.is_full());
    record.read(" ---> ffffffffffff");
    BOOST_TEST(record.is_full());
    BOOST_TEST(record.names().size() == 2000U);
}

BOOST_AUTO_TEST_CASE(only_images_are_asked_for_and_of_those_a_build_has_named_its_own)
{
    BOOST_TEST(list_built_ids("webots-2000-1f3a9c4d") ==
                   (Words{"images", "--all", "--quiet", "--no-trunc", "--filter",
                          "label=webots_cloud.server=webots-2000-1f3a9c4d"}),
               boost::test_tools::per_element());
    auto const listing =
        id_of('b') + "\n" + id_of('a') + "\n" + id_of('a') + "\n--force\nsha256:ab\n" + id_of('x') + "\n";
    BOOST_TEST(image_ids(listing) == (Words{id_of('a'), id_of('b')}), boost::test_tools::per_element());
    BOOST_TEST(image_ids(listing, {"bbbbbbbbbbbb", "cccccccccccc"}) == (Words{id_of('b')}),
               boost::test_tools::per_element());
    BOOST_TEST(describe_images({id_of('a')}).back() == id_of('a'));
}

BOOST_AUTO_TEST_CASE(what_docker_says_of_images_is_read)
{
    auto const images = read_images(id_of('b') + "\t" + id_of('a') + "\t34909800\t2026-11-28T18:49:00.1Z\n" +
                                    id_of('a') + "\t\t4909800\t2026-11-28T18:48:00.1Z\n" +
                                    "Error: No such image: x\n" + id_of('c') + "\t\tmuch\t\n");
    BOOST_TEST_REQUIRE(images.size() == 3U);
    BOOST_TEST(images[0].parent == images[1].id);
    BOOST_TEST(images[0].size == 34'909'800U);
    BOOST_TEST(images[1].created == "2026-11-28T18:48:00.1Z");
    BOOST_TEST(images[2].size == 0U);
    BOOST_TEST(added_bytes(images) == 30'000'000U);
}

BOOST_AUTO_TEST_CASE(each_step_counts_once_and_what_others_have_made_does_not)
{
    BOOST_TEST(added_bytes({}) == 0U);
    BOOST_TEST(added_bytes(two_builds()) == 140U);
    auto smaller = two_builds();
    smaller[2].size = 5; // docker never says so
    BOOST_TEST(added_bytes(smaller) == 110U);
    BOOST_TEST(added_bytes({image('a', 'a', 100, "1")}) == 0U);
}

BOOST_AUTO_TEST_CASE(what_was_made_first_goes_first_until_the_rest_is_small_enough)
{
    BOOST_TEST(images_beyond(two_builds(), 140, {}).empty());
    for (std::uint64_t const max : {139, 100})
        BOOST_TEST(images_beyond(two_builds(), max, {}) == (Words{id_of('c'), id_of('b')}),
                   boost::test_tools::per_element());
    BOOST_TEST(images_beyond(two_builds(), 99, {}) == (Words{id_of('c'), id_of('b'), id_of('d'), id_of('a')}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(what_a_running_build_uses_stays)
{
    BOOST_TEST(images_beyond(two_builds(), 0, {"cccccccccccc"}) == (Words{id_of('d')}),
               boost::test_tools::per_element());
    BOOST_TEST(images_beyond(two_builds(), 0, {"bbbbbbbbbbbb"}) == (Words{id_of('c'), id_of('d')}),
               boost::test_tools::per_element());
    BOOST_TEST(images_beyond(two_builds(), 0, {"cccccccccccc", "dddddddddddd"}).empty());
}

BOOST_AUTO_TEST_SUITE_END()
