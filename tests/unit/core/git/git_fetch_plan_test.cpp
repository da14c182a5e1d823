// How a folder is fetched, as a timetable: what became of an action, and which one follows.
#include "git_ids.hpp"
#include "unit_test.hpp"

#include "core/git/git_fetch_plan.hpp"

#include <boost/asio/error.hpp>
#include <boost/system/errc.hpp>

#include <algorithm>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace git_action;
using namespace git_outcome;

BOOST_AUTO_TEST_SUITE(git_fetch_plan)

namespace {

// Commits as addresses name them.
std::string const commit_1 = to_hex(id(1));

ProjectRef project(std::string_view ref_and_folder)
{
    ProjectRef made;
    made.forge = "https://forge.example";
    made.owner = "ann";
    made.repository = "robots";
    made.ref_and_folder = ref_and_folder;
    return made;
}

std::string describe(GitCapabilities const& capabilities)
{
    return std::string(capabilities.version_2 ? " v2" : " old") + (capabilities.shallow ? "" : " deep") +
           (capabilities.filter ? "" : " unfiltered");
}

/// An action in a few words.
struct Words
{
    std::string operator()(FindCommit const&) const { return "find commit"; }
    std::string operator()(ListRefs const& list) const
    {
        return std::string("list refs") + (list.version_2 ? "" : " old") +
               (list.prefixes == all_ref_prefixes() ? " all" : "");
    }
    std::string operator()(AskCapabilities const&) const { return "ask"; }
    std::string operator()(RememberCapabilities const& remember) const
    {
        return "remember" + describe(remember.capabilities);
    }
    std::string operator()(RememberMissing const&) const { return "remember missing"; }
    std::string operator()(ForgetTarget const&) const { return "forget"; }
    std::string operator()(FindFolder const&) const { return "find"; }
    std::string operator()(FindLastFolder const&) const { return "find last"; }
    std::string operator()(WaitForTurn const&) const { return "wait"; }
    std::string operator()(BeginDownload const& begin) const
    {
        return "begin" + describe(begin.capabilities);
    }
    std::string operator()(FetchHistory const& fetch) const
    {
        return fetch.with_files ? "fetch history and files" : "fetch history";
    }
    std::string operator()(SearchHistory const&) const { return "search history"; }
    std::string operator()(FetchCommit const& fetch) const
    {
        return std::string("fetch commit") + (fetch.shallow ? "" : " deep") +
               (fetch.without_files ? " without files" : "");
    }
    std::string operator()(LayOut const&) const { return "lay out"; }
    std::string operator()(FetchFiles const& fetch) const
    {
        switch (fetch.files) {
        case GitFiles::all:
            return "fetch files";
        case GitFiles::of_project:
            return "fetch files of project";
        case GitFiles::all_after_project:
            break;
        }
        return "fetch files above";
    }
    std::string operator()(ReadWorlds const&) const { return "read worlds"; }
    std::string operator()(Unpack const&) const { return "unpack"; }
    std::string operator()(FindLargeFiles const&) const { return "find large files"; }
    std::string operator()(FetchLargeFiles const&) const { return "fetch large files"; }
    std::string operator()(Publish const&) const { return "publish"; }
    std::string operator()(MakeRoom const&) const { return "make room"; }
    std::string operator()(Succeed const& end) const
    {
        return end.notice.empty() ? "done" : "stale: " + end.notice;
    }
    std::string operator()(Fail const& end) const { return "fail: " + end.failure.message(); }
};

std::string words(GitAction const& action)
{
    return std::visit(Words(), action);
}

bool is_end(GitAction const& action)
{
    return std::holds_alternative<Succeed>(action) || std::holds_alternative<Fail>(action);
}

struct Stop
{
    GitOutcome outcome;
    std::string_view next;
};

/// What is asked for, what is known of the server, and what is done first.
struct Beginning
{
    std::string_view address;
    GitServerFacts facts;
    std::string_view first;
};

/// One fetch: where it begins, and every stop on its way.
struct Row
{
    std::string_view name;
    Beginning beginning;
    std::vector<Stop> stops;
};

void check(std::vector<Row> const& rows, GitPurpose purpose = GitPurpose::folder)
{
    for (auto const& row : rows) {
        GitFetchPlan plan(project(row.beginning.address), purpose);
        auto action = plan.start(row.beginning.facts);
        BOOST_TEST(words(action) == row.beginning.first, row.name << ": begins with " << words(action));
        std::size_t number = 0;
        for (auto const& stop : row.stops) {
            BOOST_REQUIRE_MESSAGE(!is_end(action), row.name << ": ends early, with " << words(action));
            action = plan.next(stop.outcome);
            ++number;
            BOOST_TEST(words(action) == stop.next,
                       row.name << ": stop " << number << " is " << words(action));
        }
    }
}

// ---- outcomes ------------------------------------------------------------------------------------------

GitOutcome refs()
{
    RefsReceived received;
    received.refs = {{"refs/heads/main", id(1)}, {"refs/heads/other", id(2)}};
    return received;
}

/// None of them points to the commit 1.
GitOutcome other_refs(int count = 2)
{
    RefsReceived received;
    for (int i = 0; i < count; ++i)
        received.refs.push_back({"refs/heads/b" + std::to_string(i), id(2 + i)});
    return received;
}

GitOutcome problem(GitProblem kind)
{
    return Failed(Failure(kind, "words"));
}

/// Before the pack began.
GitOutcome not_understood(GitProblem kind = GitProblem::server_error)
{
    return Failed(Failure(kind, "words"), false);
}

GitOutcome sentence(errc code)
{
    return Failed(Failure(code, "A sentence."));
}

GitOutcome aborted()
{
    return Failed(Failure(boost::asio::error::operation_aborted, "aborted"));
}

GitOutcome disk_full()
{
    return Failed(Failure(make_error_code(boost::system::errc::no_space_on_device), "The disk is full."));
}

GitCapabilities offer(bool version_2, bool shallow, bool filter)
{
    GitCapabilities made;
    made.version_2 = version_2;
    made.shallow = shallow;
    made.filter = filter;
    return made;
}

GitOutcome offered(bool version_2, bool shallow, bool filter)
{
    return CapabilitiesReceived{offer(version_2, shallow, filter)};
}

GitServerFacts known(bool version_2, bool shallow, bool filter)
{
    GitServerFacts facts;
    facts.known = offer(version_2, shallow, filter);
    return facts;
}

GitOutcome laid_out(std::size_t missing = 3)
{
    return LaidOut{missing};
}

/// Stops of a look-up that ends with a download, before others.
std::vector<Stop> after_look_up(std::vector<Stop> stops)
{
    std::vector<Stop> all = {{refs(), "find"}, {CacheMiss(), "wait"}};
    all.insert(all.end(), stops.begin(), stops.end());
    return all;
}

/// The same for one whose download has begun.
std::vector<Stop> downloading(std::string_view what, std::vector<Stop> stops)
{
    stops.insert(stops.begin(), {{Turn(), "begin v2"}, {Begun(), what}});
    return after_look_up(std::move(stops));
}

/// The same for a commit that no branch points to.
std::vector<Stop> after_unknown_commit(std::vector<Stop> stops)
{
    std::vector<Stop> all = {
        {CacheMiss(), "list refs all"}, {other_refs(), "find"}, {CacheMiss(), "wait"}, {Turn(), "begin v2"}};
    all.insert(all.end(), stops.begin(), stops.end());
    return all;
}

GitServerFacts const nothing;
GitServerFacts const missing{true, std::nullopt};
std::string const commit_in_folder = commit_1 + "/a/b";
Beginning const of_main{"main", nothing, "list refs"};
Beginning const of_folder{"main/a", nothing, "list refs"};
Beginning const of_commit{commit_1, nothing, "find commit"};
Beginning const of_folder_of_commit{commit_in_folder, nothing, "find commit"};
constexpr std::string_view unreachable =
    "fail: https://forge.example can't be reached: words. Try again later.";
constexpr std::string_view says_words = "fail: https://forge.example: words.";
constexpr std::string_view no_folder = "fail: Repository ann/robots has no folder \"words\".";
constexpr std::string_view stale =
    "stale: https://forge.example can't be reached: words. Starting ann/robots from the cache.";

std::string about_commit(Refused why)
{
    return "fail: " + refused(why, {{"commit", "000100000000"}, {"name", "ann/robots"}}).message();
}

std::string const not_newest = about_commit(Refused::commit_not_newest);
std::string const on_no_branch = about_commit(Refused::commit_on_no_branch);
std::string const not_looked_for = about_commit(Refused::history_too_large);

} // namespace

