#include "unit_test.hpp"

#include "core/docker/container_sizes.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(container_sizes)

namespace {

using Names = std::vector<std::string>;

std::uint64_t bytes_of(std::string_view listing)
{
    return parse_container_sizes(listing).bytes;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_containers_have_added_to_their_images_is_counted)
{
    BOOST_TEST(bytes_of("0B (virtual 3.55GB)\t\n") == 0u);
    BOOST_TEST(bytes_of("512B (virtual 3.55GB)\t\n") == 512u);
    BOOST_TEST(bytes_of("1.5kB (virtual 3.55GB)\t\n12MB (virtual 1GB)\t/tmp/.X11-unix\n") == 12'001'500u);
    BOOST_TEST(bytes_of("1.258GB (virtual 3.55GB)\t") == 1'258'000'000u);
    BOOST_TEST(bytes_of("2TB (virtual 3TB)\t") == 2'000'000'000'000u);
    BOOST_TEST(bytes_of("7MB") == 7'000'000u); // as newer versions print it
}

BOOST_AUTO_TEST_CASE(what_docker_does_not_print_counts_nothing)
{
    for (auto const listing :
         {"", "\n\t\n", "N/A\t", "-1GB\t", "nan\t", "inf\t", "1e9GB\t", "99999999999GB\t"})
        BOOST_TEST(bytes_of(listing) <= 1u, listing);
}

BOOST_AUTO_TEST_CASE(volumes_are_told_from_folders_of_the_machine)
{
    auto const sizes =
        parse_container_sizes("0B (virtual 1GB)\t/tmp/.X11-unix,webots-2000-1-a_project,0a1b2c\n"
                              "0B (virtual 1GB)\twebots-2000-1-a_project,--all,a b,\n");
    BOOST_TEST(sizes.volumes == (Names{"webots-2000-1-a_project", "0a1b2c"}),
               boost::test_tools::per_element());
    BOOST_TEST(volume_bytes("0a1b2c\t31.46MB\nother\t1GB\n0a1b2c\n\twebots-2000-1-a_project\t5B\n"
                            "webots-2000-1-a_project\t5B\n",
                            sizes.volumes) == 31'460'005u);
    BOOST_TEST(list_volume_sizes().at(1) == "df");
}

BOOST_AUTO_TEST_CASE(the_containers_of_one_simulation_are_listed)
{
    auto const arguments = list_container_sizes("webots-2000-1-a");
    BOOST_TEST(arguments.at(5) == "label=com.docker.compose.project=webots-2000-1-a");
    BOOST_TEST(arguments.back() == "{{.Size}}\t{{.Mounts}}");
}

BOOST_AUTO_TEST_SUITE_END()
