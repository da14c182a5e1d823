// The list of files that lies beside each folder in the cache.
#include "unit_test.hpp"

#include "adapters/git/git_index.hpp"

using namespace webots_cloud;
using namespace webots_cloud::adapters;
using Kind = core::GitTreeEntry::Kind;

namespace {

GitIndexEntry entry(Kind kind, std::string path, std::uint64_t size)
{
    GitIndexEntry made;
    made.kind = kind;
    made.id = *core::git_object_id(std::string(40, 'a'));
    made.path = std::move(path);
    made.size = size;
    return made;
}

GitIndex example()
{
    GitIndex index;
    index.entries = {entry(Kind::folder, "worlds", 0), entry(Kind::file, "worlds/my demo.wbt", 1234),
                     entry(Kind::executable, "run", 1), entry(Kind::link, "latest", 6)};
    return index;
}

} // namespace

BOOST_AUTO_TEST_SUITE(git_index)

BOOST_AUTO_TEST_CASE(what_is_written_is_read_again)
{
    auto const read = parse_index(write_index(example()));
    BOOST_REQUIRE(read.has_value());
    BOOST_TEST(read->bytes == 1241u);
    BOOST_REQUIRE(read->entries.size() == 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        auto const expected = example().entries[i];
        BOOST_TEST((read->entries[i].kind == expected.kind));
        BOOST_TEST((read->entries[i].id == expected.id));
        BOOST_TEST(read->entries[i].path == expected.path);
        BOOST_TEST(read->entries[i].size == expected.size);
    }
}

BOOST_AUTO_TEST_CASE(every_cut_of_it_is_an_error)
{
    auto const text = write_index(example());
    for (std::size_t size = 0; size < text.size(); ++size)
        BOOST_TEST(parse_index(std::string_view(text).substr(0, size)).has_error(), size);
    BOOST_TEST(parse_index(text + "x").has_error());
}

BOOST_AUTO_TEST_CASE(paths_that_lead_elsewhere_are_errors)
{
    for (auto const* const path : {"../x", "/x", "a//b", "a/../b", "", ".git/config", "a/"}) {
        GitIndex index;
        index.entries = {entry(Kind::file, path, 1)};
        BOOST_TEST(parse_index(write_index(index)).has_error(), path);
    }
}

BOOST_AUTO_TEST_SUITE_END()