BOOST_AUTO_TEST_CASE(the_address_is_resolved_and_looked_for_in_the_cache)
{
    check({
        {"hit", of_main, {{refs(), "find"}, {CacheHit(), "done"}}},
        {"miss", of_main, {{refs(), "find"}, {CacheMiss(), "wait"}}},
        {"known to be missing",
         Beginning{"main", missing, "fail: Repository ann/robots does not exist or is private."},
         {}},
        {"no such ref",
         Beginning{"dev", nothing, "list refs"},
         {{refs(), "forget"}, {Done(), "fail: Repository ann/robots has no branch or tag \"dev\"."}}},
        {"a commit in the cache is the repository's own",
         of_commit,
         {{CacheHit(), "find"}, {CacheHit(), "done"}}},
        {"its folder is not there",
         of_folder_of_commit,
         {{CacheHit(), "find"},
          {CacheMiss(), "wait"},
          {Turn(), "begin v2"},
          {Begun(), "fetch commit without files"}}},
        {"a commit that a branch points to",
         of_commit,
         {{CacheMiss(), "list refs all"},
          {refs(), "find"},
          {CacheMiss(), "wait"},
          {Turn(), "begin v2"},
          {Begun(), "fetch commit"}}},
    });
}

BOOST_AUTO_TEST_CASE(a_server_that_can_not_be_asked_is_replaced_by_the_cache)
{
    for (auto const kind : {GitProblem::unreachable, GitProblem::timed_out})
        check({
            {"in the cache", of_main, {{problem(kind), "find last"}, {CacheHit(), stale}}},
            {"not there", of_main, {{problem(kind), "find last"}, {CacheMiss(), unreachable}}},
        });
    check({
        {"our own deadline",
         of_main,
         {{sentence(errc::timed_out), "find last"}, {CacheMiss(), "fail: A sentence."}}},
        {"aborted", of_main, {{aborted(), "fail: aborted"}}},
        {"no memory for the refs", of_main, {{sentence(errc::unavailable), "fail: A sentence."}}},
        {"too many refs",
         of_main,
         {{problem(GitProblem::too_many_refs),
           "fail: Repository ann/robots has too many branches that begin alike."}}},
        {"refs without end", of_main, {{problem(GitProblem::answer_too_large), says_words}}},
    });
}

BOOST_AUTO_TEST_CASE(capabilities_are_asked_for_when_the_refs_are_not_understood)
{
    check({
        {"an old server",
         of_main,
         {{problem(GitProblem::malformed), "ask"},
          {offered(false, true, false), "remember old unfiltered"},
          {Done(), "list refs old"},
          {refs(), "find"}}},
        {"an old server behind another address",
         of_main,
         {{problem(GitProblem::no_such_repository), "ask"},
          {offered(false, false, false), "remember old deep unfiltered"},
          {Done(), "list refs old"}}},
        {"a new one that makes mistakes",
         of_main,
         {{problem(GitProblem::malformed), "ask"},
          {offered(true, true, true), "find last"},
          {CacheMiss(), says_words}}},
        {"SHA-256",
         of_main,
         {{problem(GitProblem::malformed), "ask"},
          {problem(GitProblem::unknown_format),
           "fail: Repository ann/robots has SHA-256 object names, which are not supported."}}},
        {"it has stopped answering",
         of_main,
         {{problem(GitProblem::malformed), "ask"},
          {problem(GitProblem::unreachable), "find last"},
          {CacheMiss(), says_words}}},
        {"no such repository",
         of_main,
         {{problem(GitProblem::no_such_repository), "ask"},
          {problem(GitProblem::no_such_repository), "remember missing"},
          {Done(), "forget"},
          {Done(), "fail: Repository ann/robots does not exist or is private."}}},
        {"a new server without it",
         of_main,
         {{problem(GitProblem::no_such_repository), "ask"},
          {offered(true, true, true), "remember missing"},
          {Done(), "forget"}}},
        {"missing, or is it?",
         of_main,
         {{problem(GitProblem::no_such_repository), "ask"},
          {problem(GitProblem::unreachable), "find last"},
          {CacheMiss(), unreachable}}},
    });
}

BOOST_AUTO_TEST_CASE(what_is_known_of_a_server_is_not_asked_again)
{
    auto const old = known(false, true, false);
    auto const current = known(true, true, false);
    check({
        {"old", Beginning{"main", old, "list refs old"}, {{refs(), "find"}}},
        {"old, without the repository",
         Beginning{"main", old, "list refs old"},
         {{problem(GitProblem::no_such_repository), "remember missing"},
          {Done(), "forget"},
          {Done(), "fail: Repository ann/robots does not exist or is private."}}},
        {"old, malformed",
         Beginning{"main", old, "list refs old"},
         {{problem(GitProblem::malformed), "find last"}, {CacheHit(), stale}}},
        {"current, malformed",
         Beginning{"main", current, "list refs"},
         {{problem(GitProblem::malformed), "find last"}, {CacheMiss(), says_words}}},
        {"learned while it waited", of_folder,
         after_look_up({{Turn{offer(true, true, false)}, "begin v2 unfiltered"}, {Begun(), "fetch commit"}})},
    });
}

BOOST_AUTO_TEST_CASE(a_download_fetches_no_more_than_is_needed)
{
    check({
        {"a whole repository", of_main,
         downloading("fetch commit", {{PackReceived(), "lay out"},
                                      {laid_out(0), "fetch files"},
                                      {PackReceived(), "unpack"},
                                      {Done(), "find large files"},
                                      {Done(), "publish"},
                                      {Done(), "done"}})},
        {"with large files", of_main,
         downloading("fetch commit", {{PackReceived(), "lay out"},
                                      {laid_out(0), "fetch files"},
                                      {PackReceived(), "unpack"},
                                      {Done(), "find large files"},
                                      {PointersFound(), "fetch large files"},
                                      {Done(), "publish"},
                                      {Done(), "done"}})},
        {"a folder", Beginning{"main/a/b", nothing, "list refs"},
         downloading("fetch commit without files",
                     {{PackReceived(), "lay out"}, {laid_out(), "fetch files"}, {PackReceived(), "unpack"}})},
        {"another folder is in the cache", of_main,
         after_look_up({{Turn(), "begin v2"}, {Begun{true}, "fetch commit without files"}})},
        {"without filters", Beginning{"main/a/b", known(true, true, false), "list refs"},
         after_look_up(
             {{Turn{offer(true, true, false)}, "begin v2 unfiltered"}, {Begun{true}, "fetch commit"}})},
        {"with its history", Beginning{"main", known(true, false, true), "list refs"},
         after_look_up({{Turn{offer(true, false, true)}, "begin v2 deep"}, {Begun(), "fetch commit deep"}})},
        {"an old server sends all there is",
         Beginning{"main/a/b", known(false, true, false), "list refs old"},
         after_look_up({{Turn{offer(false, true, false)}, "begin old unfiltered"},
                        {Begun{true}, "fetch commit"},
                        {PackReceived(), "lay out"},
                        {laid_out(), "unpack"}})},
    });
}

BOOST_AUTO_TEST_CASE(worlds_are_listed_without_the_files_of_a_project_and_nothing_is_kept)
{
    auto const begun = [](std::vector<Stop> stops) {
        stops.insert(stops.begin(), {{refs(), "wait"},
                                     {Turn(), "begin v2"},
                                     {Begun(), "fetch commit without files"},
                                     {PackReceived(), "lay out"}});
        return stops;
    };
    check(
        {
            {"of a whole repository", of_main,
             begun({{laid_out(), "fetch files"}, {PackReceived(), "read worlds"}, {Done(), "done"}})},
            {"a server that sends no single files", of_folder,
             begun({{laid_out(), "fetch files"},
                    {problem(GitProblem::object_not_advertised), "read worlds"},
                    {Done(), "done"}})},
            {"worlds too large to be read", of_main,
             begun({{laid_out(), "fetch files"},
                    {sentence(errc::too_large), "read worlds"},
                    {Done(), "done"}})},
            {"a folder that is not there", of_folder,
             begun({{problem(GitProblem::no_such_folder), no_folder}})},
            {"an old server",
             Beginning{"main", known(false, true, false), "list refs old"},
             {{refs(), "wait"},
              {Turn{offer(false, true, false)}, "begin old unfiltered"},
              {Begun(), "fetch commit"},
              {PackReceived(), "lay out"},
              {laid_out(), "read worlds"}}},
            {"a server that can't be asked", of_main, {{problem(GitProblem::unreachable), unreachable}}},
            {"a commit that no branch points to",
             of_commit,
             {{CacheMiss(), "list refs all"},
              {other_refs(), "wait"},
              {Turn(), "begin v2"},
              {Begun(), "fetch commit without files"},
              {PackReceived(), "lay out"},
              {laid_out(), "fetch history and files"},
              {PackReceived(), "search history"},
              {NotInHistory(), on_no_branch}}},
        },
        GitPurpose::worlds);
}

BOOST_AUTO_TEST_CASE(the_ref_of_a_list_is_the_default_branch_where_none_is_named)
{
    RefsReceived received;
    received.refs = {
        {"HEAD", id(1), "refs/heads/team/main"}, {"refs/heads/team/main", id(1)}, {"refs/heads/dev", id(2)}};
    for (auto const& [address, ref] : {std::pair("HEAD", "team/main"),
                                       {"HEAD/a/b", "team/main"},
                                       {"dev/a", "dev"},
                                       {"team/main", "team/main"}}) {
        GitFetchPlan plan(project(address), GitPurpose::worlds);
        (void)plan.start(nothing);
        (void)plan.next(received);
        BOOST_TEST(plan.ref() == ref, address);
    }
}

BOOST_AUTO_TEST_CASE(whose_a_commit_is_is_known_before_its_files_travel)
{
    check({
        {"a whole repository", of_commit,
         after_unknown_commit({{Begun(), "fetch history"},
                               {PackReceived(), "search history"},
                               {InHistory(), "fetch commit"},
                               {PackReceived(), "lay out"},
                               {laid_out(), "fetch files"}})},
        {"somebody else's", of_commit,
         after_unknown_commit({{Begun(), "fetch history"},
                               {PackReceived(), "search history"},
                               {NotInHistory(), on_no_branch}})},
        {"a folder, together with its files", of_folder_of_commit,
         after_unknown_commit({{Begun(), "fetch commit without files"},
                               {PackReceived(), "lay out"},
                               {laid_out(), "fetch history and files"},
                               {PackReceived(), "search history"},
                               {InHistory(), "fetch files"},
                               {PackReceived(), "unpack"}})},
        {"a folder whose files are all there", of_folder_of_commit,
         after_unknown_commit({{Begun(), "fetch commit without files"},
                               {PackReceived(), "lay out"},
                               {laid_out(0), "fetch history"}})},
        {"too many files for one request", of_folder_of_commit,
         after_unknown_commit({{Begun(), "fetch commit without files"},
                               {PackReceived(), "lay out"},
                               {laid_out(max_git_wants - 1), "fetch history"}})},
        {"not both at once", of_folder_of_commit,
         after_unknown_commit({{Begun(), "fetch commit without files"},
                               {PackReceived(), "lay out"},
                               {laid_out(), "fetch history and files"},
                               {not_understood(GitProblem::object_not_advertised), "fetch history"},
                               {PackReceived(), "search history"},
                               {InHistory(), "fetch files"}})},
        {"the server can't filter folders", of_commit,
         after_unknown_commit(
             {{Begun(), "fetch history"}, {not_understood(GitProblem::filter_not_supported), not_newest}})},
        {"a history without end", of_commit,
         after_unknown_commit({{Begun(), "fetch history"}, {sentence(errc::too_large), not_looked_for}})},
        {"the server goes away", of_commit,
         after_unknown_commit({{Begun(), "fetch history"}, {problem(GitProblem::unreachable), unreachable}})},
        {"the search takes too long", of_commit,
         after_unknown_commit({{Begun(), "fetch history"},
                               {PackReceived(), "search history"},
                               {sentence(errc::timed_out), "fail: A sentence."}})},
        {"a server that can't tell",
         Beginning{commit_1, known(true, true, false), "find commit"},
         {{CacheMiss(), "list refs all"},
          {other_refs(), "find"},
          {CacheMiss(), "wait"},
          {Turn{offer(true, true, false)}, "begin v2 unfiltered"},
          {Begun(), not_newest}}},
        {"too many branches",
         of_commit,
         {{CacheMiss(), "list refs all"},
          {other_refs(static_cast<int>(max_git_wants) + 1), "find"},
          {CacheMiss(), "wait"},
          {Turn(), "begin v2"},
          {Begun(), not_looked_for}}},
        {"no branches at all",
         of_commit,
         {{CacheMiss(), "list refs all"},
          {other_refs(0), "find"},
          {CacheMiss(), "wait"},
          {Turn(), "begin v2"},
          {Begun(), "search history"},
          {NotInHistory(), on_no_branch}}},
    });
}

BOOST_AUTO_TEST_CASE(files_above_the_project_never_hold_it_up)
{
    auto const to_files = [](std::vector<Stop> stops) {
        auto all = downloading("fetch commit without files",
                               {{PackReceived(), "lay out"}, {laid_out(), "fetch files"}});
        all.insert(all.end(), stops.begin(), stops.end());
        return all;
    };
    check({
        {"too large", of_folder,
         to_files({{ParentFilesStopped{true}, "fetch files of project"}, {PackReceived(), "unpack"}})},
        {"it was a file of the project", of_folder,
         to_files({{ParentFilesStopped{false}, "fetch files of project"},
                   {PackReceived(), "fetch files above"},
                   {PackReceived(), "unpack"}})},
        {"it was none", of_folder,
         to_files({{ParentFilesStopped{false}, "fetch files of project"},
                   {PackReceived(), "fetch files above"},
                   {ParentFilesStopped{true}, "unpack"}})},
        {"the project is too large without them", of_folder,
         to_files({{ParentFilesStopped{true}, "fetch files of project"},
                   {sentence(errc::too_large), "fail: A sentence."}})},
        {"with the history", of_folder_of_commit,
         after_unknown_commit({{Begun(), "fetch commit without files"},
                               {PackReceived(), "lay out"},
                               {laid_out(), "fetch history and files"},
                               {ParentFilesStopped{false}, "fetch history"},
                               {PackReceived(), "search history"},
                               {InHistory(), "fetch files of project"},
                               {PackReceived(), "fetch files above"}})},
    });
}

BOOST_AUTO_TEST_CASE(capabilities_are_asked_for_when_a_download_is_not_understood)
{
    check({
        {"an old server", of_main,
         downloading("fetch commit", {{not_understood(), "ask"},
                                      {offered(false, true, false), "remember old unfiltered"},
                                      {Done(), "begin old unfiltered"},
                                      {Begun(), "fetch commit"},
                                      {PackReceived(), "lay out"},
                                      {laid_out(0), "unpack"},
                                      {Done(), "find large files"},
                                      {Done(), "publish"},
                                      {Done(), "remember old unfiltered"},
                                      {Done(), "done"}})},
        {"no filter", of_folder,
         downloading("fetch commit without files", {{not_understood(), "ask"},
                                                    {offered(true, true, false), "begin v2 unfiltered"},
                                                    {Begun(), "fetch commit"},
                                                    {PackReceived(), "lay out"},
                                                    {laid_out(), "fetch files"},
                                                    {PackReceived(), "unpack"},
                                                    {Done(), "find large files"},
                                                    {Done(), "publish"},
                                                    {Done(), "remember v2 unfiltered"},
                                                    {Done(), "done"}})},
        {"it promises filters, and has none", of_folder,
         downloading("fetch commit without files", {{not_understood(GitProblem::filter_not_supported), "ask"},
                                                    {offered(true, true, true), "begin v2 unfiltered"}})},
        {"it promises files, and sends none", of_folder,
         downloading("fetch commit without files",
                     {{PackReceived(), "lay out"},
                      {laid_out(), "fetch files"},
                      {not_understood(GitProblem::object_not_advertised), "ask"},
                      {offered(true, true, true), "begin v2 unfiltered"}})},
        {"it can do what was asked", of_main,
         downloading("fetch commit", {{not_understood(), "ask"}, {offered(true, true, true), says_words}})},
        {"it does not answer any more", of_main,
         downloading("fetch commit",
                     {{not_understood(), "ask"}, {problem(GitProblem::unreachable), unreachable}})},
        {"only once", of_folder,
         downloading("fetch commit without files", {{not_understood(), "ask"},
                                                    {offered(true, false, false), "begin v2 deep unfiltered"},
                                                    {Begun(), "fetch commit deep"},
                                                    {not_understood(), says_words}})},
        {"not of a server that is known", Beginning{"main", known(true, true, false), "list refs"},
         after_look_up({{Turn{offer(true, true, false)}, "begin v2 unfiltered"},
                        {Begun(), "fetch commit"},
                        {not_understood(), says_words}})},
        {"not for a commit that is none", of_main,
         downloading("fetch commit", {{not_understood(GitProblem::object_not_advertised),
                                       "fail: Repository ann/robots has no such commit."}})},
        {"not once the pack has begun", of_main,
         downloading("fetch commit", {{problem(GitProblem::malformed), says_words}})},
    });
}

BOOST_AUTO_TEST_CASE(a_failure_ends_a_download_wherever_it_happens)
{
    std::vector<Stop> const way = {{Turn(), "begin v2"},
                                   {Begun(), "fetch commit without files"},
                                   {PackReceived(), "lay out"},
                                   {laid_out(), "fetch files"},
                                   {PackReceived(), "unpack"},
                                   {Done(), "find large files"},
                                   {PointersFound(), "fetch large files"},
                                   {Done(), "publish"}};
    std::pair<GitOutcome, std::string_view> const failures[] = {
        {aborted(), "fail: aborted"},
        {sentence(errc::timed_out), "fail: A sentence."},
        {sentence(errc::too_large), "fail: A sentence."},
        {sentence(errc::unavailable), "fail: A sentence."},
        {problem(GitProblem::object_missing), says_words},
        {problem(GitProblem::no_such_folder), no_folder},
        {problem(GitProblem::not_a_commit),
         "fail: Repository ann/robots has no commit at \"words\", but something else."},
        {problem(GitProblem::unreachable), unreachable},
    };
    for (std::size_t until = 1; until <= way.size(); ++until)
        for (auto const& [outcome, end] : failures) {
            std::vector<Stop> stops(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(until));
            stops.push_back({outcome, end});
            check({{"a failure", of_folder, after_look_up(std::move(stops))}});
        }
}

BOOST_AUTO_TEST_CASE(a_full_disk_is_given_one_more_chance)
{
    check({
        {"room was made", of_main,
         downloading("fetch commit", {{disk_full(), "make room"},
                                      {Done(), "begin v2"},
                                      {Begun(), "fetch commit"},
                                      {PackReceived(), "lay out"},
                                      {laid_out(0), "fetch files"},
                                      {PackReceived(), "unpack"},
                                      {disk_full(), "fail: The disk is full."}})},
        {"there was nothing to remove", of_main,
         after_look_up({{Turn(), "begin v2"},
                        {disk_full(), "make room"},
                        {sentence(errc::unavailable), "fail: The disk is full."}})},
        {"a commit is not looked for twice", of_commit,
         after_unknown_commit({{Begun(), "fetch history"},
                               {PackReceived(), "search history"},
                               {InHistory(), "fetch commit"},
                               {disk_full(), "make room"},
                               {Done(), "begin v2"},
                               {Begun(), "fetch commit"}})},
    });
}

namespace {

/// Outcomes in an order that is always the same.
class Chance
{
public:
    std::size_t any(std::size_t count) { return static_cast<std::size_t>(random_() % count); }

    GitCapabilities offer() { return git_fetch_plan::offer(any(2) == 0, any(2) == 0, any(2) == 0); }

    /// Whatever there is, also what can't become of any action.
    GitOutcome outcome()
    {
        switch (any(17)) {
        case 0:
            return not_understood(static_cast<GitProblem>(1 + any(16)));
        case 1:
            return problem(static_cast<GitProblem>(1 + any(16)));
        case 2:
            return disk_full();
        case 3:
            return sentence(static_cast<errc>(1 + any(12)));
        case 4:
            return CacheHit();
        case 5:
        case 6:
            return CacheMiss();
        case 7:
            return refs();
        case 8:
            return other_refs(static_cast<int>(any(4)));
        case 9:
            return CapabilitiesReceived{offer()};
        case 10:
            return any(2) == 0 ? Turn() : Turn{offer()};
        case 11:
            return Begun{any(2) == 0};
        case 12:
            return ParentFilesStopped{any(2) == 0};
        case 13:
            return any(4) == 0 ? GitOutcome(NotInHistory()) : GitOutcome(InHistory());
        case 14:
            return laid_out(any(3));
        case 15:
            return PointersFound();
        default:
            return PackReceived();
        }
    }

    /// Of those that may follow the action, one after which the plan may try again.
    GitOutcome trouble(GitAction const& action)
    {
        if (std::holds_alternative<AskCapabilities>(action))
            return CapabilitiesReceived{offer()};
        if (std::holds_alternative<ListRefs>(action))
            return any(2) == 0 ? not_understood(GitProblem::malformed) : other_refs();
        if (std::holds_alternative<LayOut>(action))
            return laid_out(any(3));
        if (std::holds_alternative<SearchHistory>(action))
            return InHistory();
        bool const is_transfer = std::holds_alternative<FetchCommit>(action) ||
                                 std::holds_alternative<FetchHistory>(action) ||
                                 std::holds_alternative<FetchFiles>(action);
        switch (is_transfer ? any(5) : any(2)) {
        case 0:
            return Done();
        case 1:
            return std::holds_alternative<MakeRoom>(action) ? Done() : disk_full();
        case 2:
            return not_understood(GitProblem::filter_not_supported);
        case 3:
            return ParentFilesStopped{any(2) == 0};
        default:
            return PackReceived();
        }
    }

private:
    std::mt19937 random_{1};
};

} // namespace

BOOST_AUTO_TEST_CASE(a_plan_always_ends)
{
    // Four downloads at most (with what the server can do, and with what it says; each again after room was
    // made), of twelve actions at most, and some around them.
    constexpr int max_actions = 60;
    std::string const addresses[] = {"main", "main/a/b", "b0", commit_1, commit_in_folder, ""};
    Chance chance;
    int longest = 0;
    int successes = 0;
    for (int walk = 0; walk < 100'000; ++walk) {
        GitFetchPlan plan(project(addresses[chance.any(std::size(addresses))]));
        GitServerFacts facts;
        facts.is_missing = chance.any(20) == 0;
        if (chance.any(2) == 0)
            facts.known = chance.offer();
        bool const is_likely = chance.any(2) == 0;
        auto action = plan.start(facts);
        int actions = 1;
        for (; !is_end(action) && actions <= max_actions; ++actions)
            action = plan.next(is_likely ? chance.trouble(action) : chance.outcome());
        BOOST_REQUIRE_LE(actions, max_actions);
        longest = std::max(longest, actions);
        successes += std::holds_alternative<Succeed>(action) ? 1 : 0;
        if (auto const* const failed = std::get_if<Fail>(&action))
            BOOST_REQUIRE(!git_problem(failed->failure)); // callers know public codes only
    }
    BOOST_TEST_MESSAGE("the longest of " << successes << " successes and more had " << longest << " actions");
    BOOST_TEST(longest > 30); // the walks did go far
    BOOST_TEST(successes > 1000);
}

BOOST_AUTO_TEST_SUITE_END()
